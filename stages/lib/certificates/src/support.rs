//! Support functions of the cores of bodies, for the inner loops of the certifier.
//!
//! As `kinematics::Support`, but without dispatch to another crate and without `hypot`: a control net calls them
//! thousands of times a cell.

use nalgebra::Vector3;
use scene::Shape;

/// A body without its radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Core {
    /// Half extents.
    Box(f64, f64, f64),
    /// Radius and half length, about z.
    Cylinder(f64, f64),
    /// Half length, on z.
    Segment(f64),
    /// The origin.
    Point,
}

/// Width of the blend at corners, edges and rims in [`Core::soft_support_point`]: components of the unit normal below it count in part.
const SOFTNESS: f64 = 0.05;

impl Core {
    /// Core of `shape`.
    pub fn new(shape: &Shape) -> Self {
        match shape {
            Shape::Box { half_extents } => Self::Box(half_extents.x, half_extents.y, half_extents.z),
            Shape::Cylinder { radius, half_length } => Self::Cylinder(*radius, *half_length),
            Shape::Sphere { .. } => Self::Point,
            Shape::Capsule { half_length, .. } => Self::Segment(*half_length),
        }
    }

    /// max { w·x : x in the core }; the least value is its negative.
    #[inline(always)]
    pub fn support(&self, w: [f64; 3]) -> f64 {
        match *self {
            Self::Box(x, y, z) => w[0].abs() * x + w[1].abs() * y + w[2].abs() * z,
            Self::Cylinder(radius, half_length) => {
                radius * (w[0] * w[0] + w[1] * w[1]).sqrt() + half_length * w[2].abs()
            }
            Self::Segment(half_length) => half_length * w[2].abs(),
            Self::Point => 0.0,
        }
    }

    /// A point of the core where `w`·x is largest.
    pub fn support_point(&self, w: &Vector3<f64>) -> Vector3<f64> {
        match *self {
            Self::Box(x, y, z) => Vector3::new(x * w.x.signum(), y * w.y.signum(), z * w.z.signum()),
            Self::Cylinder(radius, half_length) => {
                let across = w.xy().norm();
                let scale = if across > 0.0 { radius / across } else { 0.0 };
                Vector3::new(w.x * scale, w.y * scale, half_length * w.z.signum())
            }
            Self::Segment(half_length) => Vector3::new(0.0, 0.0, half_length * w.z.signum()),
            Self::Point => Vector3::zeros(),
        }
    }

    /// As [`Core::support_point`] for a unit `w`, but where a whole face, edge or rim is nearly extreme a point
    /// inside it: its motion is that of the face.
    pub fn soft_support_point(&self, w: &Vector3<f64>) -> Vector3<f64> {
        let soft = |component: f64| (component / SOFTNESS).clamp(-1.0, 1.0);
        match *self {
            Self::Box(x, y, z) => Vector3::new(x * soft(w.x), y * soft(w.y), z * soft(w.z)),
            Self::Cylinder(radius, half_length) => {
                let scale = radius / w.xy().norm().max(SOFTNESS);
                Vector3::new(w.x * scale, w.y * scale, half_length * soft(w.z))
            }
            Self::Segment(half_length) => Vector3::new(0.0, 0.0, half_length * soft(w.z)),
            Self::Point => Vector3::zeros(),
        }
    }

    /// Directions, in the shape's frame, in which a separating plane may lie flat against the core.
    pub fn axes(&self) -> &'static [Vector3<f64>] {
        const XYZ: [Vector3<f64>; 3] =
            [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 1.0)];
        match self {
            Self::Box(..) => &XYZ,
            Self::Cylinder(..) | Self::Segment(_) => &XYZ[2..],
            Self::Point => &[],
        }
    }
}
