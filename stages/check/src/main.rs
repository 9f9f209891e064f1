//! The independent verifier of a run.
fn main() {}
