//! Launches, feeds, watches and records the stages.
fn main() {}
