//! Where two bodies are nearest along a direction.
//!
//! Both support faces along n (a vertex, an edge, a face, a disc) lie in planes orthogonal to n. The points of the two
//! faces that are nearest to each other, by alternating projections, are the witnesses: seen along n they coincide if
//! the gap along n is the distance, or the penetration depth, of the bodies.

use crate::separation::Placed;
use kinematics::Support;
use nalgebra::Vector3;
use scene::Shape;

/// A component of n below this counts as zero: the support face extends along that axis. Erring side: a face that is
/// nearly parallel counts as parallel.
const TOL_PARALLEL: f64 = 1e-6;
const MAX_PROJECTIONS: usize = 32;

/// Points x_a of `a` with the least and x_b of `b` with the greatest n·x, nearest to each other across n (of length 1,
/// from B to A).
pub(crate) fn witnesses(a: Placed<'_>, b: Placed<'_>, n: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let down = -n;
    let mut x_a = project(a, &down, &b.X.p);
    let mut x_b = project(b, n, &x_a);
    for _ in 0..MAX_PROJECTIONS {
        let next = project(a, &down, &x_b);
        let moved = (next - x_a).norm_squared();
        x_a = next;
        x_b = project(b, n, &x_a);
        if moved < 1e-24 {
            break;
        }
    }
    (x_a, x_b)
}

/// The point of the support face of a body along `w` that is nearest to `y`.
fn project(body: Placed<'_>, w: &Vector3<f64>, y: &Vector3<f64>) -> Vector3<f64> {
    let w_S = body.X.R.tr_mul(w);
    let y_S = body.X.R.tr_mul(&(y - body.X.p));
    let along = |half: f64, w: f64, y: f64| {
        if w.abs() < TOL_PARALLEL { y.clamp(-half, half) } else { half.copysign(w) }
    };
    let x_S = match body.shape {
        Shape::Box { half_extents } => Vector3::from_fn(|k, _| along(half_extents[k], w_S[k], y_S[k])),
        Shape::Cylinder { radius, half_length } => {
            let z = along(*half_length, w_S.z, y_S.z);
            let across = w_S.x.hypot(w_S.y);
            let (x, y) = if across < TOL_PARALLEL {
                let shrink = radius / y_S.x.hypot(y_S.y).max(*radius);
                (y_S.x * shrink, y_S.y * shrink)
            } else {
                (radius * w_S.x / across, radius * w_S.y / across)
            };
            Vector3::new(x, y, z)
        }
        Shape::Sphere { .. } => Vector3::zeros(),
        Shape::Capsule { half_length, .. } => Vector3::new(0.0, 0.0, along(*half_length, w_S.z, y_S.z)),
    };
    body.X.transform(&(x_S + body.shape.rounding_radius() * w_S))
}
