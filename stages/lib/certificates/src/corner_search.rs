//! Planes for a cell by the series of the corners of the body that moves.

use crate::cell::CellBox;
use crate::corner_bound::{CornerPair, JointsAt};
use crate::corner_series::{Concave, Folded, MAX_JOINTS, Series, kept_squares};
use crate::normals::difference;
use crate::pair_model::{PairModel, Tangent};
use crate::row_program::{Active, RowProgram};
use crate::rows::{Multipliers, RowBound, Rows};
use crate::separating_normal::{PlacedCore, shortest_difference_of_hull};
use ipc_types::artefact::{Cell, CornersBound, NearCorners};
use nalgebra::Vector3;
use std::rc::Rc;

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
    /// f(m) less higher orders.
    pub kappa: f64,
    /// f(m).
    pub first: f64,
    /// L.
    pub bound: f64,
    /// For L.
    pub multipliers: Multipliers,
    /// Of the configurations of cell ∩ region that came near planes the one with the least gap, and that gap, metres.
    pub nearest: (Vec<f64>, f64),
    /// Configurations of cell ∩ region which no normal tried keeps apart; none if one does.
    pub witnesses: Vec<(Vec<f64>, Tangent)>,
    /// All that was seen.
    pub seen: Vec<Rc<Seen>>,
    series: Box<Series>,
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

/// A configuration of the region that came near a plane.
pub struct Seen {
    q: Vec<f64>,
    /// Where the two bodies are, in the frame, and the corners of the one that moves.
    cores: [PlacedCore; 2],
    corners: Vec<Vector3<f64>>,
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
    /// What was seen in the cell around this one.
    pub seen: &'a [Rc<Seen>],
}

/// The part of a leaf that proves corners apart.
struct CornersProof {
    /// τ.
    tangent: Option<[f32; MAX_JOINTS]>,
    multipliers: Multipliers,
    /// Corners, bit k for corner k, and w where the tangent is used.
    bounds: Vec<(u8, Option<Vec<[f32; MAX_JOINTS]>>)>,
}

impl CornersProof {
    fn by_sizes(corner: usize, multipliers: Multipliers) -> Self {
        Self { tangent: None, multipliers, bounds: vec![(1 << corner, None)] }
    }

    /// The last w, with its τ.
    fn concave(&self) -> Option<([f32; MAX_JOINTS], &[[f32; MAX_JOINTS]])> {
        Some((self.tangent?, self.bounds.iter().rev().find_map(|(_, w)| w.as_ref())?))
    }

    fn add(&mut self, corner: usize, w: Option<Vec<[f32; MAX_JOINTS]>>) {
        match self.bounds.iter_mut().find(|(_, other)| *other == w) {
            Some((corners, _)) => *corners |= 1 << corner,
            None => self.bounds.push((1 << corner, w)),
        }
    }
}

