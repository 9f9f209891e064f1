//! Bodies as "core ⊕ ball of a radius", by the support function of the core.
//!
//! σ(w) = max { w·x : x in the core }, w in the shape's frame S and of any length. Cores: box: the box; cylinder:
//! the cylinder (a disc plus a segment, exact); capsule: the segment; sphere: the origin. All cores are symmetric
//! about the origin, so min w·x = -σ(w).

use nalgebra::Vector3;
use scene::Shape;

/// Support function of a convex shape.
pub trait Support {
    /// σ(w) of the core.
    fn core_support_value(&self, w: &Vector3<f64>) -> f64;
    /// A point of the core with the greatest w·x.
    fn core_support_point(&self, w: &Vector3<f64>) -> Vector3<f64>;
    /// Radius of the ball added to the core; 0 for boxes and cylinders.
    fn rounding_radius(&self) -> f64;
    /// Greatest distance of a point of the core from the origin of S.
    fn core_extent(&self) -> f64;

    /// σ of the whole shape: the core's plus radius · ‖w‖.
    fn support_value(&self, w: &Vector3<f64>) -> f64 {
        self.core_support_value(w) + self.rounding_radius() * w.norm()
    }

    /// A point of the whole shape with the greatest w·x.
    fn support_point(&self, w: &Vector3<f64>) -> Vector3<f64> {
        let ball = w.try_normalize(0.0).unwrap_or_else(Vector3::zeros) * self.rounding_radius();
        self.core_support_point(w) + ball
    }

    /// Radius of the smallest ball about the origin of S that holds the whole shape.
    fn bounding_radius(&self) -> f64 {
        self.core_extent() + self.rounding_radius()
    }
}

impl Support for Shape {
    fn core_support_value(&self, w: &Vector3<f64>) -> f64 {
        match self {
            Shape::Box { half_extents } => half_extents.dot(&w.abs()),
            Shape::Cylinder { radius, half_length } => radius * w.x.hypot(w.y) + half_length * w.z.abs(),
            Shape::Sphere { .. } => 0.0,
            Shape::Capsule { half_length, .. } => half_length * w.z.abs(),
        }
    }

    fn core_support_point(&self, w: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Shape::Box { half_extents } => half_extents.zip_map(w, f64::copysign),
            Shape::Cylinder { radius, half_length } => {
                let length = w.x.hypot(w.y);
                let (x, y) =
                    if length > 0.0 { (w.x / length * radius, w.y / length * radius) } else { (0.0, 0.0) };
                Vector3::new(x, y, half_length.copysign(w.z))
            }
            Shape::Sphere { .. } => Vector3::zeros(),
            Shape::Capsule { half_length, .. } => Vector3::new(0.0, 0.0, half_length.copysign(w.z)),
        }
    }

    fn rounding_radius(&self) -> f64 {
        match self {
            Shape::Box { .. } | Shape::Cylinder { .. } => 0.0,
            Shape::Sphere { radius } | Shape::Capsule { radius, .. } => *radius,
        }
    }

    fn core_extent(&self) -> f64 {
        match self {
            Shape::Box { half_extents } => half_extents.norm(),
            Shape::Cylinder { radius, half_length } => (radius * radius + half_length * half_length).sqrt(),
            Shape::Sphere { .. } => 0.0,
            Shape::Capsule { half_length, .. } => *half_length,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shapes() -> [Shape; 4] {
        [
            Shape::Box { half_extents: Vector3::new(1.0, 2.0, 3.0) },
            Shape::Cylinder { radius: 2.0, half_length: 0.5 },
            Shape::Sphere { radius: 0.7 },
            Shape::Capsule { radius: 0.25, half_length: 1.5 },
        ]
    }

    #[test]
    fn known_values() {
        let w = Vector3::new(3.0, 4.0, -2.0);
        let values: Vec<f64> = shapes().iter().map(|shape| shape.core_support_value(&w)).collect();
        assert_eq!(values, [17.0, 11.0, 0.0, 3.0]);
        let zero = Vector3::zeros();
        assert!(shapes().iter().all(|shape| shape.support_value(&zero) == 0.0));
    }

    /// Whether `x` lies in `shape`, by its definition.
    fn contains(shape: &Shape, x: &Vector3<f64>) -> bool {
        let tol = 1e-12;
        match shape {
            Shape::Box { half_extents } => (0..3).all(|k| x[k].abs() <= half_extents[k] + tol),
            Shape::Cylinder { radius, half_length } => {
                x.x.hypot(x.y) <= radius + tol && x.z.abs() <= half_length + tol
            }
            Shape::Sphere { radius } => x.norm() <= radius + tol,
            Shape::Capsule { radius, half_length } => {
                let z = x.z.clamp(-half_length, *half_length);
                (x - Vector3::new(0.0, 0.0, z)).norm() <= radius + tol
            }
        }
    }

    proptest! {
        /// The point lies in the shape and takes the value; no other point of the shape exceeds it.
        #[test]
        fn value_is_taken_and_not_exceeded(
            w in prop::array::uniform3(-1.0..1.0_f64),
            x in prop::array::uniform3(-4.0..4.0_f64),
        ) {
            let (w, x) = (Vector3::from(w), Vector3::from(x));
            for shape in shapes() {
                let point = shape.support_point(&w);
                prop_assert!(contains(&shape, &point));
                prop_assert!((w.dot(&point) - shape.support_value(&w)).abs() < 1e-12);
                prop_assert!(point.norm() <= shape.bounding_radius() + 1e-12);
                if contains(&shape, &x) {
                    prop_assert!(w.dot(&x) <= shape.support_value(&w) + 1e-11);
                }
            }
        }
    }
}
