//! Planes for a cell by the series of the corners of the body that moves.

use crate::cell::CellBox;
use crate::corner_bound::{CornerPair, JointsAt, MAX_JOINTS, Series};
use crate::normals::{better_normal, difference};
use crate::pair_model::{PairModel, Tangent};
use crate::row_program::{Active, RowProgram};
use crate::rows::{Multipliers, RowBound, Rows};
use ipc_types::artefact::{Cell, NearCorner};
use nalgebra::Vector3;

/// What the corners say of a cell.
pub enum CornerAnswer {
    /// The cell is closed: it misses the region, or all corners stay beyond a plane.
    Closed(Cell),
    /// A corner does not.
    Open(Box<OpenCorner>),
}

/// A corner that comes too near the plane.
pub struct OpenCorner {
    /// Normal.
    pub n: Vector3<f64>,
    /// g by all coordinates.
    pub g: Vec<f64>,
    /// f(m) less second to fourth order.
    pub kappa: f64,
    /// f(m).
    pub first: f64,
    /// L.
    pub bound: f64,
    /// For L.
    pub multipliers: Multipliers,
    /// Where in cell ∩ region the corner is nearest to the plane, to first order, and the pair's gap there, metres.
    pub nearest: (Vec<f64>, f64),
    /// Configurations of cell ∩ region at which normals fail to first order.
    pub witnesses: Vec<(Vec<f64>, Tangent)>,
    series: Series,
}

impl OpenCorner {
    /// Whether the plane separates the pair on cell ∩ region to first order.
    pub fn holds_to_first_order(&self, demand: f64) -> bool {
        self.first + self.bound > demand
    }

    /// Whether the cell is too wide for a series.
    pub fn is_wide(&self) -> bool {
        self.series.is_wide(self.first - self.kappa)
    }
}

/// What is needed to judge a cell.
pub struct CornerTask<'a> {
    /// The pair.
    pub model: &'a PairModel,
    /// Its corners.
    pub pair: &'a CornerPair,
    /// Rows of the region.
    pub rows: &'a Rows,
    /// Those that the cell may violate.
    pub relevant: &'a [u32],
    /// Where the programme of the cell around this one ended.
    pub start: &'a [Active],
}

/// The part of a leaf that proves a corner apart.
struct CornerProof {
    corner: usize,
    /// τ and w.
    tangent: Option<([f32; MAX_JOINTS], Vec<[f32; MAX_JOINTS]>)>,
    multipliers: Multipliers,
}

