//! `run.json`: what a run was asked, with which programs, how it ended, and what each stage cost.

use crate::cli::CertifyMethod;
use crate::failure::Failure;
use crate::stage::{StageCommands, StageOptions};
use ipc_types::stage_name::StageName;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Format of `run.json`.
pub const RUN_FORMAT: u32 = 1;

/// The whole of `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// [`RUN_FORMAT`].
    pub format: u32,
    /// Version of `regrasp`.
    pub version: String,
    /// Where the scene was read from.
    pub scene: String,
    /// BLAKE3 of the files of the scene, hexadecimal; empty until a stage has read them.
    pub scene_digest: String,
    /// What was asked for.
    #[serde(default)]
    pub asked: Asked,
    /// Task, if one was chosen.
    pub task: Option<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Certification workers.
    pub workers: u32,
    /// How regions are certified.
    pub certify: CertifyMethod,
    /// Distance to keep between bodies, metres; `None` (null): the task's.
    pub clearance: Option<f64>,
    /// Options that were set, by stage.
    pub options: StageOptions,
    /// Commands that replaced stages.
    pub commands: StageCommands,
    /// Pairs of links that the scene leaves out of collision.
    pub excluded_pairs: Vec<String>,
    /// How it ended.
    pub outcome: Outcome,
    /// Wall-clock time of the whole run, seconds.
    pub seconds: f64,
    /// Stages in order.
    pub stages: Vec<StageRecord>,
    /// Outcome of the acceptance check; `None` (null) if it was not reached.
    pub acceptance: Option<Acceptance>,
}

/// What a run is for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Asked {
    /// A plan and its paths: all stages.
    #[default]
    Plan,
    /// Regions and their certificates, nothing after them.
    Regions,
}

impl Asked {
    /// The last stage that such a run needs.
    pub fn last_stage(self) -> StageName {
        match self {
            Asked::Plan => StageName::Gcs,
            Asked::Regions => StageName::Certify,
        }
    }
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// Exit code of the run.
    pub exit_code: i32,
    /// Why, in words.
    pub message: String,
}

impl From<&Failure> for Outcome {
    fn from(failure: &Failure) -> Outcome {
        Outcome { exit_code: failure.exit_code.code(), message: failure.message.clone() }
    }
}

/// What one stage cost. All processes of the stage together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageRecord {
    /// Which.
    pub stage: StageName,
    /// Command that ran, words joined by spaces.
    pub command: String,
    /// Number of processes.
    pub processes: u32,
    /// Exit code; the worst of several processes; negative is the signal that ended it.
    pub exit_code: i32,
    /// From first start to last end, seconds.
    pub seconds: f64,
    /// User and system time of all processes, seconds.
    pub cpu_seconds: f64,
    /// Largest resident memory of a process, bytes.
    pub peak_bytes: u64,
    /// An earlier stage was run again since.
    pub stale: bool,
}

/// Outcome of the acceptance check of plan and trajectory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Acceptance {
    /// Whether everything held.
    pub accepted: bool,
    /// What was checked, or what failed, one line each.
    pub lines: Vec<String>,
}

impl RunRecord {
    /// Reads `run.json` of a run directory.
    pub fn read(run: &Path) -> Result<RunRecord, Failure> {
        let path = run.join("run.json");
        let text = std::fs::read_to_string(&path).map_err(|cause| {
            Failure::bad_input(format!(
                "{}: {cause}; expected a run directory, such as runs/bottle-cap-3dof/0001",
                path.display()
            ))
        })?;
        let record: RunRecord = serde_json::from_str(&text).map_err(|cause| {
            Failure::bad_input(format!(
                "{}: {cause}; the file is damaged or of another version",
                path.display()
            ))
        })?;
        if record.format != RUN_FORMAT {
            return Err(Failure::bad_input(format!(
                "{}: format {} is not known; this regrasp reads format {RUN_FORMAT}",
                path.display(),
                record.format
            )));
        }
        Ok(record)
    }

    /// Writes `run.json` of a run directory, at once.
    pub fn write(&self, run: &Path) -> Result<(), Failure> {
        ipc_types::store::write_json(run, "run", self).map_err(Failure::from)
    }

    /// Puts the record of a stage in its place.
    pub fn put_stage(&mut self, record: StageRecord) {
        self.stages.retain(|other| other.stage != record.stage);
        self.stages.push(record);
        self.stages.sort_by_key(|record| record.stage);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use ipc_types::exit_code::ExitCode;

    /// A record of a small run, for the tests of other files too.
    pub(crate) fn example() -> RunRecord {
        RunRecord {
            format: RUN_FORMAT,
            version: "0.1.0".into(),
            scene: "scenes/x".into(),
            scene_digest: "00".into(),
            asked: Asked::Plan,
            task: None,
            seed: 3,
            workers: 2,
            certify: CertifyMethod::Swept,
            clearance: None,
            options: StageOptions::default(),
            commands: StageCommands::default(),
            excluded_pairs: vec!["a / b".into()],
            outcome: Outcome { exit_code: 0, message: "10 grasps".into() },
            seconds: 1.5,
            stages: vec![StageRecord {
                stage: StageName::Miqp,
                command: "regrasp-miqp".into(),
                processes: 1,
                exit_code: 0,
                seconds: 0.5,
                cpu_seconds: 0.4,
                peak_bytes: 1 << 20,
                stale: false,
            }],
            acceptance: None,
        }
    }

    #[test]
    fn a_record_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let record = example();
        record.write(folder.path()).unwrap();
        assert_eq!(RunRecord::read(folder.path()).unwrap(), record);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_is_no_run_is_bad_input() {
        let folder = tempfile::tempdir().unwrap();
        let failure = RunRecord::read(folder.path()).unwrap_err();
        assert_eq!(failure.exit_code, ExitCode::BadInput);
        assert!(failure.message.contains("run.json"));
        std::fs::write(folder.path().join("run.json"), "{\"format\": 1}").unwrap();
        assert_eq!(RunRecord::read(folder.path()).unwrap_err().exit_code, ExitCode::BadInput);
    }

    #[test]
    fn stages_stay_in_order() {
        let mut record = example();
        let mut first = record.stages[0].clone();
        first.stage = StageName::Decompose;
        record.put_stage(first.clone());
        record.put_stage(first);
        assert_eq!(
            record.stages.iter().map(|s| s.stage).collect::<Vec<_>>(),
            [StageName::Decompose, StageName::Miqp]
        );
    }
}
