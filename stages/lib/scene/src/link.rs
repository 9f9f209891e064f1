//! Links of the composite tree.

use crate::RigidTransform;
use nalgebra::{Unit, Vector3};

/// What a model is in a manipulation task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It moves by its own actuators.
    Robot,
    /// It is what the task moves.
    Object,
    /// It stays where it is, or moves by coordinates that no task names.
    Obstacle,
}

/// How a link moves against the joint's frame F, which is fixed in the parent link.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Rigidly fixed: `X_FL` is the identity.
    Fixed,
    /// `X_FL` is the rotation by `q[coordinate_idx]` about `axis` through the origin of F.
    Revolute {
        /// Unit axis in F.
        axis: Unit<Vector3<f64>>,
        /// Position of the coordinate in `Scene::coordinates`.
        coordinate_idx: usize,
    },
    /// `X_FL` is the translation by `q[coordinate_idx] * axis`.
    Prismatic {
        /// Unit axis in F.
        axis: Unit<Vector3<f64>>,
        /// Position of the coordinate in `Scene::coordinates`.
        coordinate_idx: usize,
    },
}

/// A link of the composite tree: `X_WL = X_WP * X_PF * X_FL(q)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// `model/link`; `world` for link 0; the obstacle's name for a body fixed in the world by `[[obstacle]]`.
    pub name: String,
    /// Role of its model; obstacle for the world and `[[obstacle]]`.
    pub role: Role,
    /// Index of the parent link, less than the link's own; `None` for the world.
    pub parent: Option<usize>,
    /// Pose of the joint's frame F in the parent link P.
    pub X_PF: RigidTransform,
    /// Motion of this link against F.
    pub motion: Motion,
}
