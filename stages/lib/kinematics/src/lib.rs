//! Kinematics of the composite tree: where links and bodies are, and how they move against each other.
//!
//! - [`Kinematics`]: forward kinematics of all links.
//! - [`Chain`]: X_AB(q) between two links or bodies as a product of fixed transforms and joint motions.
//! - [`PairChain`]: the joints that matter for a pair of bodies, seen from every link between them, after
//!   dropping rotations about axes of symmetry (mathematics 2.1).
//! - [`Support`]: bodies as "core + ball", by the support function of the core.
//! - [`RationalPose`]: poses along a chain as polynomials of tangents of half angles (mathematics 2.2).
//! - [`Reach`]: bounds of a body's distance from the joints' axes, for second-order bounds along paths.

mod chain;
mod forward;
mod pair_chain;
mod rational;
mod reach;
mod relevance;
mod support;
mod symmetry;

pub use chain::{Chain, ChainJoint};
pub use forward::Kinematics;
pub use pair_chain::{PairChain, PairFrame};
pub use rational::{RationalPose, TcVariable};
pub use reach::Reach;
pub use relevance::relevant_coordinates;
pub use scene::RigidTransform;
pub use support::Support;
pub use symmetry::{Deviation, TOL_SYMMETRY, deviation_from_symmetry};
