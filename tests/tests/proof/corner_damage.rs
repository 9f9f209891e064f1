//! Kinds of damage to cells that were proven by the series of a body's corners.

use crate::damage::{Damage, certificates, damage};
use ipc_types::artefact::{Cell, CertificatesFile, NearCorner, PairProof};

/// Changes normal, corners and multipliers of a leaf; whether it took it.
type Change = fn(&mut [f64; 3], &mut Vec<NearCorner>, &mut Vec<(u32, f64)>) -> bool;

/// Applies `change` to the first leaf by corners that it takes.
fn leaf(change: Change) -> Box<dyn Fn(&std::path::Path)> {
    certificates(move |file: &mut CertificatesFile| {
        let proofs = file.regions.iter_mut().flat_map(|region| &mut region.pairs).map(|pair| &mut pair.proof);
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

fn by_tangent(near: &mut [NearCorner]) -> Option<&mut NearCorner> {
    near.iter_mut().find(|corner| !corner.tangent.is_empty() && !corner.concave.is_empty())
}

/// All kinds.
pub fn all() -> Vec<Damage> {
    vec![
        damage(
            "a normal is turned round",
            leaf(|normal, near, _| {
                let takes = near.iter().all(|corner| corner.tangent.is_empty());
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
                let needs_it = near.len() == 1 && !multipliers.is_empty() && !near[0].tangent.is_empty();
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
            leaf(|_, near, _| near.first_mut().map(|corner| corner.corner = 9).is_some()),
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
                    .filter(|corner| corner.concave.iter().any(|w| w.abs() > 0.05))
                    .map(|corner| corner.concave.clear())
                    .is_some()
            }),
            "convex",
        ),
        damage(
            "the concave part is far too large",
            leaf(|_, near, _| {
                by_tangent(near).map(|corner| corner.concave.iter_mut().for_each(|w| *w *= 1e3)).is_some()
            }),
            "the proven gap is",
        ),
        damage(
            "a tangent is not a number",
            leaf(|_, near, _| by_tangent(near).map(|corner| corner.tangent[0] = f32::NAN).is_some()),
            "convex",
        ),
        damage(
            "a tangent is far away",
            leaf(|_, near, _| by_tangent(near).map(|corner| corner.tangent[1] = 1e4).is_some()),
            "the proven gap is",
        ),
        damage(
            "a tangent lacks a joint",
            leaf(|_, near, _| by_tangent(near).map(|corner| corner.tangent.pop()).is_some()),
            "convex",
        ),
    ]
}
