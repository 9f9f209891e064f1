//! Rotations that map a body to itself (mathematics 2.1).
//!
//! A rotation about the axis of a cylinder or capsule, or about any axis through the centre of a sphere, does not
//! move the body. The axes agree only nearly: a right angle of a URDF is π/2 rounded.

use crate::{RigidTransform, Support};
use nalgebra::{Unit, Vector3};
use scene::Shape;

/// Largest offset (metres) and tilt (radians) with which an axis counts as the body's axis of symmetry. Larger: more
/// rotations are dropped, each at the price of a radius.
pub const TOL_SYMMETRY: f64 = 1e-9;

/// How far an axis is from a body's axis of symmetry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// ε: distance of the body's origin from the axis, metres.
    pub offset: f64,
    /// τ: angle between the axes, radians; 0 for a sphere.
    pub tilt: f64,
}

impl Deviation {
    /// 2 (ε + τ · extent), rounded up: what a dropped rotation adds to the radius of the body.
    pub fn inflation(&self, shape: &Shape) -> f64 {
        // The relative 1e-6 is far above the rounding of ε and τ, the absolute 1e-15 above that of the poses.
        2.0 * (self.offset + self.tilt * shape.core_extent()) * (1.0 + 1e-6) + 1e-15
    }
}

/// Deviation of `axis`, through the origin of F and given in F, from the axis of symmetry of `shape`, whose frame
/// is at `X_FS`. `None` if the body has no such symmetry within [`TOL_SYMMETRY`].
pub fn deviation_from_symmetry(
    shape: &Shape,
    X_FS: &RigidTransform,
    axis: &Unit<Vector3<f64>>,
) -> Option<Deviation> {
    let tilt = match shape {
        Shape::Box { .. } => return None,
        Shape::Sphere { .. } => 0.0,
        Shape::Cylinder { .. } | Shape::Capsule { .. } => {
            // Opposite directions are one axis.
            (X_FS.rotation * Vector3::z()).cross(axis).norm().min(1.0).asin()
        }
    };
    let offset = X_FS.translation.vector.cross(axis).norm();
    (offset <= TOL_SYMMETRY && tilt <= TOL_SYMMETRY).then_some(Deviation { offset, tilt })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    const CYLINDER: Shape = Shape::Cylinder { radius: 1.0, half_length: 2.0 };

    fn pose(x: f64, roll: f64) -> RigidTransform {
        RigidTransform::from_parts(
            Translation3::new(x, 0.0, 5.0),
            UnitQuaternion::from_euler_angles(roll, 0.0, 0.0),
        )
    }

    #[test]
    fn cylinder_on_both_sides_of_the_tolerance() {
        let z = Vector3::z_axis();
        let exact = deviation_from_symmetry(&CYLINDER, &pose(0.0, 0.0), &z);
        assert_eq!(exact, Some(Deviation { offset: 0.0, tilt: 0.0 }));
        assert!(deviation_from_symmetry(&CYLINDER, &pose(0.9e-9, 0.0), &z).is_some());
        assert!(deviation_from_symmetry(&CYLINDER, &pose(1.1e-9, 0.0), &z).is_none());
        assert!(deviation_from_symmetry(&CYLINDER, &pose(0.0, 1.1e-9), &z).is_none());
        assert!(deviation_from_symmetry(&CYLINDER, &pose(0.0, std::f64::consts::PI), &z).is_some());
        assert!(deviation_from_symmetry(&CYLINDER, &pose(0.0, 0.0), &Vector3::x_axis()).is_none());
    }

    #[test]
    fn sphere_needs_only_its_centre_and_a_box_never() {
        let axis = Unit::new_normalize(Vector3::new(0.0, 0.0, 1.0));
        let sphere = Shape::Sphere { radius: 1.0 };
        assert!(deviation_from_symmetry(&sphere, &pose(0.0, 1.0), &axis).is_some());
        assert!(deviation_from_symmetry(&sphere, &pose(0.1, 0.0), &axis).is_none());
        let cube = Shape::Box { half_extents: Vector3::repeat(1.0) };
        assert!(deviation_from_symmetry(&cube, &pose(0.0, 0.0), &axis).is_none());
    }

    /// A rotation about the slightly wrong axis moves no point of the core further from the core than said.
    #[test]
    fn inflation_covers_a_tilted_and_shifted_axis() {
        let X_FS = pose(0.8e-9, 0.7e-9);
        let deviation =
            deviation_from_symmetry(&CYLINDER, &X_FS, &Vector3::z_axis()).expect("within tolerance");
        let inflation = deviation.inflation(&CYLINDER);
        for step in 0..64 {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), f64::from(step) * 0.1);
            // Pose of the turned body in its own old frame; its support must not exceed the core's by more.
            let X = X_FS.inverse() * RigidTransform::from_parts(Translation3::identity(), turn) * X_FS;
            for k in 0..64 {
                let w =
                    Vector3::new(f64::from(k).cos(), f64::from(k).sin(), f64::from(k % 7) - 3.0).normalize();
                let turned =
                    w.dot(&X.translation.vector) + CYLINDER.core_support_value(&(X.rotation.inverse() * w));
                assert!(turned - CYLINDER.core_support_value(&w) <= inflation);
            }
        }
    }
}
