//! Configurations, edges and paths against the scene.
//!
//! *Free* means that every pair keeps more than its clearance; contact is not free, nor is anything closer than
//! [`TOL_CONTACT`] to it. So the grasp band of a task, which begins at contact, is free but for its closed end.
//! All answers are in double precision: good for search and for sampled checks, not proofs.

mod box_box;
mod checker;
mod cylinder;
mod edge;
mod general;
mod gradient;
mod motion_tree;
mod path;
mod placement;
mod round;
mod separation;
mod translation;
mod witness;

pub use checker::{CollisionChecker, Placements};
pub use edge::{EdgeOptions, EdgeOutcome};
pub use path::PathCollision;
pub use placement::Placement;
pub use separation::{Placed, Separation, TOL_CONTACT, distance_separation, gap_along, separation};
pub use translation::TranslatingPair;
