//! Further normals for a cell where the one at its centre fails on the region, and what their failure says of a split.

use crate::pair_model::{PairModel, Tangent};
use nalgebra::Vector3;

/// Normals that are tried on a cell in one frame.
const MAX_NORMALS: usize = 4;

/// Of the normals at the configurations where others failed, and of their means, the one whose least gap over these
/// configurations is largest; `None` if that is not above what is demanded, if the last is a contact, or if enough
/// were tried. `witnesses` is not empty.
pub fn better_normal(
    model: &PairModel,
    frame_idx: usize,
    witnesses: &[(Vec<f64>, Tangent)],
) -> Option<Vector3<f64>> {
    let demand = model.demand();
    let ((_, last), earlier) = witnesses.split_last()?;
    if last.gap <= demand || witnesses.len() >= MAX_NORMALS {
        return None;
    }
    let mut better: Option<(f64, Vector3<f64>)> = None;
    let mut offer = |candidate: Vector3<f64>| {
        let norm = candidate.norm();
        if !(norm > 0.1) {
            return;
        }
        let candidate = candidate / norm;
        let gaps = witnesses.iter().map(|(q, _)| model.gap_along(frame_idx, q, &candidate));
        let least = gaps.fold(f64::INFINITY, f64::min);
        if least > demand && better.is_none_or(|(most, _)| least > most) {
            better = Some((least, candidate));
        }
    };
    offer(last.n);
    for (_, tangent) in earlier {
        offer(tangent.n);
        offer(tangent.n + last.n);
    }
    better.map(|(_, normal)| normal)
}

/// How much coordinate `j` tells between the configurations where normals failed, and between the last of them and the
/// centre of the cell, where the gap has the gradient `g`: metres. `witnesses` may be empty.
pub fn difference(witnesses: &[(Vec<f64>, Tangent)], g: &[f64], center: &[f64], j: usize) -> f64 {
    let Some(((last, tangent), earlier)) = witnesses.split_last() else { return 0.0 };
    let from_center = (tangent.g[j] - g[j]).abs() * (last[j] - center[j]).abs();
    let between = earlier.iter().map(|(q, other)| (tangent.g[j] - other.g[j]).abs() * (last[j] - q[j]).abs());
    from_center + between.sum::<f64>()
}
