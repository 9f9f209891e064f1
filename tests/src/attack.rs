//! Attacks on regions that are said to be free of collision, by the collision library alone: samples, and descents of
//! the distance between two bodies. They read a region as it stands in a file, so the kind of its certificate is no
//! matter.

use crate::polytope_samples::Walk;
use collision::CollisionChecker;
use convex_sets::lp;
use ipc_types::artefact::Region;
use nalgebra::{DMatrix, DVector};
use scene::Scene;

/// Most steps of a descent.
const MAX_STEPS: usize = 60;

/// Step of numerical gradients, radians or metres: distances are exact to some 1e-12.
const GRADIENT_STEP: f64 = 1e-6;

/// A region under attack.
#[derive(Debug)]
pub struct Attack<'a> {
    checker: &'a CollisionChecker,
    region: &'a Region,
    A: DMatrix<f64>,
    b: DVector<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
}

/// Where a descent ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Descent {
    /// The configuration, inside the region.
    pub q: Vec<f64>,
    /// Distance of the pair there less its clearance, metres.
    pub excess: f64,
    /// Whether the collision library calls the pair colliding there, or closer than its clearance.
    pub collides: bool,
}

impl<'a> Attack<'a> {
    /// On `region`, in `scene`, whose checker is `checker`.
    pub fn new(scene: &Scene, checker: &'a CollisionChecker, region: &'a Region) -> Attack<'a> {
        let (m, n) = (region.A.len(), region.center.len());
        let A = DMatrix::from_fn(m, n, |i, j| region.A[i][j]);
        let b = DVector::from_column_slice(&region.b);
        Attack { checker, region, A, b, lower: scene.lower(), upper: scene.upper() }
    }

    /// The first of `n` samples by hit-and-run that collides.
    pub fn colliding_sample(&self, n: usize, seed: u64) -> Option<Vec<f64>> {
        let mut walk = Walk::new(self.region, seed);
        (0..n).find_map(|_| {
            let q = walk.step();
            (!self.checker.is_free(q)).then(|| q.to_vec())
        })
    }

    /// The pairs of bodies, closest first at `q`.
    pub fn pairs_by_distance(&self, q: &[f64]) -> Vec<usize> {
        let mut pairs: Vec<(f64, usize)> =
            (0..self.checker.n_pairs()).map(|pair_idx| (self.excess(pair_idx, q), pair_idx)).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        pairs.into_iter().map(|(_, pair_idx)| pair_idx).collect()
    }

    fn excess(&self, pair_idx: usize, q: &[f64]) -> f64 {
        self.checker.pair_distance(pair_idx, q) - self.checker.clearance(pair_idx)
    }

    /// Minimises the distance of a pair over the region from `start`, a point of the region.
    ///
    /// Each step tries points towards the vertex of the region that the gradient points away from (Frank and Wolfe
    /// 1956), and points against the gradient up to the region's faces; the best of them is the next. All of them are
    /// inside the region.
    pub fn descend(&self, pair_idx: usize, start: &[f64]) -> Descent {
        let mut q = start.to_vec();
        let mut excess = self.excess(pair_idx, &q);
        for _ in 0..MAX_STEPS {
            let g = self.gradient(pair_idx, &q);
            if g.norm() == 0.0 {
                break;
            }
            let mut best: Option<(f64, Vec<f64>)> = None;
            let mut consider = |point: Vec<f64>| {
                if Walk::excess(self.region, &point) > 0.0 {
                    return;
                }
                let value = self.excess(pair_idx, &point);
                if value < excess && best.as_ref().is_none_or(|(least, _)| value < *least) {
                    best = Some((value, point));
                }
            };
            let towards = |direction: &DVector<f64>, t: f64| -> Vec<f64> {
                q.iter().zip(direction.iter()).map(|(q, d)| q + t * d).collect()
            };
            let vertex = lp::minimize(&g, &self.A, &self.b, &self.lower, &self.upper);
            if let Some(vertex) = vertex.optimal_point() {
                let direction = vertex - DVector::from_column_slice(&q);
                // Just short of the vertex, which may lie outside by rounding.
                let shares = [1.0 - 1e-12, 1.0 - 1e-9, 0.9, 0.75, 0.5, 0.25, 0.1, 0.03, 0.01, 1e-3, 1e-4];
                shares.iter().for_each(|&t| consider(towards(&direction, t)));
            }
            let down = -g.normalize();
            let room = self.room(&q, &down) * (1.0 - 1e-12);
            [1.0, 0.5, 0.1, 1e-2, 1e-3].iter().for_each(|&t| consider(towards(&down, t * room)));
            match best {
                Some((value, point)) => {
                    let gain = excess - value;
                    (q, excess) = (point, value);
                    if gain < 1e-13 {
                        break;
                    }
                }
                None => break,
            }
        }
        let collides = !self.checker.pair_is_free(pair_idx, &q);
        Descent { q, excess, collides }
    }

    /// How far one can go from `q` along `direction`.
    fn room(&self, q: &[f64], direction: &DVector<f64>) -> f64 {
        let rows = self.region.A.iter().zip(&self.region.b);
        let rooms = rows.filter_map(|(a, b)| {
            let along: f64 = a.iter().zip(direction.iter()).map(|(a, d)| a * d).sum();
            let at: f64 = a.iter().zip(q).map(|(a, q)| a * q).sum();
            (along > 1e-15).then(|| ((b - at) / along).max(0.0))
        });
        rooms.fold(1e3, f64::min)
    }

    fn gradient(&self, pair_idx: usize, q: &[f64]) -> DVector<f64> {
        DVector::from_fn(q.len(), |j, _| {
            let at = |step: f64| {
                let mut q = q.to_vec();
                q[j] += step;
                self.excess(pair_idx, &q)
            };
            (at(GRADIENT_STEP) - at(-GRADIENT_STEP)) / (2.0 * GRADIENT_STEP)
        })
    }
}
