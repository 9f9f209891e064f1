//! Certificates of freedom from collision for regions and paths.
//!
//! [`Certifier::certify_region`] proves a polytope of C-space free against every pair of bodies by swept hulls
//! (mathematics.md 2.1), and cuts it where it is not, or by sums of squares (2.2), and shrinks it; the certificate can
//! be re-checked without a solver. [`path`] does the same for paths, [`sums::grow`] grows polytopes to be certified.

// `!(x > 0.0)` refuses what is not a number as well, which `x <= 0.0` would let pass.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

mod assemble;
mod bounds;
mod cell;
mod certify_region;
mod clean_up;
mod contact;
mod control_net;
mod corner_bound;
mod corner_leaf;
mod corner_search;
mod corner_series;
mod cut_region;
mod error;
mod guide;
mod lanes;
mod normals;
mod options;
mod pair_model;
mod pair_pipeline;
mod pair_search;
pub mod path;
mod recheck;
mod region_data;
mod reuse;
mod row_program;
mod rows;
mod samples;
mod separating_normal;
mod side;
pub mod sums;
mod support;
mod waiting;

pub use certify_region::{Candidate, CertifiedRegion, Certifier, CertifyOutcome, Purpose};
pub use error::CertifyError;
pub use options::{CertifyOptions, Method};
pub use recheck::{RecheckError, recheck};
pub use reuse::EarlierCertificates;

#[cfg(test)]
mod tests;
