//! The search: intervals of a piece, halved until every pair is apart on each by the second-order bound.
//!
//! On an interval, normalised to [0, 1], gap(t) along a normal is a least value of functions with second derivative at
//! most M2. On the half between two evaluated gaps g, g' it is at least the parabola
//! g + 2 (g' − g) s − M2 s (1/2 − s) / 2, s in [0, 1/2]; see [`stays_above`].

use super::curve::{derivative_bounds, halve};
use super::model::{PairModel, PathCertifier};
use super::verdict::{Obstruction, PieceVerdict};
use collision::{Placements, distance_separation, gap_along, separation};
use ipc_types::artefact::SeparatedInterval;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Relative slack of M2: far above its rounding, here and in a verifier.
const M2_SLACK: f64 = 1.0 + 1e-9;

/// A pair that touches is followed only this deep, for a collision nearby that says more.
const MAX_TOUCHING_DEPTH: u32 = 6;

/// Memory of the search and, after a certified piece, its proof; reused between pieces.
#[derive(Debug, Default, Clone)]
pub struct PathWorkspace {
    placements: Vec<Placements>,
    n_placements: usize,
    nets: Vec<f64>,
    open: Vec<u32>,
    queue: VecDeque<Interval>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
    /// M2 of each world bound on the present interval.
    world_m2: Vec<f64>,
    /// The frame of each pair for closer looks at this piece, once it is chosen.
    chosen: Vec<Option<u16>>,
    touched: Vec<bool>,
    proof: Vec<Record>,
    /// Intervals that were looked at for the last piece.
    pub n_intervals: usize,
}

#[derive(Debug, Clone)]
struct Interval {
    t_0: f64,
    t_1: f64,
    depth: u32,
    /// Where its control net stands.
    net: usize,
    /// Placements at both ends.
    at_0: usize,
    at_1: usize,
    /// Where its list of pairs stands.
    open: std::ops::Range<usize>,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    pair_idx: u32,
    interval: SeparatedInterval,
}