impl CornerTask<'_> {
    /// Looks for a plane. The normal at the cell's centre comes first, which may lie outside the region; where it fails
    /// on the region, normals that hold there are tried.
    pub fn attempt(&self, program: &mut RowProgram, cell: &CellBox) -> CornerAnswer {
        let (model, demand, frame_idx) = (self.model, self.model.demand(), self.pair.frame_idx);
        let joints = JointsAt::new(model, self.pair, cell);
        let mut n = model.tangent(frame_idx, &cell.centers()).n;
        let mut witnesses: Vec<(Vec<f64>, Tangent)> = Vec::new();
        let mut start = self.start.to_vec();
        program.load(self.rows, self.relevant, cell);
        loop {
            let mut open = match self.with_normal(program, cell, &joints, &n, &mut start) {
                CornerAnswer::Closed(leaf) => return CornerAnswer::Closed(leaf),
                CornerAnswer::Open(open) => open,
            };
            let tangent = model.tangent(frame_idx, &open.nearest.0);
            open.nearest.1 = tangent.gap;
            if open.holds_to_first_order(demand) {
                return CornerAnswer::Open(open);
            }
            witnesses.push((open.nearest.0.clone(), tangent));
            match better_normal(model, frame_idx, &witnesses) {
                Some(normal) if (normal - n).norm() > 1e-6 => n = normal,
                _ => {
                    open.witnesses = witnesses;
                    return CornerAnswer::Open(open);
                }
            }
        }
    }

    /// The answer for the normal `n`.
    fn with_normal(
        &self,
        program: &mut RowProgram,
        cell: &CellBox,
        joints: &JointsAt,
        n: &Vector3<f64>,
        start: &mut Vec<Active>,
    ) -> CornerAnswer {
        let (model, demand) = (self.model, self.model.demand());
        let frame = &model.frames[self.pair.frame_idx];
        let (side, rest) = (&frame.sides[self.pair.moving], &frame.sides[1 - self.pair.moving]);
        let r = if self.pair.moving == 0 { *n } else { -n };
        // The resting body's extreme towards the moving one.
        let support = rest.core.support((rest.R_tail.tr_mul(&r)).into());
        let offset = -(r.dot(&rest.p_tail) + support) - model.radius;
        let at_normal = joints.with_normal(&r);
        let mut near: Vec<(f64, usize, Series)> = Vec::new();
        for (corner, x) in self.pair.corners.iter().enumerate() {
            let series = at_normal.series(x);
            let slopes = side.steps.iter().zip(&series.g);
            let spread: f64 = slopes.map(|(step, g)| g.abs() * cell.half(step.coordinate)).sum();
            let lowest = series.value + offset - spread;
            if lowest - series.crude() <= demand {
                near.push((lowest, corner, series));
            }
        }
        // The lowest first: one that fails is enough.
        near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut proofs: Vec<CornerProof> = Vec::with_capacity(near.len());
        for (_, corner, series) in near {
            let first = series.value + offset;
            let mut g = vec![0.0; cell.lower.len()];
            side.steps.iter().zip(&series.g).for_each(|(step, value)| g[step.coordinate] = *value);
            // Corners lie close together: what bounds one often bounds the next as well.
            if let Some(CornerProof { multipliers, .. }) = proofs.last() {
                let bound = self.rows.bound(cell, &g, multipliers);
                if first - series.crude() + bound > demand {
                    proofs.push(CornerProof { corner, tangent: None, multipliers: multipliers.clone() });
                    continue;
                }
            }
            let (bound, multipliers) =
                match self.rows.minimize_loaded(program, cell, &g, start, f64::INFINITY) {
                    RowBound::Empty(multipliers) => return CornerAnswer::Closed(Cell::Empty { multipliers }),
                    RowBound::Bound { value, multipliers } => (value, multipliers),
                };
            *start = program.basis();
            let mut kappa = first - series.crude();
            if kappa + bound > demand {
                proofs.push(CornerProof { corner, tangent: None, multipliers });
                continue;
            }
            let at = program.point(cell);
            let least =
                LeastOfCorner { first, series: &series, g: &g, at: &at, bound, multipliers: &multipliers };
            match self.by_tangents(program, cell, &least, start) {
                Tangents::Empty(multipliers) => return CornerAnswer::Closed(Cell::Empty { multipliers }),
                Tangents::Apart(tangent, multipliers) => {
                    proofs.push(CornerProof { corner, tangent: Some(tangent), multipliers });
                    continue;
                }
                Tangents::Open(without_tangent) => kappa = kappa.max(without_tangent),
            }
            return CornerAnswer::Open(Box::new(OpenCorner {
                n: *n,
                g,
                kappa,
                first,
                bound,
                multipliers,
                nearest: (at, f64::NAN),
                witnesses: Vec::new(),
                series,
            }));
        }
        CornerAnswer::Closed(self.leaf(n, &proofs))
    }

    /// Whether a corner stays apart by tangents to the convex part of its second order: at the centre, where the first
    /// order is least, and halfway to where that leads.
    fn by_tangents(
        &self,
        program: &mut RowProgram,
        cell: &CellBox,
        corner: &LeastOfCorner<'_>,
        start: &[Active],
    ) -> Tangents {
        let demand = self.model.demand();
        let LeastOfCorner { first, series, g, at, .. } = *corner;
        let steps = &self.model.frames[self.pair.frame_idx].sides[self.pair.moving].steps;
        let mut sigma = [0.0; MAX_JOINTS];
        let mut slope_there = 0.0;
        for (sigma, step) in sigma.iter_mut().zip(steps) {
            let j = step.coordinate;
            *sigma = ((at[j] - cell.center(j)) / cell.half(j).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
            slope_there += g[j] * cell.half(j) * *sigma;
        }
        // No bound is above the value there.
        if first + slope_there + series.beyond_first(&sigma) <= demand {
            return Tangents::Open(f64::NEG_INFINITY);
        }
        let scaled_slopes = |slopes: &[f64], multipliers: &Multipliers| {
            let mut s = [0.0; MAX_JOINTS];
            for (s, step) in s.iter_mut().zip(steps) {
                let j = step.coordinate;
                let by_rows: f64 =
                    multipliers.iter().map(|&(row, mu)| mu * self.rows.a[row as usize][j]).sum();
                *s = (slopes[j] + by_rows) * cell.half(j);
            }
            s
        };
        let concave = series.concave();
        let s = scaled_slopes(g, corner.multipliers);
        let spread: f64 = s.iter().map(|s| s.abs()).sum();
        let at_center = first + corner.bound + spread + series.least_at_corners(&concave.N, &s);
        if at_center > demand {
            return Tangents::Apart(([0.0; MAX_JOINTS], concave.w), corner.multipliers.clone());
        }
        for _ in 0..N_TANGENTS {
            let tau = sigma.map(|sigma| sigma as f32);
            let (slopes, constant) = series.tangent(&concave.N, &tau);
            let mut with_tangent = g.to_vec();
            for (slope, step) in slopes.iter().zip(steps) {
                with_tangent[step.coordinate] += slope / cell.half(step.coordinate).max(f64::MIN_POSITIVE);
            }
            let answer = self.rows.minimize_loaded(program, cell, &with_tangent, start, f64::INFINITY);
            let (bound, multipliers) = match answer {
                RowBound::Empty(multipliers) => return Tangents::Empty(multipliers),
                RowBound::Bound { value, multipliers } => (value, multipliers),
            };
            let s = scaled_slopes(&with_tangent, &multipliers);
            let spread: f64 = s.iter().map(|s| s.abs()).sum();
            let value = first + constant + bound + spread + series.least_at_corners(&concave.N, &s);
            if value > demand {
                return Tangents::Apart((tau, concave.w), multipliers);
            }
            let there = program.point(cell);
            for (sigma, step) in sigma.iter_mut().zip(steps) {
                let j = step.coordinate;
                let there = (there[j] - cell.center(j)) / cell.half(j).max(f64::MIN_POSITIVE);
                *sigma = 0.5 * *sigma + 0.5 * there.clamp(-1.0, 1.0);
            }
        }
        Tangents::Open(first + series.least_at_corners(&concave.N, &[0.0; MAX_JOINTS]))
    }

    fn leaf(&self, n: &Vector3<f64>, proofs: &[CornerProof]) -> Cell {
        let n_joints = self.model.frames[self.pair.frame_idx].sides[self.pair.moving].steps.len();
        let near = proofs.iter().map(|proof| {
            let (tangent, concave) = match &proof.tangent {
                Some((tau, w)) => {
                    (tau[..n_joints].to_vec(), w.iter().flat_map(|w| w[..n_joints].iter().copied()).collect())
                }
                None => (Vec::new(), Vec::new()),
            };
            let n_multipliers = proof.multipliers.len() as u16;
            NearCorner { corner: proof.corner as u8, n_multipliers, tangent, concave }
        });
        Cell::Corners {
            frame: self.pair.frame_idx as u16,
            normal: (*n).into(),
            near: near.collect(),
            multipliers: proofs.iter().flat_map(|proof| proof.multipliers.iter().copied()).collect(),
        }
    }

    /// The coordinate to halve: where the plane holds to first order the one that takes most of the higher orders away;
    /// where normals failed, the one that tells most between the points that they failed at.
    pub fn split_coordinate(&self, cell: &CellBox, open: &OpenCorner) -> Option<usize> {
        let side = &self.model.frames[self.pair.frame_idx].sides[self.pair.moving];
        let center = cell.centers();
        let spectrum = open.series.spectrum();
        let mut best: Option<(f64, usize)> = None;
        for (k, step) in side.steps.iter().enumerate() {
            let j = step.coordinate;
            let mut score = 1e-4 * step.lever * cell.half(j);
            score += if open.witnesses.is_empty() {
                open.series.gain(k, &spectrum)
            } else {
                difference(&open.witnesses, &open.g, &center, j)
            };
            if cell.half(j) > 0.0 && best.is_none_or(|(most, _)| score > most) {
                best = Some((score, j));
            }
        }
        best.map(|(_, j)| j)
    }
}

/// What tangents say of a corner.
enum Tangents {
    Empty(Multipliers),
    /// τ, w and multipliers.
    Apart(([f32; MAX_JOINTS], Vec<[f32; MAX_JOINTS]>), Multipliers),
    /// What f stays above on the cell, less g·δ, without any tangent.
    Open(f64),
}

/// Where the first order of a corner is least.
struct LeastOfCorner<'a> {
    /// f(m).
    first: f64,
    series: &'a Series,
    /// g by all coordinates.
    g: &'a [f64],
    /// A configuration where g·δ is least.
    at: &'a [f64],
    /// L, and its multipliers.
    bound: f64,
    multipliers: &'a Multipliers,
}

/// Tangents that are tried for a corner.
const N_TANGENTS: usize = 2;
