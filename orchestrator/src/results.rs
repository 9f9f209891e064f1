//! What a run has produced so far, read from its directory for summary and report.

use crate::cli::CertifyMethod;
use crate::failure::Failure;
use crate::run_directory::RunDirectory;
use crate::run_record::RunRecord;
use ipc_types::artefact::{Coverage, Estimate, PlanFile, RegionsFile, TrajectoryFile};
use ipc_types::stage_name::StageName;
use ipc_types::status::Status;
use ipc_types::store::{find_artefact, read_json};
use serde_json::Value;
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
    /// Whether `miqp/proof.bin` is there: the evidence for the answer, which `regrasp check` replays.
    pub has_proof: bool,
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
            has_proof: run.stage(StageName::Miqp).join("proof.bin").is_file(),
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

    /// Coverage of the certified regions: as `certify/regions.json` says, else as decompose measured it on what came
    /// back to it. `None` where nobody measured it.
    pub fn certified_coverage(&self) -> Option<Coverage> {
        let said = self.regions.as_ref().and_then(|file| file.coverage.clone());
        let certified = self.record.certify != CertifyMethod::None;
        said.filter(|_| certified).or_else(|| {
            let measured = |key: &str| -> Option<Estimate> {
                let value = self.detail(StageName::Decompose, key)?;
                serde_json::from_value(value.clone()).ok()
            };
            Some(Coverage {
                total: measured("certified_CS_free").filter(|_| certified)?,
                grasp: measured("certified_CG_free"),
                placement: measured("certified_CP_free"),
            })
        })
    }

    /// Shares of their volume that the candidates kept in certification, as certify measured them.
    pub fn volumes_kept(&self) -> Vec<f64> {
        let list = self.detail(StageName::Certify, "candidates").and_then(Value::as_array);
        list.into_iter().flatten().filter_map(|one| one.get("volume_kept")?.as_f64()).collect()
    }

    /// Time that miqp took for one number of grasps, seconds.
    pub fn seconds_for(&self, n_grasps: usize) -> Option<f64> {
        let pairs: Vec<(usize, f64)> =
            serde_json::from_value(self.detail(StageName::Miqp, "seconds_per_n_grasps")?.clone()).ok()?;
        pairs.into_iter().find(|(n, _)| *n == n_grasps).map(|(_, seconds)| seconds)
    }

    /// One of the details of a stage's `status.json`.
    fn detail(&self, stage: StageName, key: &str) -> Option<&Value> {
        self.status.get(&stage)?.details.get(key)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::run_record::tests::example as record;
    use ipc_types::artefact::{Mode, PlanStatus, Region, Segment, Tried, TriedStatus};

    /// A small finished run with one certified transfer.
    pub(crate) fn example() -> Results {
        let region = Region {
            id: 1,
            parent: Some(0),
            A: vec![vec![1.0, 0.0], vec![-1.0, 0.0], vec![0.0, 1.0], vec![0.0, -1.0]],
            b: vec![1.0; 4],
            center: vec![0.0, 0.0],
            method: "iris-zo".into(),
            certified: true,
            margin: 0.0,
        };
        let coordinates = vec!["cap".to_string(), "<finger>".to_string()];
        let segment = |mode, from: [f64; 2], to: [f64; 2]| Segment {
            mode,
            pieces: vec![vec![from.to_vec(), to.to_vec()]],
            regions: vec![1],
            length: 1.0,
            lower_bound: 0.9,
            certified: true,
        };
        let segments = vec![
            segment(Mode::Transit, [0.0, 0.0], [0.0, 0.5]),
            segment(Mode::Transfer, [0.0, 0.5], [1.0, 0.5]),
            segment(Mode::Transit, [1.0, 0.5], [1.0, 0.0]),
        ];
        let one = Tried {
            n_grasps: 1,
            status: TriedStatus::Optimal,
            reason: String::new(),
            cost: Some(1.5),
            lower_bound: Some(1.5),
            nodes: 3,
        };
        let regions = RegionsFile { coordinates: coordinates.clone(), regions: vec![region], coverage: None };
        Results {
            record: record(),
            candidates: Some(regions.clone()),
            regions: Some(regions),
            plan: Some(PlanFile {
                status: PlanStatus::Optimal,
                n_grasps: Some(1),
                configurations: None,
                regions: None,
                modes: None,
                cost: Some(1.5),
                lower_bound: Some(1.5),
                tried: vec![one],
            }),
            has_proof: true,
            trajectory: Some(TrajectoryFile { coordinates, segments, length: 3.0, duration: 3.0 }),
            status: BTreeMap::new(),
        }
    }

    #[test]
    fn one_open_segment_leaves_the_plan_uncertified() {
        let mut results = example();
        assert_eq!(results.certified(), Some(true));
        if let Some(trajectory) = &mut results.trajectory {
            trajectory.segments[1].certified = false;
        }
        assert_eq!(results.certified(), Some(false));
        results.trajectory = None;
        assert_eq!(results.certified(), None);
    }

    #[test]
    fn a_run_that_stopped_early_is_read_as_far_as_it_went() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create_at(&folder.path().join("run")).unwrap();
        record().write(run.path()).unwrap();
        let results = Results::read(&run).unwrap();
        assert!(results.plan.is_none() && results.status.is_empty());
        std::fs::create_dir(run.stage(StageName::Miqp)).unwrap();
        std::fs::write(run.stage(StageName::Miqp).join("plan.json"), "{").unwrap();
        assert_eq!(Results::read(&run).unwrap_err().exit_code.code(), 2);
    }
}
