//! Shortest transit and transfer paths in graphs of convex sets.
//!
//! For each segment (x_i, x_{i+1}) of a grasp plan: the shortest path inside its *leaf* {q : F q = F x_i}, where F
//! are the forms that its mode keeps, through the polytopes CP ∩ P_j (transit) or CG ∩ P_j (transfer). Vertices are
//! polytopes restricted to the leaf, edges join those that intersect within it.
//!
//! ```text
//! straight line ─► leaf graph ─► first path ─► prune ─► relaxation ─► rounding ─► restriction ─► branch
//!                       └► no way out: leaf cut
//! ```
//!
//! What is claimed rests on no tolerance of a solver: paths are verified against the original faces with outward
//! rounding and keep their forms exactly, lower bounds are `conic::safe_lower_bound` of a relaxation, and "no path"
//! means that every overlap on the way out is proven empty inside the leaf.
//!
//! Sources: thesis 2, section 5.5; Marcucci, Umenberger, Parrilo & Tedrake 2024 (shortest paths in graphs of convex
//! sets); Marcucci, Petersen, von Wrangel & Tedrake 2023 (motion planning around obstacles).

mod detour;
mod error;
mod exact;
mod first_path;
mod leaf_frame;
mod leaf_graph;
mod options;
mod path;
mod plan_paths;
mod relaxation;
mod restriction;
mod rounding;
mod search;
mod segment;
mod stage;
mod straight;

pub use error::GcsError;
pub use options::Options;
pub use path::Path;
pub use plan_paths::{PathsOutcome, Regions, Sink, plan_paths};
pub use search::Found;
pub use segment::{SegmentOutcome, solve_segment};
pub use stage::GcsStage;

#[cfg(test)]
mod tests;
