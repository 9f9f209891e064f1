//! Checks of single numbers, and directed rounding for proofs about sums.

use crate::RigidTransform;
use crate::error::{Place, SceneError};
use nalgebra::{Translation3, UnitQuaternion};

/// Largest size of a number in a scene: sums and products of such numbers stay far from overflow.
const MAX_MAGNITUDE: f64 = 1e6;

/// `value` if it is finite and of sensible size.
pub fn finite(at: Place, value: f64) -> Result<f64, SceneError> {
    if !value.is_finite() {
        Err(SceneError::NotFinite { at, value })
    } else if value.abs() > MAX_MAGNITUDE {
        Err(SceneError::TooLarge { at, value })
    } else {
        Ok(value)
    }
}

/// `value` if it is finite and greater than zero, as a size must be.
pub fn positive(at: Place, value: f64) -> Result<f64, SceneError> {
    let value = finite(at.clone(), value)?;
    if value > 0.0 { Ok(value) } else { Err(SceneError::NotPositive { at, value }) }
}

/// A pose from URDF's `xyz` (metres) and `rpy` (radians: about fixed x, then y, then z).
pub fn pose(at: impl Fn(&str) -> Place, xyz: [f64; 3], rpy: [f64; 3]) -> Result<RigidTransform, SceneError> {
    for k in 0..3 {
        finite(at(&format!("xyz[{k}]")), xyz[k])?;
        finite(at(&format!("rpy[{k}]")), rpy[k])?;
    }
    let rotation = UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]);
    Ok(RigidTransform::from_parts(Translation3::new(xyz[0], xyz[1], xyz[2]), rotation))
}

/// An interval that contains the exact value of what was computed.
#[derive(Debug, Clone, Copy)]
pub struct Enclosure {
    pub lower: f64,
    pub upper: f64,
}

impl Enclosure {
    /// The number itself.
    pub fn exact(value: f64) -> Self {
        Self { lower: value, upper: value }
    }

    /// Sum, widened by one step on each side.
    pub fn plus(self, other: Self) -> Self {
        Self { lower: (self.lower + other.lower).next_down(), upper: (self.upper + other.upper).next_up() }
    }

    /// Product, widened by one step on each side.
    pub fn times(self, other: Self) -> Self {
        let ends = [
            self.lower * other.lower,
            self.lower * other.upper,
            self.upper * other.lower,
            self.upper * other.upper,
        ];
        Self {
            lower: ends.iter().copied().fold(f64::INFINITY, f64::min).next_down(),
            upper: ends.iter().copied().fold(f64::NEG_INFINITY, f64::max).next_up(),
        }
    }

    /// `Σ coefficients[i] * x[i]`.
    pub fn dot(coefficients: impl Iterator<Item = Self>, x: impl Iterator<Item = Self>) -> Self {
        // A zero coefficient adds exactly nothing: it must not widen the sum.
        let terms = coefficients.zip(x).filter(|(c, _)| c.lower != 0.0 || c.upper != 0.0);
        terms.map(|(c, x)| c.times(x)).reduce(Self::plus).unwrap_or(Self::exact(0.0))
    }
}
