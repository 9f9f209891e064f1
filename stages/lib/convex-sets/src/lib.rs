//! Convex sets of C-space and operations on them.

mod hpolyhedron;

pub use hpolyhedron::HPolyhedron;
