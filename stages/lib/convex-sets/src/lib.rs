//! Convex sets of C-space and operations on them.
//!
//! C-space mixes radians and metres: what compares sizes across coordinates does so in units of the set's own
//! bounding box.

mod bounding_box;
mod chebyshev;
mod error;
mod hpolyhedron;
mod hyperrectangle;
pub mod lp;
mod lp_bound;
mod redundancy;

pub use chebyshev::{InscribedBall, TOL_OVERLAP};
pub use error::SetError;
pub use hpolyhedron::HPolyhedron;
pub use hyperrectangle::Hyperrectangle;
pub use lp_bound::safe_lower_bound;
