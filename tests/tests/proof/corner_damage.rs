//! Kinds of damage to cells that were proven by the series of a body's corners.

use crate::damage::{Damage, certificates, damage};
use ipc_types::artefact::{Cell, CertificatesFile, CornersBound, NearCorners, PairProof};

/// The body of the arm's last link: one corner, its centre.
const SPHERE: u32 = 12;

/// Changes normal, corners and multipliers of a leaf; whether it took it.
type Change = fn(&mut [f64; 3], &mut Vec<NearCorners>, &mut Vec<(u32, f64)>) -> bool;

/// Applies `change` to the first leaf by corners that it takes.
fn leaf(change: Change) -> Box<dyn Fn(&std::path::Path)> {
    leaf_of(|_| true, change)
}

/// The same among the pairs whose first body `takes_body` takes.
fn leaf_of(takes_body: fn(u32) -> bool, change: Change) -> Box<dyn Fn(&std::path::Path)> {
    certificates(move |file: &mut CertificatesFile| {
        let pairs = file.regions.iter_mut().flat_map(|region| &mut region.pairs);
        let proofs = pairs.filter(|pair| takes_body(pair.body_a)).map(|pair| &mut pair.proof);
        let cells = proofs.flat_map(|proof| match proof {
            PairProof::Swept(proof) => &mut proof.cells[..],
            PairProof::SumOfSquares(_) => panic!("the run was certified by swept hulls"),
        });
        let mut leaves = cells.filter_map(|cell| match cell {
            Cell::Corners { normal, near, multipliers, .. } => Some((normal, near, multipliers)),
            _ => None,
        });
        assert!(
            leaves.any(|(normal, near, multipliers)| change(normal, near, multipliers)),
            "a leaf of that kind"
        );
    })
}

/// The first τ that is used with a concave part, and that part.
fn by_tangent(near: &mut [NearCorners]) -> Option<(&mut Vec<f32>, &mut Vec<f32>)> {
    near.iter_mut().find_map(|NearCorners { tangent, bounds, .. }| {
        let mut parts = bounds.iter_mut().filter_map(|bound| bound.concave.as_mut());
        let concave = parts.find(|concave| !concave.is_empty())?;
        Some((tangent, concave))
    })
}

fn by_sizes(near: &NearCorners) -> bool {
    near.bounds.iter().all(|bound| bound.concave.is_none())
}

/// All kinds.
pub fn all() -> Vec<Damage> {
    vec![
        damage(
            "a normal is turned round",
            leaf(|normal, near, _| {
                let takes = near.iter().all(by_sizes);
                if takes {
                    *normal = normal.map(|x| -x);
                }
                takes
            }),
            "the proven gap is",
        ),
        damage(
            "a normal is longer than a unit",
            leaf(|normal, _, _| {
                *normal = normal.map(|x| 1.001 * x);
                true
            }),
            "its normal is longer than a unit",
        ),
        damage(
            "a normal is not a number",
            leaf(|normal, _, _| {
                normal[0] = f64::NAN;
                true
            }),
            "its normal is longer than a unit",
        ),
        damage(
            "the proof of a corner is left out",
            leaf(|_, near, multipliers| {
                let needs_it = near.len() == 1 && !multipliers.is_empty() && !by_sizes(&near[0]);
                if needs_it {
                    near.clear();
                    multipliers.clear();
                }
                needs_it
            }),
            "the proven gap is",
        ),
        damage(
            "a corner that a body does not have",
            leaf_of(
                |body| body == SPHERE,
                |_, near, _| {
                    let bounds = vec![CornersBound { corners: 0b10, concave: None }];
                    near.push(NearCorners { n_multipliers: 0, tangent: Vec::new(), bounds });
                    true
                },
            ),
            "a corner that the body does not have",
        ),
        damage(
            "more multipliers than there are",
            leaf(|_, near, _| near.first_mut().map(|corner| corner.n_multipliers = 999).is_some()),
            "too few multipliers",
        ),
        damage(
            "a multiplier that is negative",
            leaf(|_, _, multipliers| multipliers.first_mut().map(|entry| entry.1 = -entry.1).is_some()),
            "is not usable",
        ),
        damage(
            "the concave part is left out",
            leaf(|_, near, _| {
                by_tangent(near)
                    .filter(|(_, concave)| concave.iter().any(|w| w.abs() > 0.05))
                    .map(|(_, concave)| concave.clear())
                    .is_some()
            }),
            "convex",
        ),
        damage(
            "the concave part is far too large",
            leaf(|_, near, _| {
                by_tangent(near).map(|(_, concave)| concave.iter_mut().for_each(|w| *w *= 1e3)).is_some()
            }),
            "the proven gap is",
        ),
        damage(
            "corners that need a tangent are bounded by sizes",
            leaf(|_, near, _| {
                let bounds = near.iter_mut().flat_map(|near| &mut near.bounds);
                let with_tangent = bounds.filter(|bound| bound.concave.is_some());
                with_tangent.map(|bound| bound.concave = None).count() > 0
            }),
            "the proven gap is",
        ),
        damage(
            "a tangent is not a number",
            leaf(|_, near, _| by_tangent(near).map(|(tangent, _)| tangent[0] = f32::NAN).is_some()),
            "convex",
        ),
        damage(
            "a tangent is far away",
            leaf(|_, near, _| by_tangent(near).map(|(tangent, _)| tangent[1] = 1e4).is_some()),
            "the proven gap is",
        ),
        damage(
            "a tangent lacks a joint",
            leaf(|_, near, _| by_tangent(near).map(|(tangent, _)| tangent.pop()).is_some()),
            "convex",
        ),
    ]
}
