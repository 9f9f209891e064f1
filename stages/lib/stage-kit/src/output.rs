//! What a stage has found, and the files it becomes.

use crate::inputs::Job;
use crate::stage::StageError;
use ipc_types::artefact::{
    Coverage, CutsFile, LeafCut, PlanFile, ProofFile, Region, RegionsFile, Segment, TrajectoryFile,
};
use ipc_types::container::CertifiedPart;
use ipc_types::join::write_certified;
use ipc_types::stage_name::StageName;
use ipc_types::store::{write_artefact, write_at_once, write_bin};
use std::collections::BTreeMap;
use std::path::Path;

/// What a stage has found so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Output {
    pub candidates: BTreeMap<u64, Region>,
    pub coverage: Option<Coverage>,
    pub certified: BTreeMap<u64, CertifiedPart>,
    pub plan: Option<PlanFile>,
    pub proof: Option<ProofFile>,
    pub segments: BTreeMap<u64, Segment>,
    pub cuts: Vec<LeafCut>,
    pub solver_calls: u64,
    pub details: BTreeMap<String, serde_json::Value>,
}

impl Output {
    /// Writes the files of `stage` to its folder. Nothing in them depends on time, machine or process.
    pub(crate) fn write(&self, stage: StageName, job: &Job, folder: &Path) -> Result<(), StageError> {
        let digest = &job.scene.digest;
        let write = || match stage {
            StageName::Decompose => {
                let regions = self.candidates.values().cloned().collect();
                let file =
                    RegionsFile { coordinates: job.coordinates(), regions, coverage: self.coverage.clone() };
                write_artefact(folder, "regions", &file, digest)
            }
            StageName::Certify => write_certified(folder, job.coordinates(), self.certified.values(), digest),
            StageName::Miqp => match &self.plan {
                Some(plan) => {
                    if let Some(proof) = &self.proof {
                        write_bin(folder, "proof", proof, digest)?;
                    }
                    write_artefact(folder, "plan", plan, digest)
                }
                None => Ok(()),
            },
            StageName::Gcs => {
                write_artefact(folder, "cuts", &CutsFile { cuts: self.all_cuts(job) }, digest)?;
                match self.trajectory(job) {
                    Some(trajectory) => {
                        write_artefact(folder, "trajectory", &trajectory, digest)?;
                        write_at_once(&folder.join("trajectory.csv"), trajectory.csv().as_bytes())
                    }
                    None => Ok(()),
                }
            }
        };
        write().map_err(StageError::failed)
    }

    /// The cuts of earlier rounds, then the new ones.
    pub(crate) fn all_cuts(&self, job: &Job) -> Vec<LeafCut> {
        let mut cuts = job.cuts.clone();
        for cut in &self.cuts {
            if !cuts.contains(cut) {
                cuts.push(cut.clone());
            }
        }
        cuts
    }

    /// The motion, if every segment of the plan has a path (thesis 2, eq. 5.9).
    fn trajectory(&self, job: &Job) -> Option<TrajectoryFile> {
        let plan = job.plan.as_ref()?;
        let n_segments = plan.modes.as_ref()?.len();
        if self.segments.len() != n_segments
            || !(0..n_segments as u64).all(|i| self.segments.contains_key(&i))
        {
            return None;
        }
        let segments: Vec<Segment> = self.segments.values().cloned().collect();
        let length = segments.iter().map(|segment| segment.length).sum();
        Some(TrajectoryFile { coordinates: job.coordinates(), segments, length, duration: length })
    }
}
