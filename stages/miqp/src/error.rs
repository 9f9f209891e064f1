//! Errors of the stage.

use thiserror::Error;

/// What can be wrong with the input of a grasp plan.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum MiqpError {
    /// Regions that are not of this scene.
    #[error(transparent)]
    Manipulation(#[from] manipulation::ManipulationError),
    /// A cut over regions that are not there.
    #[error(
        "cut {cut_idx} names region {region_id}, which is not among the regions: cuts belong to the regions they were found with"
    )]
    UnknownRegion {
        /// Position of the cut.
        cut_idx: usize,
        /// The id.
        region_id: u64,
    },
    /// A gap that is not a positive number.
    #[error("option gap has the value {gap}, expected a number from 0 to 1")]
    Gap {
        /// The value.
        gap: f64,
    },
    /// A programme that the solver refused: an error of the planner.
    #[error(transparent)]
    Conic(#[from] conic::ConicError),
}
