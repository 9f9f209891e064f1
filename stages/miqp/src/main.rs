//! Fewest grasps: mixed-integer quadratic programme.
fn main() {}
