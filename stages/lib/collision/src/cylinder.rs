//! A cylinder against a cylinder or box with a parallel axis: a problem in the plane times one on the line.

use crate::round::combine;
use crate::separation::{Placed, Separation};
use nalgebra::Vector3;
use scene::Shape;

/// Largest sine of the angle between axes that count as parallel. The gap is off by at most this times the bodies'
/// size, which stays below the tolerance of contact; a right angle of a URDF is good to 1e-16.
const TOL_PARALLEL: f64 = 1e-13;

/// Cylinder `a` against cylinder or box `b`; `None` if no axes are parallel.
pub fn parallel_separation(a: Placed<'_>, b: Placed<'_>) -> Option<Separation> {
    let Shape::Cylinder { radius: r_a, half_length: h_a } = *a.shape else { return None };
    let axis_a: Vector3<f64> = a.X.R.column(2).into();
    let between = a.X.p - b.X.p;
    match b.shape {
        Shape::Cylinder { radius: r_b, half_length: h_b } => {
            let axis: Vector3<f64> = b.X.R.column(2).into();
            if axis.cross(&axis_a).norm_squared() > TOL_PARALLEL * TOL_PARALLEL {
                return None;
            }
            let along = axis.dot(&between);
            let across = between - axis * along;
            let length = across.norm();
            let radial = if length > 0.0 { across / length } else { b.X.R.column(0).into() };
            let gap_radial = length - (r_a + r_b);
            let gap_axial = along.abs() - (h_a + h_b);
            Some(combine(gap_radial, radial, gap_axial, axis * 1.0_f64.copysign(along)))
        }
        Shape::Box { half_extents } => {
            let axis_B = b.X.R.tr_mul(&axis_a);
            let k = axis_B.iamax();
            let (u, v) = ((k + 1) % 3, (k + 2) % 3);
            if axis_B[u] * axis_B[u] + axis_B[v] * axis_B[v] > TOL_PARALLEL * TOL_PARALLEL {
                return None;
            }
            let x = b.X.R.tr_mul(&between);
            let unit = |axis: usize| b.X.R.column(axis) * 1.0_f64.copysign(x[axis]);
            let flat = combine(x[u].abs() - half_extents[u], unit(u), x[v].abs() - half_extents[v], unit(v));
            Some(combine(flat.gap - r_a, flat.normal, x[k].abs() - half_extents[k] - h_a, unit(k)))
        }
        _ => None,
    }
}
