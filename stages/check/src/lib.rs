//! The independent verifier of a run: shares no geometry code with the planner.

// `!(a > b)` is meant: a NaN must fail, never pass.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod answer;
pub mod body;
pub mod cells;
pub mod chain;
pub mod corners;
pub mod exact;
pub mod interval;
pub mod motion;
mod net;
pub mod pairs;
mod parallel;
pub mod path;
pub mod region;
pub mod run;
pub mod sos;
pub mod swept;
