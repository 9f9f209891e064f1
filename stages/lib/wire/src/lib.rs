//! Conversions between artefacts and mathematical types, with validation.

mod region;

pub use region::{Region, RegionError};
