//! Shortest transit and transfer paths in graphs of convex sets.
fn main() {}
