//! Dense sampled check of a polyline.

use crate::checker::CollisionChecker;
use scene::CollisionPair;

/// Where a path first collides.
#[derive(Debug, Clone, PartialEq)]
pub struct PathCollision {
    /// The piece from point `piece_idx` to the next.
    pub piece_idx: usize,
    /// Parameter on the piece, in [0, 1].
    pub t: f64,
    /// The configuration.
    pub q: Vec<f64>,
    /// The first pair that does not keep its clearance there.
    pub pair: CollisionPair,
}

impl CollisionChecker {
    /// The first sample of the polyline through `points` (each `Scene::dim` entries) that is not free. Between two
    /// samples no pair's bodies move against each other by more than `step` metres (positive), so nothing deeper
    /// than step/2 is missed.
    pub fn path_first_collision(&self, points: &[Vec<f64>], step: f64) -> Option<PathCollision> {
        let collision = |piece_idx, t, q: &[f64]| {
            self.colliding_pair(q).map(|pair| PathCollision { piece_idx, t, q: q.to_vec(), pair })
        };
        if let Some(found) = points.first().and_then(|q| collision(0, 0.0, q)) {
            return Some(found);
        }
        for (piece_idx, ends) in points.windows(2).enumerate() {
            let d: Vec<f64> = ends[0].iter().zip(&ends[1]).map(|(a, b)| b - a).collect();
            let n_steps = (self.displacement_bound(&d) / step).ceil().clamp(1.0, 1e9) as u64;
            let mut q = vec![0.0; self.dim];
            for k in 1..=n_steps {
                let t = k as f64 / n_steps as f64;
                for j in 0..self.dim {
                    q[j] = if k == n_steps { ends[1][j] } else { ends[0][j] + t * d[j] };
                }
                if let Some(found) = collision(piece_idx, t, &q) {
                    return Some(found);
                }
            }
        }
        None
    }

    /// Bound of how far, in metres, the bodies of any pair move against each other when q changes by `d` on a straight
    /// line inside the joint limits.
    pub fn displacement_bound(&self, d: &[f64]) -> f64 {
        (0..self.pairs.len()).map(|pair_idx| self.pair_displacement_bound(pair_idx, d)).fold(0.0, f64::max)
    }

    /// As [`CollisionChecker::displacement_bound`], for one pair: its gap changes by no more.
    pub fn pair_displacement_bound(&self, pair_idx: usize, d: &[f64]) -> f64 {
        let of_frame = |reach: &(usize, kinematics::Reach, kinematics::Reach)| {
            reach.1.speed_bound(d) + reach.2.speed_bound(d)
        };
        self.pairs[pair_idx].frames.iter().map(of_frame).fold(f64::INFINITY, f64::min)
    }
}
