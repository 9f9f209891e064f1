//! Kinematic trees, chains between links, control maps of rotations.
