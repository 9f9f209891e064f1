//! Volume of a polyhedron by sampling its bounding box.

use nalgebra::DVector;
use rand::{Rng, RngExt};

use crate::{HPolyhedron, SetError};

/// An estimate from samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VolumeEstimate {
    /// Estimated volume, in the product of the coordinates' units.
    pub volume: f64,
    /// Standard error of the estimate.
    pub standard_error: f64,
}

impl HPolyhedron {
    /// Volume from `n_samples` > 0 uniform points of P's bounding box.
    pub fn estimate_volume(&self, n_samples: usize, rng: &mut impl Rng) -> Result<VolumeEstimate, SetError> {
        let bounds = self.bounding_box()?;
        let extent = &bounds.upper - &bounds.lower;
        let mut n_inside = 0;
        for _ in 0..n_samples {
            let x = DVector::from_fn(extent.len(), |j, _| bounds.lower[j] + extent[j] * rng.random::<f64>());
            n_inside += usize::from(self.contains(&x, 0.0));
        }
        let share = n_inside as f64 / n_samples as f64;
        let standard_error = bounds.volume() * (share * (1.0 - share) / n_samples as f64).sqrt();
        Ok(VolumeEstimate { volume: bounds.volume() * share, standard_error })
    }
}
