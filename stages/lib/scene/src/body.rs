//! Convex collision bodies.

use crate::RigidTransform;
use nalgebra::Vector3;

/// A convex shape, centred at the origin of its frame S; lengths in metres.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Axis-aligned box.
    Box {
        /// Half of each side.
        half_extents: Vector3<f64>,
    },
    /// Cylinder about z.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Half of its length.
        half_length: f64,
    },
    /// Ball.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Segment on z of the given half length, inflated by the radius.
    Capsule {
        /// Radius.
        radius: f64,
        /// Half of the length of the segment, caps not counted.
        half_length: f64,
    },
}

/// A convex body, rigid on a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// `model/link`, with `#n` from the second collision shape of a link on; the obstacle's name for obstacles.
    pub name: String,
    /// Index of its link.
    pub link_idx: usize,
    /// Pose of the shape's frame S in its link L.
    pub X_LS: RigidTransform,
    /// The shape.
    pub shape: Shape,
}
