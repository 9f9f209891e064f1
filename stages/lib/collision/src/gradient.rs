//! How the gap of a pair changes with the configuration.
//!
//! gap(q) = n·(x_a - x_b) for the separating direction n and the witnesses x_a, x_b. Since n is the best direction, its
//! own turning does not count to first order: ∂gap/∂q_j = n·(J_a(x_a) - J_b(x_b))_j. Where n or the witnesses jump this
//! is one of the one-sided derivatives.

use crate::checker::CollisionChecker;
use crate::separation::distance_separation;
use crate::witness::witnesses;

impl CollisionChecker {
    /// Signed distance of pair `pair_idx` at `q` less its clearance, metres, with the gradient over all coordinates,
    /// which is exactly 0 for those that the pair does not depend on. `gradient` has `Scene::dim` entries and is
    /// overwritten.
    pub fn pair_gap(&self, pair_idx: usize, q: &[f64], gradient: &mut [f64]) -> f64 {
        gradient.fill(0.0);
        self.with_pair_placed(pair_idx, q, |at| {
            let (a, b) = self.placed(pair_idx, at);
            let separation = distance_separation(a, b);
            let (x_a, x_b) = witnesses(a, b, &separation.normal);
            let (group_a, group_b) = self.groups_of_pair(pair_idx);
            for (coordinate_idx, slope) in
                self.tree.slopes(&at.groups, (group_a, &x_a), (group_b, &x_b), &separation.normal)
            {
                if self.pairs[pair_idx].coordinates.binary_search(&coordinate_idx).is_ok() {
                    gradient[coordinate_idx] += slope;
                }
            }
            separation.gap - self.pairs[pair_idx].clearance
        })
    }
}
