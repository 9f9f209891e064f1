//! The pairs of bodies behind CS_free, for growers that need more than yes and no.

use collision::{CollisionChecker, TranslatingPair};

/// CS_free as an intersection over pairs of bodies: free is what is free for each of them.
pub trait Pairs: Sync {
    /// Number of pairs.
    fn n_pairs(&self) -> usize;

    /// The coordinates that pair `pair_idx` depends on, sorted.
    fn coordinates(&self, pair_idx: usize) -> &[usize];

    /// The first pair that collides at `q`.
    fn first_colliding(&self, q: &[f64]) -> Option<usize>;

    /// Whether pair `pair_idx` is free at `q`.
    fn pair_is_free(&self, pair_idx: usize, q: &[f64]) -> bool;

    /// Metres by which pair `pair_idx` is further apart at `q` than it has to be, negative in collision, with the
    /// gradient over q, which is exactly 0 for coordinates that the pair does not depend on.
    fn gap(&self, pair_idx: usize, q: &[f64], gradient: &mut [f64]) -> f64;

    /// Metres by which the gap of pair `pair_idx` changes at most when q changes by `d` inside the joint limits.
    fn displacement(&self, pair_idx: usize, d: &[f64]) -> f64;

    /// What pair `pair_idx` blocks, if that is convex because its bodies only translate; otherwise the coordinate
    /// of a revolute joint between them.
    fn convex_obstacle(&self, pair_idx: usize) -> Result<TranslatingPair, usize>;
}

impl Pairs for CollisionChecker {
    fn n_pairs(&self) -> usize {
        CollisionChecker::n_pairs(self)
    }

    fn coordinates(&self, pair_idx: usize) -> &[usize] {
        self.pair_coordinates(pair_idx)
    }

    fn first_colliding(&self, q: &[f64]) -> Option<usize> {
        self.colliding_pair_idx(q)
    }

    fn pair_is_free(&self, pair_idx: usize, q: &[f64]) -> bool {
        CollisionChecker::pair_is_free(self, pair_idx, q)
    }

    fn gap(&self, pair_idx: usize, q: &[f64], gradient: &mut [f64]) -> f64 {
        self.pair_gap(pair_idx, q, gradient)
    }

    fn displacement(&self, pair_idx: usize, d: &[f64]) -> f64 {
        self.pair_displacement_bound(pair_idx, d)
    }

    fn convex_obstacle(&self, pair_idx: usize) -> Result<TranslatingPair, usize> {
        self.translating_pair(pair_idx)
    }
}
