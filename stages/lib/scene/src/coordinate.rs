//! Coordinates of C-space.

/// Whether a coordinate is an angle or a length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CoordinateKind {
    /// Radians, inside (-π, π).
    Revolute,
    /// Metres.
    Prismatic,
}

/// One coordinate of C-space: a revolute or prismatic joint of the composite tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name as the scene's `order` spells it (`joint`, or `model/joint` where the joint's name is ambiguous).
    pub name: String,
    /// Angle or length.
    pub kind: CoordinateKind,
    /// Lower joint limit, radians or metres.
    pub lower: f64,
    /// Upper joint limit, radians or metres; greater than `lower`.
    pub upper: f64,
}
