//! Convex regions of the collision-free configuration space.
