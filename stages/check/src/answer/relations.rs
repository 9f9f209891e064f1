//! Connected regions of both modes, and the regions that grasps and releases may lie in.

use super::{AnswerError, Problem};
use crate::exact;
use ipc_types::artefact::{Mode, ProofFile, ProofSet};
use std::collections::BTreeSet;

/// What is proven of the regions of a problem.
#[derive(Debug)]
pub struct Relations {
    empty: BTreeSet<(ProofSet, usize)>,
    apart: BTreeSet<(Mode, usize, usize)>,
    transit_classes: Vec<Option<usize>>,
    transfer_classes: Vec<Option<usize>>,
    /// Regions that a grasp or release may lie in; others are not needed.
    pub inner: Vec<usize>,
}

impl Relations {
    /// Verifies all that the proof says of sets.
    pub fn verify(problem: &Problem, proof: &ProofFile) -> Result<Self, AnswerError> {
        let n_regions = problem.regions.len();
        let mut relations = Self {
            empty: BTreeSet::new(),
            apart: BTreeSet::new(),
            transit_classes: Vec::new(),
            transfer_classes: Vec::new(),
            inner: Vec::new(),
        };
        for entry in &proof.empty {
            let region = problem.region(entry.region)?;
            let set = match entry.set {
                ProofSet::Transit => problem.set_of_mode(Mode::Transit, &[region]),
                ProofSet::Transfer => problem.set_of_mode(Mode::Transfer, &[region]),
                ProofSet::Waypoint => problem.waypoint_set(region),
            };
            if !set.is_empty(list(proof, entry.multipliers)?)? {
                return Err(AnswerError::NotEmpty { set: entry.set, region });
            }
            relations.empty.insert((entry.set, region));
        }
        for entry in &proof.apart {
            let (a, b) = (problem.region(entry.a)?, problem.region(entry.b)?);
            let set = problem.set_of_mode(entry.mode, &[a.min(b), a.max(b)]);
            if a == b || !set.is_empty(list(proof, entry.multipliers)?)? {
                return Err(AnswerError::NotApart { mode: entry.mode.word(), a, b });
            }
            relations.apart.insert((entry.mode, a.min(b), a.max(b)));
        }
        let mut left_out = BTreeSet::new();
        for entry in &proof.contained {
            let (inner, outer) = (problem.region(entry.inner)?, problem.region(entry.outer)?);
            let (set, region) = (problem.waypoint_set(inner), problem.regions[outer]);
            if inner == outer || entry.faces.len() != region.A.len() || left_out.contains(&outer) {
                return Err(AnswerError::NotContained { inner, outer });
            }
            for (face_idx, &multipliers) in entry.faces.iter().enumerate() {
                let (a, b) = (&region.A[face_idx], region.b[face_idx]);
                if !set.implies(a, b, list(proof, multipliers)?)? {
                    return Err(AnswerError::NotContained { inner, outer });
                }
            }
            left_out.insert(inner);
        }
        relations.transit_classes = relations.classes(Mode::Transit, n_regions);
        relations.transfer_classes = relations.classes(Mode::Transfer, n_regions);
        let has_waypoint = |idx: usize| {
            [ProofSet::Transit, ProofSet::Transfer, ProofSet::Waypoint]
                .iter()
                .all(|&set| !relations.empty.contains(&(set, idx)))
        };
        relations.inner =
            (0..n_regions).filter(|idx| !left_out.contains(idx) && has_waypoint(*idx)).collect();
        Ok(relations)
    }

    /// The connected region of a region's set, named by its lowest position; `None` if the set is empty.
    pub fn class(&self, mode: Mode, region: usize) -> Option<usize> {
        match mode {
            Mode::Transit => self.transit_classes[region],
            Mode::Transfer => self.transfer_classes[region],
        }
    }

    /// Pairs (a, b), a in `inside`, b not, whose sets may meet; sorted.
    pub fn exits(&self, mode: Mode, inside: &BTreeSet<usize>) -> Vec<(usize, usize)> {
        let outside = || (0..self.transit_classes.len()).filter(|b| !inside.contains(b));
        inside
            .iter()
            .flat_map(|&a| outside().map(move |b| (a, b)))
            .filter(|&(a, b)| self.may_meet(mode, a, b))
            .collect()
    }

    fn may_meet(&self, mode: Mode, a: usize, b: usize) -> bool {
        let set = match mode {
            Mode::Transit => ProofSet::Transit,
            Mode::Transfer => ProofSet::Transfer,
        };
        let is_present = |idx: usize| !self.empty.contains(&(set, idx));
        is_present(a) && is_present(b) && !self.apart.contains(&(mode, a.min(b), a.max(b)))
    }

    /// Classes of what may meet, each named by its lowest member.
    fn classes(&self, mode: Mode, n_regions: usize) -> Vec<Option<usize>> {
        let mut class_of = vec![None; n_regions];
        for first in 0..n_regions {
            // A set meets itself unless it is empty.
            if class_of[first].is_some() || !self.may_meet(mode, first, first) {
                continue;
            }
            class_of[first] = Some(first);
            let mut queue = vec![first];
            while let Some(a) = queue.pop() {
                for b in 0..n_regions {
                    if class_of[b].is_none() && self.may_meet(mode, a, b) {
                        class_of[b] = Some(first);
                        queue.push(b);
                    }
                }
            }
        }
        class_of
    }
}

/// A list of multipliers.
pub fn list(proof: &ProofFile, position: u32) -> Result<&[(u32, f64)], AnswerError> {
    let count = proof.multipliers.len();
    let found = proof.multipliers.get(position as usize);
    found.map(Vec::as_slice).ok_or(AnswerError::NoSuch { what: "list of multipliers", position, count })
}

/// Regions whose faces hold at `q`, exactly.
pub fn holding(problem: &Problem, q: &[f64]) -> Vec<usize> {
    let holds = |idx: &usize| {
        let region = problem.regions[*idx];
        region.A.iter().zip(&region.b).all(|(a, b)| exact::satisfies(a, q, *b))
    };
    (0..problem.regions.len()).filter(holds).collect()
}
