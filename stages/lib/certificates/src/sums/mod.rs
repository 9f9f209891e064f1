//! Sum-of-squares certificates in TC-space (C-IRIS; mathematics.md 2.2; Dai et al. 2023).

mod bodies;
pub mod grow;
pub(crate) mod pair_sums;
pub(crate) mod recheck_sums;
pub(crate) mod region_sums;
pub(crate) mod search_sums;
mod tangent_space;
