//! The independent verifier of a run.
