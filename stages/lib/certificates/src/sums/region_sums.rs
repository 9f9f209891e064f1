//! Certifies one region against all pairs by sums of squares: the smallest shrinking about its centre for which every
//! pair has a proof.
//!
//! Pairs are taken in order, each on the region as far as earlier pairs have shrunk it, and on a smaller one by
//! bisection where it has no proof there. A proof for a larger region serves the final one, whose rows imply the larger
//! one's. So the result does not depend on the number of workers.

use crate::cell::CellBox;
use crate::certify_region::{Candidate, CertifiedRegion, CertifyOutcome};
use crate::contact::least_gap;
use crate::row_program::RowProgram;
use crate::rows::{Multipliers, Rows};
use crate::sums::pair_sums::PairSums;
use crate::sums::search_sums::{SumsRegion, SumsSettings, search_sums};
use convex_sets::HPolyhedron;
use ipc_types::artefact::{PairCertificate, PairProof, RegionCertificate, RowOrigin, SosProof, SweptRow};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// How far a region may be shrunk, and how finely.
#[derive(Debug, Clone, Copy)]
pub struct Shrinking {
    /// The ratio is found up to this.
    pub resolution: f64,
    /// Smallest ratio; below it the region is rejected.
    pub least: f64,
}

/// The candidate shrunk about its centre: c + ratio (P − c), with the same rows.
struct Shrunk<'a> {
    candidate: &'a Candidate,
    slack: Vec<f64>,
}

impl<'a> Shrunk<'a> {
    fn new(candidate: &'a Candidate) -> Self {
        let P = &candidate.polyhedron;
        let slack = &P.b - &P.A * &candidate.center;
        Self { candidate, slack: slack.iter().copied().collect() }
    }

    fn polyhedron(&self, ratio: f64) -> HPolyhedron {
        let P = &self.candidate.polyhedron;
        let b = DVector::from_fn(P.b.len(), |r, _| P.b[r] - (1.0 - ratio) * self.slack[r]);
        HPolyhedron { A: P.A.clone(), b }
    }

    /// The ratio at which `q` is on the boundary.
    fn ratio_of(&self, q: &[f64]) -> f64 {
        let A = &self.candidate.polyhedron.A;
        let along =
            |r: usize| (0..q.len()).map(|j| A[(r, j)] * (q[j] - self.candidate.center[j])).sum::<f64>();
        (0..self.slack.len()).map(|r| along(r) / self.slack[r]).fold(0.0, f64::max)
    }
}

/// Certifies `candidate`, which must be valid, shrinking it where needed.
pub fn certify_by_sums(
    pairs: &[PairSums],
    limits: &CellBox,
    candidate: &Candidate,
    shrinking: Shrinking,
    settings: &SumsSettings,
    is_stopped: &dyn Fn() -> bool,
) -> CertifyOutcome {
    let shrunk = Shrunk::new(candidate);
    let center: Vec<f64> = candidate.center.iter().copied().collect();
    let mut n_solved = 0;
    let mut ratio = 1.0;
    let mut proofs: Vec<(f64, SosProof)> = Vec::with_capacity(pairs.len());
    for pair in pairs {
        let mut attempt = |frames: &[usize], ratio: f64| {
            let rows = Rows::new(&shrunk.polyhedron(ratio));
            let region = SumsRegion { rows: &rows, limits, center: &center };
            search_sums(pair, frames, &region, settings, &mut n_solved)
        };
        let mut frames = pair.frame_order();
        frames.truncate(settings.max_frames);
        let reject = |configuration: Vec<f64>, reason: String| CertifyOutcome::Rejected {
            pair: pair.model.pair,
            configuration,
            reason,
        };
        // A collision bounds the ratio without a programme.
        let mut upper = ratio;
        if let Some(q) = collision(pair, &Rows::new(&shrunk.polyhedron(ratio)), limits, &center) {
            upper = (shrunk.ratio_of(&q) - shrinking.resolution).min(ratio);
        }
        if upper < shrinking.least {
            let reason = format!("a collision leaves less than {} of its width", shrinking.least);
            return reject(center, reason);
        }
        if is_stopped() {
            return CertifyOutcome::Stopped;
        }
        if let Some((_, proof)) = attempt(&frames, upper) {
            ratio = upper;
            proofs.push((ratio, proof));
            continue;
        }
        let smallest = if upper > shrinking.least { attempt(&frames, shrinking.least) } else { None };
        let Some((frame, mut best)) = smallest else {
            let reason = format!("no sum of squares was found even at {} of its width", shrinking.least);
            return reject(center, reason);
        };
        ratio = shrinking.least;
        while upper - ratio > shrinking.resolution {
            if is_stopped() {
                return CertifyOutcome::Stopped;
            }
            let middle = 0.5 * (ratio + upper);
            match attempt(&[frame], middle) {
                Some((_, proof)) => (ratio, best) = (middle, proof),
                None => upper = middle,
            }
        }
        proofs.push((ratio, best));
    }
    let polyhedron = shrunk.polyhedron(ratio);
    let certificate = assemble(&shrunk, ratio, pairs, proofs, candidate.region_id);
    let volume_kept = ratio.powi(center.len() as i32);
    CertifyOutcome::Certified(Box::new(CertifiedRegion {
        polyhedron,
        center: candidate.center.clone(),
        certificate,
        volume_kept,
        n_cells: n_solved,
        n_cuts: 0,
        n_reused: 0,
    }))
}

/// A configuration of the region where the pair is closer than it may be, by descent of the gap from the centre.
fn collision(pair: &PairSums, rows: &Rows, limits: &CellBox, center: &[f64]) -> Option<Vec<f64>> {
    let (gap, q) = least_gap(&pair.model, rows, limits, center, &mut RowProgram::default());
    (gap < pair.model.clearance).then_some(q)
}

/// Rows: for each ratio those that its proofs use. Those of a larger ratio follow from the final region's.
fn assemble(
    shrunk: &Shrunk<'_>,
    final_ratio: f64,
    pairs: &[PairSums],
    proofs: Vec<(f64, SosProof)>,
    region_id: u64,
) -> RegionCertificate {
    let mut rows: Vec<SweptRow> = Vec::new();
    let mut positions: BTreeMap<(u64, u32), u32> = BTreeMap::new();
    let mut rename = |ratio: f64, multipliers: &mut Multipliers| {
        for (row, _) in multipliers {
            let face = *row;
            *row = *positions.entry((ratio.to_bits(), face)).or_insert_with(|| {
                let P = &shrunk.candidate.polyhedron;
                let b = shrunk.polyhedron(ratio).b[face as usize];
                let origin = if ratio == final_ratio {
                    RowOrigin::Face(face)
                } else {
                    RowOrigin::Implied(vec![(face, 1.0)])
                };
                rows.push(SweptRow { a: P.A.row(face as usize).iter().copied().collect(), b, origin });
                (rows.len() - 1) as u32
            });
        }
    };
    let pairs = pairs
        .iter()
        .zip(proofs)
        .map(|(pair, (ratio, mut proof))| {
            for joint in &mut proof.joints {
                rename(ratio, &mut joint.lower_multipliers);
                rename(ratio, &mut joint.upper_multipliers);
            }
            for row in &mut proof.rows {
                rename(ratio, &mut row.multipliers);
            }
            PairCertificate {
                body_a: pair.model.pair.body_a as u32,
                body_b: pair.model.pair.body_b as u32,
                clearance: pair.model.clearance,
                proof: PairProof::SumOfSquares(Box::new(proof)),
            }
        })
        .collect();
    RegionCertificate { region_id, rows, pairs }
}
