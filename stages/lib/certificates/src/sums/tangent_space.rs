//! From a polytope in C-space to a box and rows in TC-space that contain its image (mathematics.md 2.2; the
//! relations are those of `SosProof`).

use crate::bounds::CoordinateBounds;
use crate::cell::CellBox;
use crate::row_program::RowProgram;
use crate::rows::{RowBound, Rows};
use ipc_types::artefact::{SosJoint, SosRow};
use kinematics::TcVariable;
use scene::CoordinateKind;
use std::f64::consts::PI;

/// Scales and offsets are rounded outwards by this share, far above the rounding of tangents and sums.
const OUTWARD: f64 = 1e-12;
/// Half-width of an angle beyond which its tangent is useless.
const MAX_HALF_ANGLE: f64 = 3.0;

/// The pair's variables on the region; `None` if an angle's range is too wide.
pub fn joints(
    coordinates: &[usize],
    kinds: &[CoordinateKind],
    bounds: &[CoordinateBounds],
    limits: &CellBox,
) -> Option<Vec<SosJoint>> {
    coordinates
        .iter()
        .zip(kinds)
        .map(|(&j, kind)| {
            let [lower, upper] = bounds[j].clone();
            let (lower, lower_multipliers) = lower.unwrap_or((limits.lower[j], Vec::new()));
            let (upper, upper_multipliers) = upper.unwrap_or((limits.upper[j], Vec::new()));
            let center = 0.5 * (lower + upper);
            let half = (upper - center).max(center - lower) + OUTWARD;
            let scale = match kind {
                CoordinateKind::Revolute => (0.5 * half).tan(),
                CoordinateKind::Prismatic => half,
            };
            let usable =
                lower < upper && (*kind == CoordinateKind::Prismatic || half < MAX_HALF_ANGLE.min(PI));
            usable.then_some(SosJoint {
                coordinate: j as u16,
                center,
                scale: scale * (1.0 + OUTWARD),
                lower,
                upper,
                lower_multipliers,
                upper_multipliers,
            })
        })
        .collect()
}

/// The variable of a joint.
pub fn variable(joint: &SosJoint, kind: CoordinateKind) -> TcVariable {
    TcVariable {
        coordinate_idx: usize::from(joint.coordinate),
        kind,
        center: joint.center,
        scale: joint.scale,
    }
}

/// A lower bound of a q − c s(q) for l ≤ q ≤ u, up to rounding.
pub fn least_difference(a: f64, c: f64, joint: &SosJoint, kind: CoordinateKind) -> f64 {
    let (low, high) = (joint.lower - joint.center, joint.upper - joint.center);
    let T = joint.scale;
    let s = |delta: f64| match kind {
        CoordinateKind::Revolute => (0.5 * delta).tan() / T,
        CoordinateKind::Prismatic => delta / T,
    };
    let phi = |delta: f64| a * delta - c * s(delta);
    let mut least = phi(low).min(phi(high));
    if kind == CoordinateKind::Revolute && c != 0.0 {
        // Convex where c δ ≤ 0: above the tangent at its least point, where cos²(δ/2) = c / (2 a T).
        let (from, to) = if c > 0.0 { (low.min(0.0), high.min(0.0)) } else { (low.max(0.0), high.max(0.0)) };
        let ratio = c / (2.0 * a * T);
        let at = if ratio > 0.0 && ratio < 1.0 { 2.0 * ratio.sqrt().acos() } else { 0.0 };
        let at = if c > 0.0 { -at } else { at }.clamp(from, to);
        let slope = a - c / (2.0 * T * (0.5 * at).cos().powi(2));
        least = least.min(phi(at) + slope * (from - at)).min(phi(at) + slope * (to - at));
        least = least.min(phi(from)).min(phi(to));
    }
    a * joint.center + least
}

/// Rows that hold on the image of the region and cut its box, those that cut deepest first, at most `max_rows`.
pub fn rows(
    region: &Rows,
    limits: &CellBox,
    joints: &[SosJoint],
    kinds: &[CoordinateKind],
    max_rows: usize,
) -> Vec<SosRow> {
    let n = limits.lower.len();
    let mut program = RowProgram::default();
    let mut directions: Vec<Vec<f64>> = Vec::new();
    let mut found: Vec<(f64, SosRow)> = Vec::new();
    for face in region.faces() {
        let mut direction = vec![0.0; n];
        for joint in joints {
            direction[usize::from(joint.coordinate)] = face[usize::from(joint.coordinate)];
        }
        // A single coordinate is a side of the box.
        if direction.iter().filter(|a| **a != 0.0).count() < 2 || directions.contains(&direction) {
            continue;
        }
        directions.push(direction.clone());
        let minus: Vec<f64> = direction.iter().map(|a| -a).collect();
        let RowBound::Bound { multipliers, .. } =
            region.minimize(&mut program, limits, &minus, f64::INFINITY)
        else {
            continue;
        };
        if let Some(row) = row(region, limits, joints, kinds, multipliers) {
            let norm = row.c.iter().map(|c| c * c).sum::<f64>().sqrt();
            let depth = row.c.iter().map(|c| c.abs()).sum::<f64>() - row.d;
            if depth > MIN_DEPTH * norm && norm > 0.0 {
                let scaled = SosRow {
                    c: row.c.iter().map(|c| c / norm).collect(),
                    d: row.d / norm,
                    multipliers: row.multipliers.iter().map(|&(r, mu)| (r, mu / norm)).collect(),
                };
                found.push((depth / norm, outwards(scaled)));
            }
        }
    }
    // A stable sort: rows of equal depth stay in the order of the faces.
    found.sort_by(|x, y| y.0.total_cmp(&x.0));
    found.into_iter().take(max_rows).map(|(_, row)| row).collect()
}

