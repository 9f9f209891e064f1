//! Boxes.

use nalgebra::DVector;

use crate::HPolyhedron;

/// {x : lower ≤ x ≤ upper}.
#[derive(Debug, Clone, PartialEq)]
pub struct Hyperrectangle {
    /// Lower corner [n].
    pub lower: DVector<f64>,
    /// Upper corner [n].
    pub upper: DVector<f64>,
}

impl Hyperrectangle {
    /// Dimension n.
    pub fn ambient_dimension(&self) -> usize {
        self.lower.len()
    }

    /// The middle of the box.
    pub fn center(&self) -> DVector<f64> {
        0.5 * (&self.lower + &self.upper)
    }

    /// Half the extent in each coordinate.
    pub fn half_widths(&self) -> DVector<f64> {
        0.5 * (&self.upper - &self.lower)
    }

    /// Product of the extents.
    pub fn volume(&self) -> f64 {
        (&self.upper - &self.lower).iter().product()
    }

    /// Whether `x` is in the box, faces included.
    pub fn contains(&self, x: &[f64]) -> bool {
        x.iter().zip(self.lower.iter().zip(self.upper.iter())).all(|(x, (l, u))| l <= x && x <= u)
    }

    /// The common part of both boxes, `None` if it is empty.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let lower = self.lower.zip_map(&other.lower, f64::max);
        let upper = self.upper.zip_map(&other.upper, f64::min);
        lower.iter().zip(upper.iter()).all(|(l, u)| l <= u).then_some(Self { lower, upper })
    }

    /// The box by its faces, as [`HPolyhedron::from_box`].
    pub fn to_polyhedron(&self) -> HPolyhedron {
        HPolyhedron::from_box(&self.lower, &self.upper)
    }
}
