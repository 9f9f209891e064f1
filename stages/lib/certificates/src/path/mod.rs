//! Paths of any planner against the scene, with proof (mathematics 2.1, Paths).
//!
//! A path is a sequence of Bézier pieces q(t), t in [0, 1]; straight pieces have order 1. [`PathCertifier`] proves a
//! piece free against every pair of bodies by second-order bounds over intervals of t, or names a pair and a
//! configuration at which it is not. Bodies move by revolute and prismatic joints, both bodies of a pair may.
//!
//! - [`certify_path`]: a whole path, its kept forms and joint limits included;
//! - [`certify_held_path`]: the same, with objects that follow a gripper;
//! - [`PathCertifier::certify_piece`]: one piece, for planners that ask for many edges.

mod curve;
mod held;
mod kept_forms;
mod model;
mod motion_bound;
mod search;
mod verdict;
mod whole_path;

pub use held::{AttachRequest, HeldError};
pub use model::PathCertifier;
pub use search::PathWorkspace;
pub use verdict::{Obstruction, PieceVerdict};
pub use whole_path::{CertifiedPath, PathOptions, PieceReport, certify_held_path, certify_path};

/// Metres that every gap must exceed its clearance by, on top of what the second-order bound demands.
///
/// It covers the rounding of poses and gaps in double precision (below 1e-13 for arms of some metres) and the width
/// that these get in the intervals of a verifier (below 1e-11 for fourteen joints). Erring side: paths that pass
/// closer than this are left undecided, and no path is certified by rounding.
pub const TOL_GAP: f64 = 1e-9;
