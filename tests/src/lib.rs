//! What needs more than one crate or a real process: finding and running the programs, and sampling without them.

pub mod attack;
pub mod judge;
pub mod polytope_samples;
pub mod programs;
pub mod scenes;
pub mod transfers;
