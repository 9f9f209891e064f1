//! A direction in which two convex bodies lie apart, for one configuration.
//!
//! Nothing here has to be right: a poor direction costs cells, not soundness.
//! Between boxes the best of the 15 axes of the separating-axis test; otherwise the direction of the shortest
//! distance between the cores (Gilbert, Johnson & Keerthi 1988) and the axes of the shapes.

use crate::support::Core;
use nalgebra::{Matrix3, Vector3};

/// A core at a pose.
#[derive(Debug, Clone, Copy)]
pub struct PlacedCore {
    /// The core.
    pub core: Core,
    /// Orientation.
    pub R: Matrix3<f64>,
    /// Position of its centre.
    pub p: Vector3<f64>,
}

impl PlacedCore {
    fn support(&self, n: &Vector3<f64>) -> f64 {
        self.core.support((self.R.tr_mul(n)).into())
    }

    fn support_point(&self, n: &Vector3<f64>) -> Vector3<f64> {
        self.p + self.R * self.core.support_point(&self.R.tr_mul(n))
    }
}

/// Gap of the cores along the unit vector `n`, which points from B to A; negative if they overlap along it.
pub fn gap_along(a: &PlacedCore, b: &PlacedCore, n: &Vector3<f64>) -> f64 {
    n.dot(&(a.p - b.p)) - a.support(n) - b.support(n)
}

/// The unit vector of the largest gap among the candidates, and the gap.
pub fn separating_normal(a: &PlacedCore, b: &PlacedCore) -> (Vector3<f64>, f64) {
    let apart = a.p - b.p;
    let mut best = (Vector3::z(), f64::NEG_INFINITY);
    let mut offer = |direction: Vector3<f64>| {
        let norm = direction.norm();
        if !(norm > 1e-9) {
            return;
        }
        let n = direction / norm;
        let n = if n.dot(&apart) < 0.0 { -n } else { n };
        let gap = gap_along(a, b, &n);
        if gap > best.1 {
            best = (n, gap);
        }
    };
    let axes_of = |body: &PlacedCore| {
        let R = body.R;
        body.core.axes().iter().map(move |axis| R * axis)
    };
    for axis in axes_of(a).chain(axes_of(b)) {
        offer(axis);
    }
    for axis_a in axes_of(a) {
        for axis_b in axes_of(b) {
            let cross = axis_a.cross(&axis_b);
            if cross.norm() > 1e-4 {
                offer(cross);
            }
        }
    }
    let both_boxes = matches!((a.core, b.core), (Core::Box(..), Core::Box(..)));
    if !both_boxes {
        // Across the axis of a round body, also where the two overlap.
        offer(apart);
        for body in [a, b] {
            if matches!(body.core, Core::Cylinder(..) | Core::Segment(_)) {
                let axis = body.R.column(2).into_owned();
                offer(apart - axis * axis.dot(&apart));
            }
        }
        if let Some(nearest) = shortest_difference(a, b) {
            offer(nearest);
        }
    }
    best
}

/// The point of A − B nearest to the origin, roughly; `None` if the cores overlap or nearly touch.
pub fn shortest_difference(a: &PlacedCore, b: &PlacedCore) -> Option<Vector3<f64>> {
    shortest_between(a.p - b.p, |n| a.support_point(&-n) - b.support_point(n))
}

/// The point of hull(`points`) − B nearest to the origin, roughly; `None` if the two overlap or nearly touch.
pub fn shortest_difference_of_hull(points: &[Vector3<f64>], b: &PlacedCore) -> Option<Vector3<f64>> {
    let first = points.first()?;
    shortest_between(first - b.p, |n| {
        let lowest = points.iter().fold((f64::INFINITY, first), |least, point| {
            let along = n.dot(point);
            if along < least.0 { (along, point) } else { least }
        });
        lowest.1 - b.support_point(n)
    })
}

/// The point nearest to the origin of the convex set whose lowest point along a direction is `lowest`; `start` is in it.
fn shortest_between(
    start: Vector3<f64>,
    lowest: impl Fn(&Vector3<f64>) -> Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut simplex: Vec<Vector3<f64>> = Vec::with_capacity(4);
    let mut nearest = start;
    for _ in 0..MAX_ITERATIONS {
        let distance = nearest.norm();
        if distance < 1e-9 {
            return None;
        }
        let n = nearest / distance;
        let point = lowest(&n);
        // No point is nearer than n·point.
        if simplex.len() == 4 || (!simplex.is_empty() && distance - n.dot(&point) < 1e-7 * distance) {
            return Some(nearest);
        }
        simplex.push(point);
        nearest = reduce(&mut simplex);
    }
    Some(nearest)
}

/// Enough for the accuracy that a plane needs; round shapes converge slowly.
const MAX_ITERATIONS: usize = 24;

/// The point of the simplex nearest to the origin; the simplex keeps only the vertices that span it.
fn reduce(simplex: &mut Vec<Vector3<f64>>) -> Vector3<f64> {
    let mut best: Option<(f64, usize, Vector3<f64>)> = None;
    for subset in 1..1_usize << simplex.len() {
        let (mut vertices, mut n) = ([Vector3::zeros(); 4], 0);
        for (_, vertex) in simplex.iter().enumerate().filter(|(i, _)| subset >> i & 1 == 1) {
            (vertices[n], n) = (*vertex, n + 1);
        }
        let Some(point) = nearest_in_hull(&vertices[..n]) else { continue };
        let size = point.norm_squared();
        if best.as_ref().is_none_or(|(least, ..)| size < *least) {
            best = Some((size, subset, point));
        }
    }
    // Single vertices are always usable, so there is a best subset.
    let (_, subset, point) = best.unwrap_or((0.0, 1, Vector3::zeros()));
    let mut position = 0;
    simplex.retain(|_| {
        position += 1;
        subset >> (position - 1) & 1 == 1
    });
    point
}

/// The point nearest to the origin of the affine hull of `vertices`, if it lies in the interior of their hull.
fn nearest_in_hull(vertices: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let base = vertices[0];
    let mut edges = [Vector3::zeros(); 3];
    edges.iter_mut().zip(&vertices[1..]).for_each(|(edge, vertex)| *edge = vertex - base);
    let k = vertices.len() - 1;
    if k == 0 {
        return Some(base);
    }
    // Gram · t = −edgesᵀ base, padded to 3 × 3 with ones on the diagonal.
    let mut gram = Matrix3::identity();
    let mut rhs = Vector3::zeros();
    for i in 0..k {
        for j in 0..k {
            gram[(i, j)] = edges[i].dot(&edges[j]);
        }
        rhs[i] = -edges[i].dot(&base);
    }
    let t = gram.try_inverse()? * rhs;
    let inside = t.iter().take(k).all(|&t| t > 0.0) && t.iter().take(k).sum::<f64>() < 1.0;
    inside.then(|| (0..k).fold(base, |point, i| point + edges[i] * t[i]))
}
