//! Straight edges against the scene, continuously, by the second-order chord bound (mathematics 2.1, Paths).
//!
//! Along q(t) = (1 - t) q_0 + t q_1 the gap of a pair along a direction n fixed in the frame of a link between its
//! bodies is a minimum of functions of t whose second derivative is at most M2. Over an interval of length l whose
//! gaps at both ends and in the middle exceed the clearance by more than M2 l²/32, it never reaches the clearance.
//! n is the separating direction at the middle; the frame is the one with the least M2.
//!
//! In double precision with a slack for rounding: good for a visibility graph, not a proof.

use crate::checker::{CollisionChecker, Placements};
use crate::separation::{TOL_CONTACT, distance_separation, gap_along, separation};
use scene::CollisionPair;
use std::collections::VecDeque;

/// How hard to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOptions {
    /// Most halvings of the edge. Larger: fewer undecided edges that graze an obstacle, more time on them.
    pub max_depth: u32,
    /// Most intervals that are looked at. Larger: as above.
    pub max_intervals: usize,
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self { max_depth: 20, max_intervals: 2_000 }
    }
}

/// What is known of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EdgeOutcome {
    /// All pairs keep their clearance all along.
    Free,
    /// At parameter `t` in [0, 1] the pair does not keep its clearance.
    Colliding {
        /// Parameter.
        t: f64,
        /// The pair.
        pair: CollisionPair,
    },
    /// Too close to an obstacle to say within the limits of the options.
    Undecided,
}

/// An interval of the edge with the pairs that are not settled on it.
struct Interval {
    t_0: f64,
    t_1: f64,
    depth: u32,
    /// Positions of the placements at both ends.
    at_0: usize,
    at_1: usize,
    pairs: Vec<usize>,
}

impl CollisionChecker {
    /// Whether the straight edge from `q_0` to `q_1` is free, with the default options.
    pub fn edge_is_free(&self, q_0: &[f64], q_1: &[f64]) -> EdgeOutcome {
        self.edge_is_free_with(q_0, q_1, &EdgeOptions::default())
    }

    /// Whether the straight edge from `q_0` to `q_1` is free.
    pub fn edge_is_free_with(&self, q_0: &[f64], q_1: &[f64], options: &EdgeOptions) -> EdgeOutcome {
        let d: Vec<f64> = q_0.iter().zip(q_1).map(|(a, b)| b - a).collect();
        let mut q = vec![0.0; self.dim];
        let mut place = |t: f64| {
            for j in 0..self.dim {
                q[j] = if t == 1.0 { q_1[j] } else { q_0[j] + t * d[j] };
            }
            let mut at = Placements::default();
            self.place(&q, &mut at);
            at
        };
        let mut placements = vec![place(0.0), place(1.0)];
        for (t, at) in [(0.0, &placements[0]), (1.0, &placements[1])] {
            if let Some(pair_idx) = (0..self.pairs.len()).find(|&pair_idx| !self.is_apart(pair_idx, at)) {
                return EdgeOutcome::Colliding { t, pair: self.pair(pair_idx) };
            }
        }
        // A pair that the edge does not move is settled by its ends.
        let moved = |pair_idx: &usize| self.pairs[*pair_idx].coordinates.iter().any(|&j| d[j] != 0.0);
        let pairs: Vec<usize> = (0..self.pairs.len()).filter(moved).collect();
        // Least M2 of a pair and its frame, found when the pair is first looked at closely.
        let mut bounds: Vec<Option<(f64, usize)>> = vec![None; self.pairs.len()];
        let mut undecided = false;
        let mut n_intervals = 0;
        // Breadth first: the coarse middles find most collisions.
        let mut queue = VecDeque::new();
        queue.push_back(Interval { t_0: 0.0, t_1: 1.0, depth: 0, at_0: 0, at_1: 1, pairs });
        while let Some(interval) = queue.pop_front() {
            n_intervals += 1;
            let t = 0.5 * (interval.t_0 + interval.t_1);
            let at_middle = placements.len();
            placements.push(place(t));
            let mut open = Vec::new();
            for &pair_idx in &interval.pairs {
                let ends = [&placements[interval.at_0], &placements[interval.at_1]];
                let length = interval.t_1 - interval.t_0;
                match self.settle(pair_idx, &d, length, ends, &placements[at_middle], &mut bounds[pair_idx]) {
                    Settled::Free => {}
                    Settled::Colliding => return EdgeOutcome::Colliding { t, pair: self.pair(pair_idx) },
                    Settled::Open => open.push(pair_idx),
                }
            }
            if open.is_empty() {
                continue;
            }
            if interval.depth >= options.max_depth || n_intervals + queue.len() >= options.max_intervals {
                undecided = true;
                continue;
            }
            let Interval { t_0, t_1, depth, at_0, at_1, .. } = interval;
            let depth = depth + 1;
            queue.push_back(Interval { t_0, t_1: t, depth, at_0, at_1: at_middle, pairs: open.clone() });
            queue.push_back(Interval { t_0: t, t_1, depth, at_0: at_middle, at_1, pairs: open });
        }
        if undecided { EdgeOutcome::Undecided } else { EdgeOutcome::Free }
    }

