//! What can be wrong with a set.

use thiserror::Error;

/// Why an operation on a set has no result.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SetError {
    /// No point satisfies all rows; proven.
    #[error("the set is empty")]
    Empty,
    /// The set has no interior, or one too thin to tell from rounding.
    #[error("the set has no interior")]
    NoInterior,
    /// The set reaches beyond 10^6 in a coordinate.
    #[error("the set is unbounded in coordinate {coordinate}")]
    Unbounded {
        /// 0-based position of the coordinate.
        coordinate: usize,
    },
    /// Rounding hides the answer.
    #[error("the programme over this set cannot be decided in floating point")]
    Undecided,
}
