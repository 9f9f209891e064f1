//! What can be wrong with a plan or with the regions.

use thiserror::Error;

/// Why paths cannot be searched.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GcsError {
    /// Lists of the plan that do not fit together.
    #[error("the plan has {found} {field}, expected {expected}: make the plan again with miqp")]
    PlanShape {
        /// Which list.
        field: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A configuration with a coordinate that is no number.
    #[error(
        "configuration {configuration_idx} of the plan has the value {value} in coordinate {coordinate}, expected a finite number: make the plan again with miqp"
    )]
    NotFinite {
        /// Position in the plan.
        configuration_idx: usize,
        /// Name of the coordinate.
        coordinate: String,
        /// The value.
        value: f64,
    },
    /// Start and goal of a segment lie in different leaves.
    #[error("segment {segment_idx} ({mode}) changes a kept form by {difference:e} from configuration {segment_idx} to {}: only a plan with the kept forms of this task has paths", segment_idx + 1)]
    KeptForm {
        /// Position of the segment.
        segment_idx: usize,
        /// Its mode.
        mode: &'static str,
        /// Largest change.
        difference: f64,
    },
    /// A configuration that no region holds.
    #[error(
        "configuration {configuration_idx} of the plan lies in no region within the {space}: give the regions that the plan was made with"
    )]
    OutsideRegions {
        /// Position in the plan.
        configuration_idx: usize,
        /// `grasp space` or `placement space`.
        space: &'static str,
    },
    /// Options out of range.
    #[error("option {option} has the value {value}, expected {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        expected: &'static str,
    },
}