/// One pair on one interval.
enum Settled {
    Free {
        frame: u16,
        normal: Vector3<f64>,
    },
    Open {
        gap: f64,
    },
    /// At an end or in the middle, at the clearance or below.
    Close {
        where_: Where,
        gap: f64,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Where {
    Begin,
    Middle,
    End,
}

impl PathWorkspace {
    /// The proof of the last piece, if it was certified: a list for each pair, as in a certificate.
    pub fn proof(&self, n_pairs: usize) -> Vec<Vec<SeparatedInterval>> {
        let mut lists = vec![Vec::new(); n_pairs];
        for record in &self.proof {
            lists[record.pair_idx as usize].push(record.interval);
        }
        for list in &mut lists {
            list.sort_by(|a, b| a.t_0.total_cmp(&b.t_0));
        }
        lists
    }

    fn begin(&mut self, certifier: &PathCertifier, control_points: &[Vec<f64>]) {
        self.n_placements = 0;
        self.n_intervals = 0;
        self.nets.clear();
        control_points.iter().for_each(|point| self.nets.extend_from_slice(point));
        self.open.clear();
        self.open.extend(0..certifier.pairs.len() as u32);
        self.queue.clear();
        self.speed.resize(certifier.dim, 0.0);
        self.acceleration.resize(certifier.dim, 0.0);
        self.chosen.clear();
        self.chosen.resize(certifier.pairs.len(), None);
        self.touched.clear();
        self.touched.resize(certifier.pairs.len(), false);
        self.proof.clear();
    }

    /// Places everything at `q`; the position of the placements.
    fn place(&mut self, certifier: &PathCertifier, q: impl Fn(&Self) -> std::ops::Range<usize>) -> usize {
        let at = self.n_placements;
        self.n_placements += 1;
        if self.placements.len() == at {
            self.placements.push(Placements::default());
        }
        let range = q(self);
        certifier.checker.place(&self.nets[range], &mut self.placements[at]);
        at
    }
}

impl PathCertifier {
    /// Certifies the Bézier piece with these control points (at least 2, each of finite coordinates inside the joint
    /// limits), or says why not. After [`PieceVerdict::Certified`] the proof is in `workspace`.
    pub fn certify_piece(&self, control_points: &[Vec<f64>], workspace: &mut PathWorkspace) -> PieceVerdict {
        let dim = self.dim;
        let size = control_points.len() * dim;
        workspace.begin(self, control_points);
        let at_0 = workspace.place(self, |_| 0..dim);
        let at_1 = workspace.place(self, |_| size - dim..size);
        let all = 0..workspace.open.len();
        workspace.queue.push_back(Interval { t_0: 0.0, t_1: 1.0, depth: 0, net: 0, at_0, at_1, open: all });
        let (mut touching, mut undecided) = (None, None);
        // Breadth first: the coarse middles find most collisions.
        while let Some(interval) = workspace.queue.pop_front() {
            workspace.n_intervals += 1;
            let t = 0.5 * (interval.t_0 + interval.t_1);
            let left = workspace.nets.len();
            workspace.nets.resize(left + 2 * size, 0.0);
            let (known, halves) = workspace.nets.split_at_mut(left);
            let net = &known[interval.net..interval.net + size];
            derivative_bounds(net, dim, &mut workspace.speed, &mut workspace.acceleration);
            let (left_half, right_half) = halves.split_at_mut(size);
            halve(net, dim, left_half, right_half);
            let at_middle = workspace.place(self, |_| left + size..left + size + dim);
            self.bound_in_world(workspace);
            let begin = workspace.open.len();
            for position in interval.open.clone() {
                let pair_idx = workspace.open[position];
                let obstruction = |workspace: &PathWorkspace, where_: Where, gap: f64| {
                    let model = &self.pairs[pair_idx as usize];
                    let (t, from) = match where_ {
                        Where::Begin => (interval.t_0, interval.net),
                        Where::Middle => (t, left + size),
                        Where::End => (interval.t_1, interval.net + size - dim),
                    };
                    let q = workspace.nets[from..from + dim].to_vec();
                    Obstruction { t, q, pair: model.pair, gap, clearance: model.clearance }
                };
                match self.settle(pair_idx as usize, &interval, at_middle, workspace) {
                    Settled::Free { frame, normal } => {
                        let (t_0, t_1, normal) = (interval.t_0, interval.t_1, normal.into());
                        let interval = SeparatedInterval { t_0, t_1, frame, normal };
                        workspace.proof.push(Record { pair_idx, interval });
                        continue;
                    }
                    Settled::Close { where_, gap } => {
                        let found = obstruction(workspace, where_, gap);
                        if gap <= found.clearance - super::TOL_GAP {
                            return PieceVerdict::Collision(found);
                        }
                        touching.get_or_insert(found);
                        workspace.touched[pair_idx as usize] = true;
                        workspace.open.push(pair_idx);
                    }
                    Settled::Open { gap } => {
                        let many = workspace.n_intervals + workspace.queue.len() >= self.max_intervals;
                        if interval.depth >= self.max_depth || many {
                            undecided.get_or_insert_with(|| obstruction(workspace, Where::Middle, gap));
                        }
                        workspace.open.push(pair_idx);
                    }
                }
            }
            if workspace.n_intervals + workspace.queue.len() >= self.max_intervals
                || interval.depth >= self.max_depth
            {
                continue;
            }
            if interval.depth >= MAX_TOUCHING_DEPTH && touching.is_some() {
                let touched = &workspace.touched;
                let mut end = begin;
                for position in begin..workspace.open.len() {
                    let pair_idx = workspace.open[position];
                    if !touched[pair_idx as usize] {
                        workspace.open[end] = pair_idx;
                        end += 1;
                    }
                }
                workspace.open.truncate(end);
            }
            let open = begin..workspace.open.len();
            if open.is_empty() {
                continue;
            }
            let Interval { t_0, t_1, depth, at_0, at_1, .. } = interval;
            let depth = depth + 1;
            let first = Interval { t_0, t_1: t, depth, net: left, at_0, at_1: at_middle, open: open.clone() };
            let second = Interval { t_0: t, t_1, depth, net: left + size, at_0: at_middle, at_1, open };
            workspace.queue.push_back(first);
            workspace.queue.push_back(second);
        }
        match (touching, undecided) {
            (Some(found), _) => PieceVerdict::Touching(found),
            (None, Some(found)) => PieceVerdict::Undecided(found),
            (None, None) => PieceVerdict::Certified,
        }
    }

    fn bound_in_world(&self, workspace: &mut PathWorkspace) {
        workspace.world_m2.clear();
        for bound in &self.world_bounds {
            let M2 = bound.second_order(&workspace.speed, &workspace.acceleration) * M2_SLACK;
            workspace.world_m2.push(M2);
        }
    }

    /// One pair on one interval, whose bounds of speed and acceleration are in the workspace.
    #[inline]
    fn settle(
        &self,
        pair_idx: usize,
        interval: &Interval,
        at_middle: usize,
        workspace: &mut PathWorkspace,
    ) -> Settled {
        let model = &self.pairs[pair_idx];
        let at = |position: usize| &workspace.placements[position];
        let (ends, middle) = ([at(interval.at_0), at(interval.at_1)], at(at_middle));
        let between = |at: &Placements| at.bodies[model.pair.body_a].p - at.bodies[model.pair.body_b].p;
        // Bodies that are far apart: the balls around them, along the direction between their centres.
        if let Some(world) = model.world {
            let d = between(middle);
            let distance = d.norm();
            if distance - model.radii > model.needed {
                let n = d / distance;
                let M2 =
                    workspace.world_m2[world.bound_a as usize] + workspace.world_m2[world.bound_b as usize];
                let [g_0, g_1] = ends.map(|at| n.dot(&between(at)) - model.radii);
                if stays_above([g_0, distance - model.radii, g_1], M2, model.needed) {
                    return Settled::Free { frame: world.frame_idx, normal: n };
                }
            }
        }
        let settled = self.settle_closely(pair_idx, interval.depth == 0, ends, middle, workspace);
        let (settled, frame_idx) = settled;
        workspace.chosen[pair_idx] = frame_idx;
        settled
    }

    /// One pair by its shapes, and the frame that was chosen for it.
    fn settle_closely(
        &self,
        pair_idx: usize,
        at_ends_too: bool,
        ends: [&Placements; 2],
        middle: &Placements,
        workspace: &PathWorkspace,
    ) -> (Settled, Option<u16>) {
        let model = &self.pairs[pair_idx];
        let chosen = workspace.chosen[pair_idx];
        let limit = model.clearance + super::TOL_GAP;
        let best = self.closest(pair_idx, middle, limit);
        if best.gap <= limit {
            return (Settled::Close { where_: Where::Middle, gap: best.gap }, chosen);
        }
        let frame_idx = chosen.unwrap_or_else(|| least_frame(model, workspace));
        let frame = &model.frames[usize::from(frame_idx)];
        let M2 = (frame.bound_a.second_order(&workspace.speed, &workspace.acceleration)
            + frame.bound_b.second_order(&workspace.speed, &workspace.acceleration))
            * M2_SLACK;
        let n_G = middle.groups[frame.group].R.tr_mul(&best.normal);
        let gap = |at: &Placements| {
            let (a, b) = self.checker.placed(pair_idx, at);
            gap_along(a, b, &(at.groups[frame.group].R * n_G))
        };
        let gaps = [gap(ends[0]), gap(middle), gap(ends[1])];
        if stays_above(gaps, M2, model.needed) {
            let normal = frame.R_GL.tr_mul(&n_G);
            return (Settled::Free { frame: frame_idx, normal }, Some(frame_idx));
        }
        // The ends of later intervals were middles or ends before.
        if at_ends_too {
            for (where_, at, gap) in [(Where::Begin, ends[0], gaps[0]), (Where::End, ends[1], gaps[2])] {
                if gap <= limit {
                    let best = self.closest(pair_idx, at, limit);
                    if best.gap <= limit {
                        return (Settled::Close { where_, gap: best.gap }, Some(frame_idx));
                    }
                }
            }
        }
        (Settled::Open { gap: best.gap }, Some(frame_idx))
    }

    /// Separation of a pair; its distance where a quick direction shows no more than `limit`.
    fn closest(&self, pair_idx: usize, at: &Placements, limit: f64) -> collision::Separation {
        let (a, b) = self.checker.placed(pair_idx, at);
        let quick = separation(a, b);
        if quick.gap <= limit && quick.gap > 0.0 { distance_separation(a, b) } else { quick }
    }
}

/// The frame with the least M2 on the present interval.
fn least_frame(model: &PairModel, workspace: &PathWorkspace) -> u16 {
    let mut least = (f64::INFINITY, 0);
    for (frame_idx, frame) in (0_u16..).zip(&model.frames) {
        let M2 = frame.bound_a.second_order(&workspace.speed, &workspace.acceleration)
            + frame.bound_b.second_order(&workspace.speed, &workspace.acceleration);
        if M2 < least.0 {
            least = (M2, frame_idx);
        }
    }
    least.1
}

/// Whether a gap with these values at 0, 1/2 and 1, and a second derivative of at most `M2` in magnitude, exceeds `needed`
/// all along.
///
/// With K = M2 / 4, the bound on a half in the half's own parameter, D the difference of its ends: the least value of
/// the parabola is (g + g') / 2 − K/8 − D² / (2 K) if |D| < K/2, else it is at an end. It is at least min(g, g') − K/8.
#[inline]
fn stays_above(gaps: [f64; 3], M2: f64, needed: f64) -> bool {
    let K = 0.25 * M2;
    // Each by itself: `f64::min` would pass a NaN over.
    if !gaps.iter().all(|&gap| gap > needed) {
        return false;
    }
    let least = gaps[0].min(gaps[1]).min(gaps[2]);
    if least - 0.125 * K > needed {
        return true;
    }
    let half = |g_0: f64, g_1: f64| {
        let D = g_1 - g_0;
        if D.abs() >= 0.5 * K {
            return true;
        }
        0.5 * (g_0 + g_1) - 0.125 * K - 0.5 * D * D / K > needed
    };
    half(gaps[0], gaps[1]) && half(gaps[1], gaps[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn stays_above_on_both_sides() {
        // A parabola 1 + x² with second derivative 2 over [-1/2, 1/2] touches its own bound.
        assert!(stays_above([1.25, 1.0, 1.25], 2.0, 1.0 - 1e-12));
        assert!(!stays_above([1.25, 1.0, 1.25], 2.0, 1.0));
        assert!(stays_above([1.0, 1.0, 1.0], 3.2, 0.9 - 1e-12));
        assert!(!stays_above([1.0, 1.0, 1.0], 3.2, 0.9));
        assert!(stays_above([1.0, 1.0, 1.0], 0.0, 0.5));
        assert!(!stays_above([f64::NAN, 1.0, 1.0], 0.0, 0.5));
        assert!(!stays_above([1.0, 1.0, 1.0], f64::NAN, 0.5));
    }

    proptest! {
        /// No quadratic with that second derivative through these gaps goes below what is said.
        #[test]
        fn no_parabola_goes_below(
            a in -4.0..4.0_f64, b in -3.0..3.0_f64, c in -1.0..3.0_f64, needed in -2.0..2.0_f64,
        ) {
            let f = |t: f64| a * t * t + b * t + c;
            if stays_above([f(0.0), f(0.5), f(1.0)], 2.0 * a.abs(), needed) {
                for k in 0..=200 {
                    prop_assert!(f(f64::from(k) / 200.0) > needed - 1e-12);
                }
            }
        }
    }
}