impl CornerTask<'_> {
    /// Looks for a plane. The first normal keeps what was seen in the cell around this one, as far as that lies in this
    /// one, farthest from the body at rest, or is the one at the cell's centre; the next ones keep what came near the
    /// planes tried as well.
    pub fn attempt(&self, program: &mut RowProgram, cell: &CellBox) -> CornerAnswer {
        let (model, demand, frame_idx) = (self.model, self.model.demand(), self.pair.frame_idx);
        let joints = JointsAt::new(model, self.pair, cell);
        let inside = |seen: &&Rc<Seen>| {
            self.coordinates().all(|j| cell.lower[j] <= seen.q[j] && seen.q[j] <= cell.upper[j])
        };
        let mut seen: Vec<Rc<Seen>> = self.seen.iter().filter(inside).cloned().collect();
        let mut n = match self.widest(&seen) {
            Some((n, _)) => n,
            None => model.tangent(frame_idx, &cell.centers()).n,
        };
        let mut start = self.start.to_vec();
        program.load(self.rows, self.relevant, cell);
        let mut near: Vec<Vec<f64>> = Vec::new();
        let mut best: Option<Box<OpenCorner>> = None;
        let mut n_tried = 0;
        let (mut open, has_normal) = loop {
            let n_near = near.len();
            let open = match self.with_normal(program, cell, &joints, &n, &mut start, &mut near) {
                CornerAnswer::Closed(leaf) => return CornerAnswer::Closed(leaf),
                CornerAnswer::Open(open) => open,
            };
            n_tried += 1;
            seen.extend(near[n_near..].iter().map(|q| Rc::new(self.see(q))));
            let least_loss = open.series.least_loss();
            let open = match best.take() {
                Some(best) if best.kappa + best.bound >= open.kappa + open.bound => best,
                _ => open,
            };
            // No normal keeps more apart than the hull of what was seen is, and every bound loses some of it.
            match self.widest(&seen) {
                Some((next, gap))
                    if n_tried < MAX_NORMALS
                        && gap - model.radius - least_loss > demand
                        && (next - n).norm() >= SAME_NORMAL =>
                {
                    n = next;
                    best = Some(open);
                }
                widest => break (open, widest.is_some_and(|(_, gap)| gap - model.radius > demand)),
            }
        };
        let near = &seen[seen.len() - near.len()..];
        let gaps = near.iter().map(|seen| (model.gap_of(&seen.cores), seen));
        if let Some((gap, seen)) = gaps.min_by(|x, y| x.0.total_cmp(&y.0)) {
            open.nearest = (seen.q.clone(), gap);
        }
        if !has_normal {
            let tangent = |seen: &Rc<Seen>| model.tangent_of(frame_idx, &seen.cores, &seen.q);
            open.witnesses = near.iter().map(|seen| (seen.q.clone(), tangent(seen))).collect();
        }
        open.seen = seen;
        CornerAnswer::Open(open)
    }

    fn coordinates(&self) -> impl Iterator<Item = usize> {
        self.model.frames[self.pair.frame_idx].sides[self.pair.moving]
            .steps
            .iter()
            .map(|step| step.coordinate)
    }

    fn see(&self, q: &[f64]) -> Seen {
        let cores = self.model.placed_cores(self.pair.frame_idx, q);
        let PlacedCore { R, p, .. } = cores[self.pair.moving];
        let corners = self.pair.corners.iter().map(|corner| p + R * corner).collect();
        Seen { q: q.to_vec(), cores, corners }
    }

    /// The normal that keeps the hull of what was seen farthest from the core at rest, and how far; `None` if nothing
    /// was seen or they overlap.
    fn widest(&self, seen: &[Rc<Seen>]) -> Option<(Vector3<f64>, f64)> {
        let points: Vec<Vector3<f64>> = seen.iter().flat_map(|seen| &seen.corners).copied().collect();
        let rest = &self.model.frames[self.pair.frame_idx].sides[1 - self.pair.moving];
        let rest = PlacedCore { core: rest.core, R: rest.R_tail, p: rest.p_tail };
        let apart = shortest_difference_of_hull(&points, &rest)?;
        let gap = apart.norm();
        Some((if self.pair.moving == 0 { apart / gap } else { -apart / gap }, gap))
    }

    /// The answer for the normal `n`; configurations of cell ∩ region where a corner comes near its plane are added to
    /// `near_planes`.
    fn with_normal(
        &self,
        program: &mut RowProgram,
        cell: &CellBox,
        joints: &JointsAt,
        n: &Vector3<f64>,
        start: &mut Vec<Active>,
        near_planes: &mut Vec<Vec<f64>>,
    ) -> CornerAnswer {
        let (model, demand) = (self.model, self.model.demand());
        let frame = &model.frames[self.pair.frame_idx];
        let (side, rest) = (&frame.sides[self.pair.moving], &frame.sides[1 - self.pair.moving]);
        let r = if self.pair.moving == 0 { *n } else { -n };
        // The resting body's extreme towards the moving one.
        let support = rest.core.support((rest.R_tail.tr_mul(&r)).into());
        let offset = -(r.dot(&rest.p_tail) + support) - model.radius;
        let at_normal = joints.with_normal(&r);
        let mut near: Vec<(f64, usize)> = Vec::new();
        for (corner, x) in self.pair.corners.iter().enumerate() {
            let (value, sizes, slopes) = at_normal.outline(x);
            let steps = side.steps.iter().zip(&slopes);
            let spread: f64 = steps.map(|(step, g)| g.abs() * cell.half(step.coordinate)).sum();
            let lowest = value + offset - spread;
            if lowest - sizes <= demand + at_normal.rounding(x) {
                near.push((lowest, corner));
            }
        }
        // The lowest first: one that fails is enough.
        near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut proofs: Vec<CornersProof> = Vec::with_capacity(near.len());
        for (_, corner) in near {
            let series = at_normal.series(&self.pair.corners[corner]);
            let folded = series.fold(0);
            let first = folded.value() + offset;
            let spread: f64 = folded.slopes.iter().map(|slope| slope.abs()).sum();
            if first - spread - folded.crude() > demand {
                continue;
            }
            let mut g = vec![0.0; cell.lower.len()];
            side.steps.iter().zip(folded.by_joints()).for_each(|(step, value)| g[step.coordinate] = value);
            // Corners lie close together: what bounds one often bounds the next as well.
            if let Some(last) = proofs.last_mut() {
                let bound = self.rows.bound(cell, &g, &last.multipliers);
                if first - folded.crude() + bound > demand {
                    last.add(corner, None);
                    continue;
                }
                if let Some((tau, w)) = last.concave() {
                    let parts = Parts::with(&series, kept_squares(&tau), w);
                    let at = self.tangent_at(cell, &parts, offset, &tau);
                    let bound = self.rows.bound(cell, &at.g, &last.multipliers);
                    if self.least(cell, &parts, &at, bound, &last.multipliers) > demand {
                        last.add(corner, Some(parts.concave.w));
                        continue;
                    }
                }
            }
            let (bound, multipliers) =
                match self.rows.minimize_loaded(program, cell, &g, start, f64::INFINITY) {
                    RowBound::Empty(multipliers) => return CornerAnswer::Closed(Cell::Empty { multipliers }),
                    RowBound::Bound { value, multipliers } => (value, multipliers),
                };
            *start = program.basis();
            let mut kappa = first - folded.crude();
            if kappa + bound > demand {
                proofs.push(CornersProof::by_sizes(corner, multipliers));
                continue;
            }
            let at = program.point(cell);
            let least =
                LeastOfCorner { offset, series: &series, folded, at: &at, bound, multipliers: &multipliers };
            near_planes.push(at.clone());
            match self.by_tangents(program, cell, &least, start, near_planes) {
                Tangents::Empty(multipliers) => return CornerAnswer::Closed(Cell::Empty { multipliers }),
                Tangents::Apart((tau, w), multipliers) => {
                    let bounds = vec![(1 << corner, Some(w))];
                    proofs.push(CornersProof { tangent: Some(tau), multipliers, bounds });
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
                seen: Vec::new(),
                series: Box::new(series),
            }));
        }
        CornerAnswer::Closed(self.leaf(n, &proofs))
    }

    /// Whether a corner stays apart by tangents to the convex part of its second order: at the centre, where the first
    /// order is least, and on from there: each at the mean of the points where the ones before are least, as in the method
    /// of Frank and Wolfe (1956); what is bounded is concave in τ.
    fn by_tangents(
        &self,
        program: &mut RowProgram,
        cell: &CellBox,
        corner: &LeastOfCorner<'_>,
        start: &[Active],
        near_planes: &mut Vec<Vec<f64>>,
    ) -> Tangents {
        let demand = self.model.demand();
        let LeastOfCorner { offset, series, folded, at, .. } = corner;
        let steps = &self.model.frames[self.pair.frame_idx].sides[self.pair.moving].steps;
        let in_cell = |q: &[f64]| {
            let mut sigma = [0.0; MAX_JOINTS];
            for (sigma, step) in sigma.iter_mut().zip(steps) {
                let j = step.coordinate;
                *sigma = ((q[j] - cell.center(j)) / cell.half(j).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
            }
            sigma
        };
        // What no bound exceeds, as far as was seen.
        let most_at = |sigma: &[f64; MAX_JOINTS]| folded.at(sigma) + offset - series.least_loss() - demand;
        let mut tau = in_cell(at);
        let mut most = most_at(&tau);
        if most <= 0.0 {
            return Tangents::Open(f64::NEG_INFINITY);
        }
        let center = [0.0; MAX_JOINTS];
        // One for each set of kept squares: tangents that keep the same ones share the eigenvalues.
        let mut parts = vec![(0, Parts::new(series, 0))];
        let of_none = &parts[0].1;
        let at_center = self.tangent_at(cell, of_none, *offset, &center);
        let mut best = self.least(cell, of_none, &at_center, corner.bound, corner.multipliers);
        if best > demand {
            return Tangents::Apart((center, of_none.concave.w.clone()), corner.multipliers.clone());
        }
        let without_tangent =
            at_center.value + of_none.folded.least_at_corners(&of_none.concave.N, &[0.0; MAX_JOINTS]);
        for (nth, hope) in HOPES.into_iter().enumerate() {
            if demand - best > hope * most {
                break;
            }
            let tau_there = tau.map(|sigma| sigma as f32);
            let kept = kept_squares(&tau_there);
            let position = parts.iter().position(|&(of, _)| of == kept).unwrap_or_else(|| {
                parts.push((kept, Parts::new(series, kept)));
                parts.len() - 1
            });
            let parts = &parts[position].1;
            let tangent = self.tangent_at(cell, parts, *offset, &tau_there);
            let answer = self.rows.minimize_loaded(program, cell, &tangent.g, start, f64::INFINITY);
            let (bound, multipliers) = match answer {
                RowBound::Empty(multipliers) => return Tangents::Empty(multipliers),
                RowBound::Bound { value, multipliers } => (value, multipliers),
            };
            let least = self.least(cell, parts, &tangent, bound, &multipliers);
            if least > demand {
                return Tangents::Apart((tau_there, parts.concave.w.clone()), multipliers);
            }
            best = best.max(least);
            let there = program.point(cell);
            let next = in_cell(&there);
            near_planes.push(there);
            most = most.min(most_at(&next));
            let share = 1.0 / (nth + 2) as f64;
            tau.iter_mut().zip(&next).for_each(|(tau, next)| *tau += share * (next - *tau));
        }
        Tangents::Open(without_tangent)
    }

    /// The tangent at τ of the convex part of a corner's second order, for which `parts` keeps the squares.
    fn tangent_at(
        &self,
        cell: &CellBox,
        parts: &Parts<'_>,
        offset: f64,
        tau: &[f32; MAX_JOINTS],
    ) -> TangentAt {
        let steps = &self.model.frames[self.pair.frame_idx].sides[self.pair.moving].steps;
        let Parts { folded, concave } = parts;
        let (slopes, constant) = folded.tangent(&concave.N, tau);
        let mut g = vec![0.0; cell.lower.len()];
        for (k, step) in steps.iter().enumerate() {
            g[step.coordinate] +=
                (folded.slopes[k] + slopes[k]) / cell.half(step.coordinate).max(f64::MIN_POSITIVE);
        }
        let value = folded.value() + offset + constant;
        TangentAt { g, value }
    }

    /// What f stays above on cell ∩ region by a tangent; `bound` is that of its g·δ by `multipliers`.
    fn least(
        &self,
        cell: &CellBox,
        parts: &Parts<'_>,
        at: &TangentAt,
        bound: f64,
        multipliers: &Multipliers,
    ) -> f64 {
        let steps = &self.model.frames[self.pair.frame_idx].sides[self.pair.moving].steps;
        let mut s = [0.0; MAX_JOINTS];
        for (s, step) in s.iter_mut().zip(steps) {
            let j = step.coordinate;
            let by_rows: f64 = multipliers.iter().map(|&(row, mu)| mu * self.rows.a(row as usize)[j]).sum();
            *s = (at.g[j] + by_rows) * cell.half(j);
        }
        let spread: f64 = s.iter().map(|s| s.abs()).sum();
        at.value + bound + spread + parts.folded.least_at_corners(&parts.concave.N, &s)
    }

    fn leaf(&self, n: &Vector3<f64>, proofs: &[CornersProof]) -> Cell {
        let n_joints = self.model.frames[self.pair.frame_idx].sides[self.pair.moving].steps.len();
        let of_joints = |values: &[f32; MAX_JOINTS]| values[..n_joints].to_vec();
        let near = proofs.iter().map(|proof| NearCorners {
            n_multipliers: proof.multipliers.len() as u16,
            tangent: proof.tangent.as_ref().map(of_joints).unwrap_or_default(),
            bounds: (proof.bounds.iter())
                .map(|(corners, w)| {
                    let concave = w.as_ref().map(|w| w.iter().flat_map(of_joints).collect());
                    CornersBound { corners: *corners, concave }
                })
                .collect(),
        });
        Cell::Corners {
            frame: self.pair.frame_idx as u16,
            normal: (*n).into(),
            near: near.collect(),
            multipliers: proofs.iter().flat_map(|proof| proof.multipliers.iter().copied()).collect(),
        }
    }

    /// The coordinate to halve: where a normal keeps apart what came near planes, the one that takes most of the higher
    /// orders away; where none does, the one that tells most between the points that they failed at.
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

/// A corner's series with some squares kept, and the concave part of its second order.
struct Parts<'a> {
    folded: Folded<'a>,
    concave: Concave,
}

