//! IRIS-ZO's nearest collision: zero order, from collision checks alone (Werner et al. 2024).
//!
//! From where a collision was walked to, a compass search slides along the boundary of the obstacle: of the points
//! turned by a step about y and a little nearer, the first that collides is walked to the boundary again; if none does,
//! the step is halved. (IRIS-ZO's nearest *sampled* collision is not the nearest one, and the face of a flat obstacle
//! would come out tilted.)

use nalgebra::DVector;

use crate::pair_metric::PairMetric;
use crate::placing::Placing;

/// First step of the search, radians in the metric; then it is halved down to the last.
pub(crate) const FIRST_STEP: f64 = 0.4;
const LAST_STEP: f64 = 4e-4;
/// Steps of the search at most.
const MAX_SEARCH_STEPS: usize = 60;
/// Halvings of a bisection during the search: the last bisection is to the margin.
const SEARCH_HALVINGS: usize = 14;

/// Slides along the boundary of the obstacle, from `start` on it, to where it is nearest to the free point `y`.
pub(crate) fn compass_search(
    placing: &Placing<'_, '_>,
    metric: &PairMetric,
    start: &DVector<f64>,
    y: &DVector<f64>,
    first_step: f64,
) -> DVector<f64> {
    if !metric.is_regular() {
        return start.clone();
    }
    let domain = placing.domain();
    // In w distances are Euclidean and y is the origin.
    let mut w = metric.w_from_u(start, y);
    let mut step = first_step;
    let mut moved = false;
    for _ in 0..MAX_SEARCH_STEPS {
        if step < LAST_STEP {
            break;
        }
        let radius = w.norm();
        let nearer = tangents(&w).into_iter().find_map(|tangent| {
            let turned = &w + step * radius * tangent;
            let turned = &turned * (radius * (1.0 - 0.05 * step * step) / turned.norm());
            let u = metric.u_from_w(&turned, y);
            // The obstacle may reach beyond the domain; faces may not be placed there.
            (metric.is_inside(&u) && metric.blocks(domain, &u)).then_some(u)
        });
        match nearer {
            Some(u) => {
                let boundary = placing.bisect(metric, &u, y, SEARCH_HALVINGS);
                w = metric.w_from_u(&boundary, y);
                moved = true;
            }
            None => step *= 0.5,
        }
    }
    if moved { placing.bisect(metric, &metric.u_from_w(&w, y), y, 60) } else { start.clone() }
}

/// Unit vectors orthogonal to `w`, each with its opposite: a basis of the tangent space.
fn tangents(w: &DVector<f64>) -> Vec<DVector<f64>> {
    let k = w.len();
    let mut basis: Vec<DVector<f64>> = vec![w.normalize()];
    // Axes that are nearly parallel to w come last, so that what is left of the others is long.
    let mut axes: Vec<usize> = (0..k).collect();
    axes.sort_by(|&i, &j| w[i].abs().total_cmp(&w[j].abs()));
    for j in axes {
        if basis.len() == k {
            break;
        }
        let mut tangent = DVector::zeros(k);
        tangent[j] = 1.0;
        for other in &basis {
            tangent -= tangent.dot(other) * other;
        }
        let norm = tangent.norm();
        if norm > 1e-6 {
            basis.push(tangent / norm);
        }
    }
    basis[1..].iter().flat_map(|t| [t.clone(), -t]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_orthonormal() {
        let w = DVector::from_vec(vec![0.0, 3.0, -1.0, 0.5]);
        let basis = tangents(&w);
        assert_eq!(basis.len(), 6);
        for (i, s) in basis.iter().enumerate() {
            assert!(s.dot(&w).abs() < 1e-12 && (s.norm() - 1.0).abs() < 1e-12);
            assert!(basis.iter().enumerate().all(|(j, t)| i / 2 == j / 2 || s.dot(t).abs() < 1e-12));
        }
        assert!(tangents(&DVector::from_vec(vec![-2.0])).is_empty());
    }
}
