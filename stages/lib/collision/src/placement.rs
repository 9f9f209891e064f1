//! Poses as rotation matrices, which turn many vectors faster than quaternions do.

use nalgebra::{Matrix3, Vector3};
use scene::RigidTransform;

/// Pose X_AB: x_A = R x_B + p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Rotation.
    pub R: Matrix3<f64>,
    /// Position of B's origin in A, metres.
    pub p: Vector3<f64>,
}

impl Placement {
    /// The identity.
    pub fn identity() -> Self {
        Self { R: Matrix3::identity(), p: Vector3::zeros() }
    }

    /// X_AB · X_BC.
    #[inline]
    pub fn compose(&self, other: &Self) -> Self {
        Self { R: self.R * other.R, p: self.R * other.p + self.p }
    }

    /// X_AB · p_BP.
    #[inline]
    pub fn transform(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.R * point + self.p
    }

    /// As nalgebra's isometry.
    pub fn to_isometry(self) -> RigidTransform {
        RigidTransform::from_parts(
            self.p.into(),
            nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(
                self.R,
            )),
        )
    }
}

impl From<&RigidTransform> for Placement {
    fn from(X: &RigidTransform) -> Self {
        Self { R: X.rotation.to_rotation_matrix().into_inner(), p: X.translation.vector }
    }
}
