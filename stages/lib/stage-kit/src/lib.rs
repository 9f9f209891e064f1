//! Harness of a stage: command line, files, channels, progress, spans, exit codes.
//!
//! A stage is one implementation of [`Stage`] and a `main` of one line, `stage_kit::main::<MyStage>()`. The same
//! [`Stage::run`] serves files (`run`), channels (`serve`) and tests; what it finds on the way it hands to [`Host`].

mod channel_carrier;
mod command_line;
mod file_mode;
mod host;
mod inputs;
mod output;
mod process;
mod serve;
pub mod spans;
mod stage;
mod work;

pub use command_line::{NoCommand, main, main_with};
pub use host::Host;
pub use inputs::{Input, Job};
pub use ipc_types::stage_name::StageName;
pub use process::{Stop, StopFlag};
pub use stage::{Outcome, Stage, StageError};
