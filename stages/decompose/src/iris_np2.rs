//! IRIS-NP2's nearest collision: from a sampled one that was walked to the boundary, along the gradient of the gap of
//! the pair that collides there (Werner et al. 2024).
//!
//! The gap of bodies with edges has kinks at which gradients lead nowhere; so the search ends with small steps of the
//! compass (`iris_zo`).
//!
//! min ‖w‖²  s.t.  gap(w) ≤ 0,  u(w) in the domain; w = R (u - y)_J (`pair_metric`).

use nalgebra::DVector;

use crate::iris_zo::compass_search;
use crate::nearest_collision::nearest_closing;
use crate::pair_metric::PairMetric;
use crate::placing::{Boundary, Placing};

/// First step of the compass at the end, radians in the metric.
const LAST_LEG_STEP: f64 = 0.05;

/// The collision nearest to y that the search comes to; where the collision was walked to if the search finds no
/// nearer one, or no pair is known.
pub(crate) fn gradient_search(
    placing: &Placing<'_, '_>,
    metric: &PairMetric,
    from: &Boundary,
) -> DVector<f64> {
    if metric.pair_idx.is_none() || !metric.is_regular() {
        return from.boundary.clone();
    }
    let domain = placing.domain();
    let (G, h) = metric.box_over_w(&from.y);
    let start = metric.w_from_u(&from.boundary, &from.y);
    let mut gap = |w: &DVector<f64>| metric.gap(domain, w, &from.y);
    let nearest = match nearest_closing(&mut gap, &G, &h, start.clone()) {
        Some(w) if w.norm() < start.norm() => {
            let u = metric.u_from_w(&w, &from.y);
            // The gap and the check that faces rest on may differ by rounding.
            if metric.blocks(domain, &u) {
                placing.bisect(metric, &u, &from.y, 60)
            } else {
                from.boundary.clone()
            }
        }
        _ => from.boundary.clone(),
    };
    compass_search(placing, metric, &nearest, &from.y, LAST_LEG_STEP)
}