/// A row that cuts the box by less, in units of s, is left out.
const MIN_DEPTH: f64 = 1e-3;

fn outwards(mut row: SosRow) -> SosRow {
    row.d += OFFSET_SLACK * (1.0 + row.d.abs());
    row
}

/// Offsets of rows are raised by this, so that they hold in spite of rounding.
const OFFSET_SLACK: f64 = 1e-9;

/// The row by these multipliers, its slopes chosen so that it agrees with the C-space row at s = 0 and s = ±1.
fn row(
    region: &Rows,
    limits: &CellBox,
    joints: &[SosJoint],
    kinds: &[CoordinateKind],
    multipliers: Vec<(u32, f64)>,
) -> Option<SosRow> {
    let n = limits.lower.len();
    let mut a = vec![0.0; n];
    let mut d = 0.0;
    for &(r, mu) in &multipliers {
        for j in 0..n {
            a[j] += mu * region.a(r as usize)[j];
        }
        d += mu * region.b[r as usize];
    }
    let mut c = Vec::with_capacity(joints.len());
    for (joint, &kind) in joints.iter().zip(kinds) {
        let a = &mut a[usize::from(joint.coordinate)];
        let half = match kind {
            CoordinateKind::Revolute => 2.0 * joint.scale.atan(),
            CoordinateKind::Prismatic => joint.scale,
        };
        let slope = *a * half;
        d -= least_difference(*a, slope, joint, kind);
        c.push(slope);
        *a = 0.0;
    }
    for j in 0..n {
        d -= (a[j] * limits.lower[j]).min(a[j] * limits.upper[j]);
    }
    d.is_finite().then_some(SosRow { c, d, multipliers })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::coordinate_bounds;
    use convex_sets::HPolyhedron;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    fn joint(kind: CoordinateKind, lower: f64, upper: f64) -> SosJoint {
        let limits = CellBox { lower: vec![lower], upper: vec![upper] };
        joints(&[0], &[kind], &[[None, None]], &limits).expect("a range below 2 π").remove(0)
    }

    proptest! {
        /// The bound of each univariate difference holds and is nearly taken.
        #[test]
        fn least_difference_is_the_minimum(a in -2.0..2.0_f64, c in -2.0..2.0_f64, lower in -2.0..1.0_f64,
                                           width in 0.01..2.5_f64, is_angle: bool) {
            let kind = if is_angle { CoordinateKind::Revolute } else { CoordinateKind::Prismatic };
            let joint = joint(kind, lower, lower + width);
            let bound = least_difference(a, c, &joint, kind);
            let v = variable(&joint, kind);
            let least = (0..=2000)
                .map(|step| lower + width * f64::from(step) / 2000.0)
                .map(|q| a * q - c * v.s_from_q(q))
                .fold(f64::INFINITY, f64::min);
            prop_assert!(bound <= least + 1e-12 && least - bound < 1e-4 * (1.0 + c.abs()), "{bound} {least}");
        }

        /// Every configuration of a random polytope has its image in the box and within the rows.
        #[test]
        fn the_image_lies_within(A in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 6),
                                 b in prop::collection::vec(0.2..0.8_f64, 6),
                                 points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 200)) {
            let limits = CellBox { lower: vec![-1.0; 3], upper: vec![1.0, 1.2, 1.0] };
            let region = HPolyhedron {
                A: DMatrix::from_fn(6, 3, |i, j| A[i][j]),
                b: DVector::from_fn(6, |i, _| b[i]),
            };
            let rows_q = Rows::new(&region);
            let bounds = coordinate_bounds(&rows_q, &limits);
            let kinds = [CoordinateKind::Revolute, CoordinateKind::Prismatic];
            // The last coordinate is not the pair's.
            let joints = joints(&[0, 1], &kinds, &bounds, &limits).expect("ranges below 2 π");
            let rows = rows(&rows_q, &limits, &joints, &kinds, 99);
            for q in points.iter().filter(|q| region.contains(&DVector::from_column_slice(&q[..]), 0.0)) {
                let s: Vec<f64> = joints.iter().zip(kinds)
                    .map(|(joint, kind)| variable(joint, kind).s_from_q(q[usize::from(joint.coordinate)]))
                    .collect();
                prop_assert!(s.iter().all(|s| s.abs() <= 1.0));
                for row in &rows {
                    prop_assert!(row.c.iter().zip(&s).map(|(c, s)| c * s).sum::<f64>() <= row.d);
                }
            }
        }
    }
}