impl<'a> Parts<'a> {
    /// By negative eigenvalues.
    fn new(series: &'a Series, kept: u8) -> Self {
        let folded = series.fold(kept);
        Self { concave: folded.concave(), folded }
    }

    /// By the vectors `w`, or by negative eigenvalues where these are not enough.
    fn with(series: &'a Series, kept: u8, w: &[[f32; MAX_JOINTS]]) -> Self {
        let folded = series.fold(kept);
        let N = folded.concave_matrix(w);
        let concave = if folded.is_convex_with(&N) { Concave { N, w: w.to_vec() } } else { folded.concave() };
        Self { concave, folded }
    }
}

/// A tangent to the convex part of a corner's second order.
struct TangentAt {
    /// Slopes of first order and tangent, by all coordinates.
    g: Vec<f64>,
    /// f(m), and what the tangent adds to it.
    value: f64,
}

/// Where the first order of a corner is least.
struct LeastOfCorner<'a> {
    /// What is added to r·x.
    offset: f64,
    series: &'a Series,
    /// With no square kept.
    folded: Folded<'a>,
    /// A configuration where g·δ is least.
    at: &'a [f64],
    /// L, and its multipliers.
    bound: f64,
    multipliers: &'a Multipliers,
}

/// Normals that are tried on a cell.
const MAX_NORMALS: usize = 4;
/// Normals closer than this are the same.
const SAME_NORMAL: f64 = 1e-3;
/// Tangents that are tried for a corner, each while what is missing is less than so many times what is to be had, as far as
/// was seen. On three regions of an arm each lets about nine in ten of the corners pass that hold in the end, and stops half
/// to four in five of the others.
const HOPES: [f64; 8] = [2.0, 1.3, 0.85, 0.55, 0.36, 0.23, 0.15, 0.1];
