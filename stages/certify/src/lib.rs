//! The stage that certifies: candidates in, certified regions out, and paths of any planner.
//!
//! How things are certified is in the library `certificates`.

// `!(x > 0.0)` refuses what is not a number as well, which `x <= 0.0` would let pass.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

pub mod acceptance;
pub mod grow_command;
pub mod path_command;
mod stage;

pub use stage::{CERTIFIED_ID_OFFSET, CertifyStage};
