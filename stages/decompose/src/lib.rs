//! Convex regions of the collision-free configuration space.
//!
//! Seeds come from a visibility clique cover (Werner et al. 2023; thesis 2, appendix D), regions from IRIS-ZO
//! (Werner et al. 2024) or one of its kin, until the requested share of CS_free, CG_free and CP_free is covered. All but
//! those of IRIS are found by sampling or local search: they may contain small collisions, which certification cuts
//! away.

mod anchors;
mod bridges;
mod c_iris;
mod certified_growth;
mod clique_cover;
mod coordinates;
mod cover;
mod coverage;
mod domain;
mod free_space;
mod grow;
mod grower;
mod iris;
mod iris_np;
mod iris_np2;
mod iris_zo;
mod leaf_chords;
mod max_clique;
mod nearest_collision;
mod options;
mod pair_metric;
mod pairs;
mod parallel;
mod placing;
mod problem;
mod provable;
mod regions_at;
mod sampled;
mod scene_problem;
mod seed;
mod sink;
mod streams;
mod target;
mod vertex_set;
mod visibility;

pub use cover::{Decomposition, Ending, Kept, decompose, extend};
pub use coverage::{Estimate, covered, wilson_interval};
pub use free_space::{FreeSpace, FreeWhere};
pub use grower::Method;
pub use leaf_chords::{ChordCoverage, longest_chord_coverage};
pub use options::Options;
pub use pairs::Pairs;
pub use problem::{Anchor, Problem, ProblemError};
pub use provable::{Bodies, ProvableSpace};
pub use regions_at::{Segment, parse_configuration, regions_along, regions_at};
pub use scene_problem::problem_of_scene;
pub use sink::{NoSink, Sink};