    /// One pair on one interval of the given `length` in t.
    fn settle(
        &self,
        pair_idx: usize,
        d: &[f64],
        length: f64,
        ends: [&Placements; 2],
        middle: &Placements,
        bound: &mut Option<(f64, usize)>,
    ) -> Settled {
        let checked = &self.pairs[pair_idx];
        let (a, b) = self.placed(pair_idx, middle);
        // The gap moves by at most the inflation from that of exact symmetry, where it is evaluated and in between.
        let needed = checked.clearance + TOL_CONTACT + 2.0 * checked.inflation;
        let between = a.X.p - b.X.p;
        let distance = between.norm();
        let ball_gap = distance - self.radii(pair_idx);
        // First order: the bodies approach by at most (speed · half the interval).
        if ball_gap > needed {
            let (_, reach_a, reach_b) = &checked.frames[checked.frames.len() / 2];
            let speed = reach_a.speed_bound(d) + reach_b.speed_bound(d);
            if ball_gap - 0.5 * length * speed > needed {
                return Settled::Free;
            }
        }
        let (M2, frame_idx) = *bound.get_or_insert_with(|| self.least_acceleration(pair_idx, d));
        let margin = M2 * length * length / 32.0 + needed;
        let holds = |normal| {
            let n_G = middle.groups[checked.frames[frame_idx].0].R.tr_mul(&normal);
            ends.iter().all(|at| {
                let (a, b) = self.placed(pair_idx, at);
                gap_along(a, b, &(at.groups[checked.frames[frame_idx].0].R * n_G)) > margin
            })
        };
        // Bodies that are far apart: the direction between their centres does and costs less.
        if ball_gap > margin && holds(between / distance) {
            return Settled::Free;
        }
        let mut best = separation(a, b);
        if best.gap <= checked.clearance + TOL_CONTACT && best.gap > 0.0 {
            best = distance_separation(a, b);
        }
        if best.gap <= checked.clearance + TOL_CONTACT {
            Settled::Colliding
        } else if best.gap > margin && holds(best.normal) {
            Settled::Free
        } else {
            Settled::Open
        }
    }

    /// Least M2 over the frames of a pair, and the frame's position.
    fn least_acceleration(&self, pair_idx: usize, d: &[f64]) -> (f64, usize) {
        let mut least = (f64::INFINITY, 0);
        for (frame_idx, (_, reach_a, reach_b)) in self.pairs[pair_idx].frames.iter().enumerate() {
            let M2 = reach_a.acceleration_bound(d) + reach_b.acceleration_bound(d);
            if M2 < least.0 {
                least = (M2, frame_idx);
            }
        }
        least
    }
}

enum Settled {
    Free,
    Colliding,
    Open,
}
