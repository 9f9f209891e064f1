//! The contract between the processes of regrasp: artefact formats and message layouts. No algorithm, no solver.

pub mod artefact;
