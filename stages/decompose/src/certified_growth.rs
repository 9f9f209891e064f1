//! Growth that the certifier's cuts guide.
//!
//! What a grower has made is certified, which cuts it where it is not provably free. The cuts stay as faces; about the
//! largest ellipsoid inside what was certified, all other faces are placed anew; and so on. The largest polytope that
//! was certified on the way is what comes out: certification then finds little to cut. It carries no certificate.

use certificates::CertifiedRegion;
use convex_sets::{HPolyhedron, HitAndRun};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::domain::Domain;
use crate::grower::{Draft, Growth};
use crate::provable::Bodies;

/// Samples of each of two polytopes by which their volumes are compared, and steps of the walk between two.
const N_SAMPLES: usize = 2000;
/// See [`N_SAMPLES`].
const MIXING_STEPS: usize = 3;
/// Certification of the largest polytope is repeated so often, while it still cuts but no longer loses a sample.
const MAX_SETTLINGS: usize = 3;

/// A polytope without what certification cut off.
struct Proven {
    /// Over all coordinates.
    polyhedron: HPolyhedron,
    /// In the domain's units; the first 2k faces are the unit box.
    over_u: HPolyhedron,
    /// The faces that are not the candidate's, in the domain's units.
    cuts: HPolyhedron,
    /// Share of the certifier's samples that is left.
    volume_kept: f64,
}

/// `growth.certify_rounds` rounds from `P`, in the domain's units, that the draft became; over all coordinates. `None`
/// if nothing was certified, or the oracle knows no certifier.
pub(crate) fn grow_certified(
    domain: &Domain<'_>,
    draft: &Draft,
    P: &HPolyhedron,
    growth: &Growth,
    rng: &mut ChaCha8Rng,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Option<HPolyhedron> {
    let bodies = domain.bodies()?;
    let certify = |region: &HPolyhedron| certified(domain, bodies, draft, region, is_stopped);
    let mut grower = growth.method.grower(domain)?;
    let mut best = certify(&domain.region(P))?;
    let mut fixed = domain.unit_box();
    let mut last_cuts = best.cuts.clone();
    for _ in 1..growth.certify_rounds {
        if last_cuts.n_faces() == 0 || grower.is_whole() {
            break;
        }
        fixed = fixed.intersection(&last_cuts);
        let Ok(inscribed) = best.over_u.max_inscribed_ellipsoid() else { break };
        // The cuts do not count against the budget.
        let max_faces = growth.max_faces + fixed.n_faces();
        let growth = Growth { max_faces, ..*growth };
        let grown = grower.separate(domain, &inscribed, &draft.witness, fixed.clone(), &growth, rng);
        let Ok(grown) = grown.remove_redundant_keeping(2 * domain.dim()) else { break };
        let Some(next) = certify(&domain.region(&grown)) else { break };
        last_cuts.clone_from(&next.cuts);
        if is_larger(&next.over_u, &best.over_u, rng) {
            best = next;
        }
    }
    for _ in 0..MAX_SETTLINGS {
        if best.cuts.n_faces() == 0 {
            break;
        }
        // Where it would lose more each time, the certifier may as well do so.
        match certify(&best.polyhedron) {
            Some(settled) if settled.volume_kept == 1.0 => best = settled,
            _ => break,
        }
    }
    Some(best.polyhedron)
}

fn certified(
    domain: &Domain<'_>,
    bodies: &Bodies<'_>,
    draft: &Draft,
    region: &HPolyhedron,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Option<Proven> {
    let witness: Vec<DVector<f64>> =
        draft.witness.ends().into_iter().map(|u| DVector::from_vec(domain.q_from_u(u))).collect();
    let CertifiedRegion { polyhedron, volume_kept, .. } = bodies.certified(region, &witness, is_stopped)?;
    let is_new = |face_idx: &usize| {
        !(0..region.n_faces()).any(|other| {
            polyhedron.b[*face_idx] == region.b[other] && polyhedron.A.row(*face_idx) == region.A.row(other)
        })
    };
    let new: Vec<usize> = (0..polyhedron.n_faces()).filter(is_new).collect();
    let (A, b) = polyhedron.select(&new);
    let over_u = domain.unit_box().intersection(&domain.faces_over_u(&polyhedron));
    Some(Proven { cuts: domain.faces_over_u(&HPolyhedron { A, b }), over_u, polyhedron, volume_kept })
}

/// Whether P has more volume than Q, by the share of either's samples that the other contains.
fn is_larger(P: &HPolyhedron, Q: &HPolyhedron, rng: &mut ChaCha8Rng) -> bool {
    match (n_inside(P, Q, rng), n_inside(Q, P, rng)) {
        // vol(P ∩ Q) / vol(P) against vol(P ∩ Q) / vol(Q); of disjoint ones the first stays.
        (Some(of_P), Some(of_Q)) => of_P < of_Q,
        (Some(_), None) => true,
        (None, _) => false,
    }
}

/// Of samples of `P`, how many `Q` contains; `None` if P has no interior.
fn n_inside(P: &HPolyhedron, Q: &HPolyhedron, rng: &mut ChaCha8Rng) -> Option<usize> {
    let ball = P.interior_point().ok()?;
    let k = P.ambient_dimension();
    let mut walk = HitAndRun::new(P, &ball.center, DMatrix::identity(k, k));
    let mut n_inside = 0;
    for _ in 0..N_SAMPLES {
        for _ in 0..MIXING_STEPS {
            walk.step(rng);
        }
        n_inside += usize::from(Q.contains(&DVector::from_column_slice(walk.point()), 0.0));
    }
    Some(n_inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn volumes_are_compared_by_samples() {
        let cube = |lower: f64, upper: f64| {
            HPolyhedron::from_box(&DVector::from_element(5, lower), &DVector::from_element(5, upper))
        };
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        // (0.9)⁵ = 0.59, and the same beside the other.
        for (small, large) in [(cube(0.0, 0.9), cube(0.0, 1.0)), (cube(0.3, 1.2), cube(0.0, 1.0))] {
            assert!(is_larger(&large, &small, &mut rng));
            assert!(!is_larger(&small, &large, &mut rng));
        }
    }
}
