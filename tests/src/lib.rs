//! What needs more than one crate or a real process.
