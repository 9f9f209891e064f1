//! The process layer: starts the stages, feeds them, watches them, and joins what they found.
//!
//! [`run_stages`] runs all stages at once over channels; [`run_stage`] runs one stage alone on the files of a run.

mod alone;
mod certified;
mod child;
mod hub;
mod interrupt;
mod run;
mod slot;
mod stage_command;
mod work_queue;

pub use alone::run_stage;
pub use hub::clean_dead;

use crate::cli::CertifyMethod;
use crate::failure::{ExitCode, Failure};
use crate::run_directory::RunDirectory;
use crate::run_record::{Acceptance, Asked, StageRecord};
use crate::stage::{Stage, StageCommands, StageOptions};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What a run is asked.
#[derive(Debug, Clone)]
pub struct RunRequest {
    /// Scene folder or its `scene.toml`.
    pub scene: PathBuf,
    /// What it is for: which stages run.
    pub asked: Asked,
    /// Task; a single one needs no choice.
    pub task: Option<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Certification workers, at least 1.
    pub workers: u32,
    /// How regions are certified.
    pub certify: CertifyMethod,
    /// Distance to keep between bodies, metres; `None`: the task's.
    pub clearance: Option<f64>,
    /// Options of the stages (`--coverage`, `--max-grasps` are put here by the command line).
    pub options: StageOptions,
    /// Commands that replace stages.
    pub commands: StageCommands,
    /// The run is stopped after this time with exit code 3.
    pub time_limit: Option<Duration>,
}

/// How a run ended. The artefacts, `status.json`, `spans.jsonl` and `log.txt` of each stage lie in its folder.
#[derive(Debug, Clone, PartialEq)]
pub struct PipelineOutcome {
    /// Done, Negative, Limit or Interrupted.
    pub exit_code: ExitCode,
    /// Why, in words.
    pub message: String,
    /// What each stage cost, in order.
    pub stages: Vec<StageRecord>,
    /// Acceptance check; `None` if it was not reached.
    pub acceptance: Option<Acceptance>,
    /// Digest of the scene, hexadecimal; empty if no stage read it.
    pub scene_digest: String,
    /// Pairs of links that the scene leaves out of collision.
    pub excluded_pairs: Vec<String>,
}

/// What a user watches. Called from the thread that runs the pipeline, some ten times a second at most.
pub trait ProgressSink {
    /// The newest state of a stage.
    fn progress(&mut self, progress: &StageProgress);
}

/// The newest state of one stage.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageProgress {
    /// Which; `None` before a stage exists.
    pub stage: Option<Stage>,
    /// Units done: regions found, regions certified, ℓ tried, segments found.
    pub done: u64,
    /// Units in all, 0 if not known.
    pub total: u64,
    /// The figure that matters: coverage, certified share of the volume, gap, length.
    pub value: f64,
    /// A few words.
    pub message: String,
    /// Whether the stage has ended.
    pub finished: bool,
}

/// One stage alone, in file mode.
#[derive(Debug, Clone)]
pub struct StageRequest {
    /// Which.
    pub stage: Stage,
    /// Scene folder or its `scene.toml`.
    pub scene: PathBuf,
    /// Task.
    pub task: Option<String>,
    /// Seed.
    pub seed: u64,
    /// Distance to keep between bodies, metres; `None`: the task's.
    pub clearance: Option<f64>,
    /// How regions are certified.
    pub certify: CertifyMethod,
    /// Run directory that the stage reads.
    pub input: PathBuf,
    /// Folder that the stage writes.
    pub output: PathBuf,
    /// Options of the stages.
    pub options: StageOptions,
    /// Commands that replace stages.
    pub commands: StageCommands,
    /// Stopped after this time with exit code 3.
    pub time_limit: Option<Duration>,
}

/// All stages that are needed at once, the artefacts in `run`. `Err` is bad input (exit 2) or a stage that failed (exit 4). When
/// this returns, no process and no shared memory of the run is left.
pub fn run_stages(
    request: &RunRequest,
    run: &RunDirectory,
    sink: &mut dyn ProgressSink,
) -> Result<PipelineOutcome, Failure> {
    // What dead runs left must not fill the memory; that it cannot be removed is no reason not to run.
    let _ = clean_dead(false);
    run::Run::start(request, run, sink)?.finish()
}

/// The acceptance check of a run (`regrasp-certify accept`), also for `regrasp rerun`.
pub fn accept(
    scene: &Path,
    task: Option<&str>,
    clearance: Option<f64>,
    run: &RunDirectory,
) -> Result<Acceptance, Failure> {
    alone::accept(scene, task, clearance, run, &interrupt::Watch::begin(None)?)
}
