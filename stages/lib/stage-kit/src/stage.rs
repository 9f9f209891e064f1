//! What a stage is.

use crate::host::Host;
use crate::inputs::{Input, Job};
use ipc_types::exit_code::ExitCode;
use ipc_types::stage_name::StageName;
use std::fmt::Display;

/// A stage of the pipeline.
pub trait Stage: Default {
    /// Options of the stage: `--key value` on its command line, `--set stage.key=value` of the orchestrator.
    type Options: clap::Args + serde::Serialize;

    /// Which.
    const NAME: StageName;
    /// What it does, in a line.
    const ABOUT: &'static str;
    /// What it reads of the run directory; `--help` lists it.
    const READS: &'static [Input];

    /// Does the work. What is found is handed to `host` at once; the outcome says how it ended.
    ///
    /// A process may be given several jobs (miqp after new cuts): each starts from `job` alone, and what `self` keeps
    /// between them must not change any output.
    fn run(&mut self, job: &Job, options: &Self::Options, host: &mut Host) -> Result<Outcome, StageError>;
}

/// How the work ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Done. The words say what came out.
    Done(String),
    /// A proven negative answer, and why.
    Negative(String),
    /// A limit was hit; what was handed to the host is the best known.
    Limit(String),
}

impl Outcome {
    /// How the program ends.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Outcome::Done(_) => ExitCode::Done,
            Outcome::Negative(_) => ExitCode::Negative,
            Outcome::Limit(_) => ExitCode::Limit,
        }
    }

    /// The words.
    pub fn words(&self) -> &str {
        match self {
            Outcome::Done(words) | Outcome::Negative(words) | Outcome::Limit(words) => words,
        }
    }
}

/// Why the work could not be done. The words of each fit in a line: file, field, value, remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StageError {
    /// The input is at fault (exit 2).
    #[error("{0}")]
    BadInput(String),
    /// Something broke (exit 4).
    #[error("{0}")]
    Failed(String),
    /// The stop flag was seen set (exit 130, or 3 after the time limit); what was handed to the host is kept.
    #[error("stopped before the end")]
    Stopped,
}

impl StageError {
    /// The input is at fault.
    pub fn bad_input(cause: impl Display) -> StageError {
        StageError::BadInput(cause.to_string())
    }

    /// Something broke.
    pub fn failed(cause: impl Display) -> StageError {
        StageError::Failed(cause.to_string())
    }
}
