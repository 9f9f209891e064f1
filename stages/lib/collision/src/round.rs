//! Signed distances of a point, and with them of spheres, from every shape, in closed form.

use crate::separation::{Placed, Separation};
use kinematics::Support;
use nalgebra::Vector3;
use scene::Shape;

/// Distance of the world point `p` from the body `b`, with a minus sign inside.
#[inline]
pub fn point_distance(p: &Vector3<f64>, b: Placed<'_>) -> f64 {
    let x = b.X.R.tr_mul(&(p - b.X.p));
    core_distance(b.shape, &x) - b.shape.rounding_radius()
}

/// The sphere about `center` as body A against body B.
pub fn sphere_separation(center: &Vector3<f64>, radius: f64, b: Placed<'_>) -> Separation {
    let x = b.X.R.tr_mul(&(center - b.X.p));
    let normal = b.X.R * core_direction(b.shape, &x);
    Separation { gap: core_distance(b.shape, &x) - b.shape.rounding_radius() - radius, normal }
}

/// Signed distance of `x`, in the shape's frame, from the core.
#[inline]
fn core_distance(shape: &Shape, x: &Vector3<f64>) -> f64 {
    match shape {
        Shape::Sphere { .. } => x.norm(),
        Shape::Capsule { half_length, .. } => {
            Vector3::new(x.x, x.y, x.z - x.z.clamp(-half_length, *half_length)).norm()
        }
        Shape::Box { half_extents } => {
            let outside = x.abs() - half_extents;
            let inside = outside.max();
            if inside <= 0.0 { inside } else { outside.map(|e| e.max(0.0)).norm() }
        }
        Shape::Cylinder { radius, half_length } => {
            // Lengths of a scene are far from over- and underflow; `hypot` took a fifth of all checking.
            let (radial, axial) = ((x.x * x.x + x.y * x.y).sqrt() - radius, x.z.abs() - half_length);
            if radial > 0.0 && axial > 0.0 {
                (radial * radial + axial * axial).sqrt()
            } else {
                radial.max(axial)
            }
        }
    }
}

/// Unit direction in which the signed distance of `x` grows fastest.
fn core_direction(shape: &Shape, x: &Vector3<f64>) -> Vector3<f64> {
    let or_z = |v: Vector3<f64>| v.try_normalize(0.0).unwrap_or_else(Vector3::z);
    match shape {
        Shape::Sphere { .. } => or_z(*x),
        Shape::Capsule { half_length, .. } => {
            let off = Vector3::new(x.x, x.y, x.z - x.z.clamp(-half_length, *half_length));
            off.try_normalize(0.0).unwrap_or_else(Vector3::x)
        }
        Shape::Box { half_extents } => {
            let outside = x.abs() - half_extents;
            if outside.max() > 0.0 {
                return or_z(outside.map(|e| e.max(0.0)).zip_map(x, f64::copysign));
            }
            let mut direction = Vector3::zeros();
            let axis = outside.imax();
            direction[axis] = 1.0_f64.copysign(x[axis]);
            direction
        }
        Shape::Cylinder { radius, half_length } => {
            let length = x.x.hypot(x.y);
            let radial =
                if length > 0.0 { Vector3::new(x.x / length, x.y / length, 0.0) } else { Vector3::x() };
            let axial = Vector3::new(0.0, 0.0, 1.0_f64.copysign(x.z));
            combine(length - radius, radial, x.z.abs() - half_length, axial).normal
        }
    }
}

/// Separation of products of sets: the gaps in two orthogonal subspaces, each along its unit direction. Apart in both:
/// Pythagoras; apart in one or none: the larger gap.
#[inline]
pub fn combine(gap_u: f64, u: Vector3<f64>, gap_v: f64, v: Vector3<f64>) -> Separation {
    if gap_u > 0.0 && gap_v > 0.0 {
        let gap = (gap_u * gap_u + gap_v * gap_v).sqrt();
        Separation { gap, normal: (u * gap_u + v * gap_v) / gap }
    } else if gap_u >= gap_v {
        Separation { gap: gap_u, normal: u }
    } else {
        Separation { gap: gap_v, normal: v }
    }
}
