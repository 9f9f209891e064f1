//! Bodies as a core and a radius, by the support function of the core.

use crate::interval::{Interval, Vec3};
use scene::Shape;

/// Enclosure of max { w·x : x in the core of `shape` }, w in the shape's frame. The cores are symmetric about the
/// origin, so the least value is the negative.
pub fn core_support(shape: &Shape, w: &Vec3) -> Interval {
    match shape {
        Shape::Box { half_extents } => {
            w[0].abs() * Interval::point(half_extents.x)
                + w[1].abs() * Interval::point(half_extents.y)
                + w[2].abs() * Interval::point(half_extents.z)
        }
        Shape::Cylinder { radius, half_length } => {
            Interval::point(*radius) * (w[0].square() + w[1].square()).sqrt()
                + Interval::point(*half_length) * w[2].abs()
        }
        Shape::Sphere { .. } => Interval::ZERO,
        Shape::Capsule { half_length, .. } => Interval::point(*half_length) * w[2].abs(),
    }
}

/// The radius of the ball that is added to the core.
pub fn rounding_radius(shape: &Shape) -> f64 {
    match shape {
        Shape::Box { .. } | Shape::Cylinder { .. } => 0.0,
        Shape::Sphere { radius } | Shape::Capsule { radius, .. } => *radius,
    }
}

/// Upper bound of the distance of a point of the core from the shape's origin.
pub fn core_extent(shape: &Shape) -> f64 {
    let length = |x: f64, y: f64, z: f64| {
        (Interval::point(x).square() + Interval::point(y).square() + Interval::point(z).square()).sqrt().hi()
    };
    match shape {
        Shape::Box { half_extents } => length(half_extents.x, half_extents.y, half_extents.z),
        Shape::Cylinder { radius, half_length } => length(*radius, 0.0, *half_length),
        Shape::Sphere { .. } => 0.0,
        Shape::Capsule { half_length, .. } => *half_length,
    }
}

/// Which rotations map the core to itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// None but discrete ones.
    None,
    /// Those about the shape's z axis.
    AboutZ,
    /// Those about any axis through the shape's origin.
    Ball,
}

/// Symmetry of a shape.
pub fn symmetry(shape: &Shape) -> Symmetry {
    match shape {
        Shape::Box { .. } => Symmetry::None,
        Shape::Cylinder { .. } | Shape::Capsule { .. } => Symmetry::AboutZ,
        Shape::Sphere { .. } => Symmetry::Ball,
    }
}
