//! What a run has produced so far, read from its directory for summary and report.

use crate::failure::Failure;
use crate::run_directory::RunDirectory;
use crate::run_record::RunRecord;
use ipc_types::artefact::{PlanFile, RegionsFile, TrajectoryFile};
use ipc_types::stage_name::StageName;
use ipc_types::status::Status;
use ipc_types::store::{find_artefact, read_json};
use std::collections::BTreeMap;

/// Everything that summary and report speak of. What the run did not reach is `None`.
#[derive(Debug, Clone)]
pub struct Results {
    /// `run.json`.
    pub record: RunRecord,
    /// Candidate regions.
    pub candidates: Option<RegionsFile>,
    /// Certified regions; with `--certify none` the candidates, marked as not certified.
    pub regions: Option<RegionsFile>,
    /// Grasp plan.
    pub plan: Option<PlanFile>,
    /// Paths.
    pub trajectory: Option<TrajectoryFile>,
    /// `status.json` of each stage that wrote one.
    pub status: BTreeMap<StageName, Status>,
}

impl Results {
    /// Reads a run directory. Folders that are missing are results that do not exist; damaged files are errors.
    pub fn read(run: &RunDirectory) -> Result<Results, Failure> {
        let record = RunRecord::read(run.path())?;
        let mut status = BTreeMap::new();
        for stage in StageName::ALL {
            let file = run.stage(stage).join("status.json");
            if file.exists() {
                status.insert(stage, read_json(&file)?);
            }
        }
        Ok(Results {
            candidates: find_artefact(&run.stage(StageName::Decompose), "regions", None)?,
            regions: find_artefact(&run.stage(StageName::Certify), "regions", None)?,
            plan: find_artefact(&run.stage(StageName::Miqp), "plan", None)?,
            trajectory: find_artefact(&run.stage(StageName::Gcs), "trajectory", None)?,
            record,
            status,
        })
    }

    /// Whether every part of the trajectory lies in certified regions. `None` without a trajectory.
    pub fn certified(&self) -> Option<bool> {
        self.trajectory.as_ref().map(|t| t.segments.iter().all(|segment| segment.certified))
    }

    /// Sum of the proven lower bounds of the segments.
    pub fn length_bound(&self) -> Option<f64> {
        self.trajectory.as_ref().map(|t| t.segments.iter().map(|segment| segment.lower_bound).sum())
    }

    /// A number among the details of a stage's `status.json`.
    pub fn detail(&self, stage: StageName, key: &str) -> Option<f64> {
        self.status.get(&stage)?.details.get(key)?.as_f64()
    }
}
