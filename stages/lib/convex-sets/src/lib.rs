//! Convex sets of C-space and operations on them.
//!
//! C-space mixes radians and metres: what compares sizes across coordinates does so in units of the set's own
//! bounding box.

mod bounding_box;
mod chebyshev;
mod enclosing_ellipsoid;
mod error;
mod hit_and_run;
mod hpolyhedron;
mod hyperellipsoid;
mod hyperrectangle;
mod inscribed_ellipsoid;
mod least_norm;
pub mod lp;
mod lp_bound;
mod redundancy;
mod volume;

pub use chebyshev::{InscribedBall, TOL_OVERLAP};
pub use enclosing_ellipsoid::min_enclosing_ellipsoid;
pub use error::SetError;
pub use hit_and_run::{Chord, HitAndRun};
pub use hpolyhedron::HPolyhedron;
pub use hyperellipsoid::Hyperellipsoid;
pub use hyperrectangle::Hyperrectangle;
pub use least_norm::least_norm_point;
pub use lp_bound::safe_lower_bound;
pub use volume::VolumeEstimate;
