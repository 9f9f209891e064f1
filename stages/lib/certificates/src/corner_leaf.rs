//! What a leaf that was proven by corners proves, evaluated anew.

use crate::cell::CellBox;
use crate::corner_bound::JointsAt;
use crate::corner_series::{MAX_JOINTS, concave_matrix, kept_squares};
use crate::pair_model::PairModel;
use crate::rows::Rows;
use ipc_types::artefact::NearCorners;
use nalgebra::Vector3;

/// What a leaf says of a corner.
#[derive(Clone, Copy, Default)]
struct OwnProof<'a> {
    /// τ and w; `None`: the corner is bounded by sizes.
    tangent: Option<(&'a [f32], &'a [f32])>,
    multipliers: &'a [(u32, f64)],
}

/// The contents of `ipc_types::artefact::Cell::Corners`.
pub struct CornerLeaf<'a> {
    /// Position of the frame.
    pub frame: u16,
    /// Normal.
    pub normal: &'a [f64; 3],
    /// Corners that need multipliers or a tangent.
    pub near: &'a [NearCorners],
    /// Their multipliers; they name rows that exist.
    pub multipliers: &'a [(u32, f64)],
}

impl CornerLeaf<'_> {
    /// The gap that it proves on `cell`, metres; minus infinity if it does not fit the pair.
    pub fn gap(&self, model: &PairModel, rows: &Rows, cell: &CellBox) -> f64 {
        let fits = |pair: &&crate::corner_bound::CornerPair| pair.frame_idx == usize::from(self.frame);
        let Some(pair) = model.corners.as_ref().filter(fits) else { return f64::NEG_INFINITY };
        let n = Vector3::from(*self.normal);
        let frame = &model.frames[pair.frame_idx];
        let (side, rest) = (&frame.sides[pair.moving], &frame.sides[1 - pair.moving]);
        if !(n.norm() <= 1.0 + 1e-12) {
            return f64::NEG_INFINITY;
        }
        let r = if pair.moving == 0 { n } else { -n };
        let support = rest.core.support((rest.R_tail.tr_mul(&r)).into());
        let offset = -(r.dot(&rest.p_tail) + support) - model.radius;
        let joints = JointsAt::new(model, pair, cell);
        let at_normal = joints.with_normal(&r);
        let mut own = vec![OwnProof::default(); pair.corners.len()];
        let mut left = self.multipliers;
        for near in self.near {
            let Some((multipliers, others)) = left.split_at_checked(usize::from(near.n_multipliers)) else {
                return f64::NEG_INFINITY;
            };
            left = others;
            for bound in &near.bounds {
                let tangent = bound.concave.as_deref().map(|concave| (&near.tangent[..], concave));
                for corner in bound.numbers() {
                    let Some(place) = own.get_mut(corner) else { return f64::NEG_INFINITY };
                    *place = OwnProof { tangent, multipliers };
                }
            }
        }
        let mut least = f64::INFINITY;
        for (x, OwnProof { tangent, multipliers }) in pair.corners.iter().zip(own) {
            let series = at_normal.series(x);
            let n = side.steps.len();
            let joints_of = |values: &[f32]| -> [f32; MAX_JOINTS] {
                std::array::from_fn(|k| values.get(k).copied().unwrap_or(0.0))
            };
            let tau = joints_of(tangent.map_or(&[], |(tau, _)| tau));
            let folded = series.fold(kept_squares(&tau));
            let first = folded.value() + offset;
            let mut g = vec![0.0; cell.lower.len()];
            side.steps.iter().zip(folded.by_joints()).for_each(|(step, value)| g[step.coordinate] = value);
            let Some((tangent, concave)) = tangent else {
                least = least.min(first - folded.crude() + rows.bound(cell, &g, multipliers));
                continue;
            };
            if tangent.len() != n || !concave.len().is_multiple_of(n) {
                return f64::NEG_INFINITY;
            }
            let w: Vec<[f32; MAX_JOINTS]> = concave.chunks_exact(n).map(joints_of).collect();
            let N = concave_matrix(&w, n);
            if !folded.is_convex_with(&N) {
                return f64::NEG_INFINITY;
            }
            let (slopes, constant) = folded.tangent(&N, &tau);
            for (slope, step) in slopes.iter().zip(&side.steps) {
                g[step.coordinate] += slope / cell.half(step.coordinate).max(f64::MIN_POSITIVE);
            }
            let mut s = [0.0; MAX_JOINTS];
            for (s, step) in s.iter_mut().zip(&side.steps) {
                let j = step.coordinate;
                let by_rows: f64 = multipliers.iter().map(|&(row, mu)| mu * rows.a(row as usize)[j]).sum();
                *s = (g[j] + by_rows) * cell.half(j);
            }
            let spread: f64 = s.iter().map(|s| s.abs()).sum();
            let bound = rows.bound(cell, &g, multipliers);
            least = least.min(first + constant + bound + spread + folded.least_at_corners(&N, &s));
        }
        least
    }
}
