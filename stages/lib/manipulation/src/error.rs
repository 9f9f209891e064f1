//! Errors of this crate.

use thiserror::Error;

/// What can be wrong with what a caller hands in.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ManipulationError {
    /// A region of another dimension than the scene.
    #[error(
        "region {region_idx} has dimension {found}, the scene has {expected} coordinates: give the regions of this scene"
    )]
    RegionDimension {
        /// Position of the region in the list.
        region_idx: usize,
        /// Its dimension.
        found: usize,
        /// Dimension of C-space.
        expected: usize,
    },
    /// A region with as many offsets as it should not have, or with a number that is not finite.
    #[error(
        "region {region_idx} has {n_rows} rows and {n_offsets} offsets, or an entry that is not finite: read the regions again"
    )]
    RegionMalformed {
        /// Position of the region in the list.
        region_idx: usize,
        /// Rows of `A`.
        n_rows: usize,
        /// Entries of `b`.
        n_offsets: usize,
    },
}
