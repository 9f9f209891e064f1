//! Which sets are empty, which do not meet, which lie in others: as far as multipliers say so.
//!
//! The search uses these relations and no others, so that whatever it concludes can be written down.

use super::sets::{BoxedSet, Sparse};
use ipc_types::artefact::{Mode, ProofSet};
use manipulation::{ConnectedRegions, Manipulation, PathMode, connected_regions};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// Both modes, in the order of every list here.
pub const MODES: [PathMode; 2] = [PathMode::Transit, PathMode::Transfer];

/// The relations of one decomposition.
#[derive(Debug, Clone)]
pub struct Relations {
    /// CG ∩ CP ∩ P_j by j.
    pub waypoint_sets: Vec<BoxedSet>,
    /// Proof that a set is empty.
    pub empty: BTreeMap<(ProofSet, usize), Sparse>,
    /// Proof that S ∩ P_a and S ∩ P_b do not meet, a < b; among these are all pairs of different connected regions.
    pub apart: BTreeMap<(PathMode, usize, usize), Sparse>,
    /// inner, outer, and for each face of P_outer the proof that W_inner keeps it; in the order in which they were left out.
    pub contained: Vec<(usize, usize, Vec<Sparse>)>,
    classes: [ConnectedRegions; 2],
}

impl Relations {
    /// The relations over the regions of `manipulation`.
    pub fn new(manipulation: &Manipulation) -> Self {
        let n_regions = manipulation.regions.len();
        let waypoint_sets: Vec<BoxedSet> =
            (0..n_regions).map(|idx| BoxedSet::of_waypoint(manipulation, idx)).collect();
        let mut empty = BTreeMap::new();
        for region_idx in 0..n_regions {
            for (mode, set) in MODES.into_iter().zip([ProofSet::Transit, ProofSet::Transfer]) {
                if manipulation.free(mode)[region_idx].is_none()
                    && let Some(proof) = BoxedSet::of_mode(manipulation, mode, &[region_idx]).emptiness()
                {
                    empty.insert((set, region_idx), proof);
                }
            }
            let known = |set| empty.contains_key(&(set, region_idx));
            if manipulation.grasp_placement[region_idx].is_none()
                && !known(ProofSet::Transit)
                && !known(ProofSet::Transfer)
                && let Some(proof) = waypoint_sets[region_idx].emptiness()
            {
                empty.insert((ProofSet::Waypoint, region_idx), proof);
            }
        }
        let mut relations = Self {
            waypoint_sets,
            empty,
            apart: BTreeMap::new(),
            contained: Vec::new(),
            classes: MODES.map(|_| ConnectedRegions { class_of: Vec::new(), members: Vec::new() }),
        };
        for (position, mode) in MODES.into_iter().enumerate() {
            relations.classes[position] = relations.join(manipulation, mode);
        }
        // Those within one connected region say nothing.
        let classes = relations.classes.clone();
        relations.apart.retain(|&(mode, a, b), _| !classes[position_of(mode)].same(a, b));
        relations
    }

    /// Connected regions of `mode`: what is not proven apart is joined.
    fn join(&mut self, manipulation: &Manipulation, mode: PathMode) -> ConnectedRegions {
        let n_regions = manipulation.regions.len();
        let present: Vec<bool> = (0..n_regions).map(|idx| !self.is_free_of(mode, idx)).collect();
        let mut open: Vec<(usize, usize)> = manipulation.overlaps(mode).open_pairs().collect();
        let known = connected_regions(&present, open.iter().copied());
        for a in 0..n_regions {
            for b in a + 1..n_regions {
                let both = present[a] && present[b];
                if both && !known.same(a, b) && !self.prove_apart(manipulation, mode, a, b) {
                    open.push((a, b));
                }
            }
        }
        connected_regions(&present, open.into_iter())
    }

    /// Whether S ∩ P_a and S ∩ P_b are proven not to meet; keeps the proof.
    pub fn prove_apart(&mut self, manipulation: &Manipulation, mode: PathMode, a: usize, b: usize) -> bool {
        let (a, b) = (a.min(b), a.max(b));
        if self.is_free_of(mode, a) || self.is_free_of(mode, b) || self.apart.contains_key(&(mode, a, b)) {
            return true;
        }
        match BoxedSet::of_mode(manipulation, mode, &[a, b]).emptiness() {
            Some(proof) => {
                self.apart.insert((mode, a, b), proof);
                true
            }
            None => false,
        }
    }

    /// Leaves out the grasps and releases in `inner` if all of them lie in P_outer.
    pub fn prove_contained(&mut self, manipulation: &Manipulation, inner: usize, outer: usize) -> bool {
        let (set, P) = (&self.waypoint_sets[inner], &manipulation.regions[outer]);
        let faces: Option<Vec<Sparse>> = (0..P.n_faces())
            .map(|face_idx| {
                let face: DVector<f64> = P.A.row(face_idx).transpose();
                set.implies(&face, P.b[face_idx])
            })
            .collect();
        match faces {
            Some(faces) => {
                self.contained.push((inner, outer, faces));
                true
            }
            None => false,
        }
    }

    /// Whether S ∩ P_idx is proven empty.
    pub fn is_free_of(&self, mode: PathMode, idx: usize) -> bool {
        let set = match mode {
            PathMode::Transit => ProofSet::Transit,
            PathMode::Transfer => ProofSet::Transfer,
        };
        self.empty.contains_key(&(set, idx))
    }

    /// Whether CG ∩ CP ∩ P_idx is proven empty.
    pub fn has_no_waypoint(&self, idx: usize) -> bool {
        self.is_free_of(PathMode::Transit, idx)
            || self.is_free_of(PathMode::Transfer, idx)
            || self.empty.contains_key(&(ProofSet::Waypoint, idx))
    }

    /// Names of the connected regions of the space of `mode`.
    pub fn classes(&self, mode: PathMode) -> Vec<usize> {
        self.classes[position_of(mode)].members.iter().map(|members| members[0]).collect()
    }

    /// The connected region of the space of `mode` that region `idx` belongs to, named by its first member.
    pub fn class(&self, mode: PathMode, idx: usize) -> Option<usize> {
        let classes = &self.classes[position_of(mode)];
        classes.class_of[idx].map(|class| classes.members[class][0])
    }
}

/// Position of a mode in [`MODES`].
fn position_of(mode: PathMode) -> usize {
    usize::from(mode == PathMode::Transfer)
}

/// The mode as files name it.
pub fn word_of(mode: PathMode) -> Mode {
    match mode {
        PathMode::Transit => Mode::Transit,
        PathMode::Transfer => Mode::Transfer,
    }
}
