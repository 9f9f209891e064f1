//! A whole run: files, regions, plan, trajectory.

use crate::answer::{self, Answer, AnswerError};
use crate::motion::{self, MotionError};
use crate::region::{self, RegionError};
use ipc_types::artefact::{CertificatesFile, PlanFile, PlanStatus, ProofFile, RegionsFile, TrajectoryFile};
use ipc_types::container::Artefact;
use ipc_types::store::{self, StoreError};
use scene::{Scene, SceneError};
use serde::Deserialize;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a run that passed has proven.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Regions whose certificates hold.
    pub n_regions: usize,
    /// Cells of all certificates.
    pub n_cells: usize,
    /// Points of bodies proven apart by sums of squares.
    pub n_sos_points: usize,
    /// Distance that all pairs keep but those of a robot link with an object link, metres; these do not touch.
    pub clearance: f64,
    /// Grasps of the plan; `None` if the run found that there is none.
    pub n_grasps: Option<usize>,
    /// Control points of the trajectory that were located.
    pub n_control_points: usize,
    /// Largest change of a kept form along a segment.
    pub kept_residual: f64,
    /// What is proven of the number of grasps and of the cost; `None` without `miqp/proof.bin`.
    pub answer: Option<Answer>,
    /// What is claimed by the run and not verified here.
    pub not_verified: Vec<String>,
}

/// Why a run is rejected.
#[derive(Debug, thiserror::Error)]
pub enum Rejection {
    /// A file that is damaged, missing, of another version or of another scene.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The scene in the run.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// `run.json` is missing or damaged.
    #[error("{file}: {problem}; a run directory of `regrasp plan` has it")]
    Record {
        /// File.
        file: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The text twin says something else.
    #[error("{file}: it differs from its .bin twin; one of them was changed")]
    Twin {
        /// File.
        file: PathBuf,
    },
    /// The regions file itself.
    #[error("{file}: {problem}")]
    Regions {
        /// File.
        file: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// Nothing was certified.
    #[error("{file}: no region is certified; the run was made without certificates, so it proves nothing")]
    NotCertified {
        /// File.
        file: PathBuf,
    },
    /// A region is not proven free.
    #[error("certify/certificates.bin: {0}")]
    Region(#[from] RegionError),
    /// Plan or trajectory.
    #[error("miqp/plan.bin, gcs/trajectory.bin: {0}")]
    Motion(#[from] MotionError),
    /// That there are no fewer grasps, no lower cost, or no plan.
    #[error("miqp/proof.bin: {0}")]
    Answer(#[from] AnswerError),
}

/// What is read of `run.json`.
#[derive(Debug, Deserialize)]
struct Record {
    scene_digest: String,
    #[serde(default)]
    asked: Asked,
    task: Option<String>,
    #[serde(default)]
    clearance: Option<f64>,
}

/// What the run is for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Asked {
    #[default]
    Plan,
    /// Regions and their certificates, nothing after them.
    Regions,
}

/// Verifies the run in the folder `run`.
pub fn verify(run: &Path) -> Result<Verdict, Rejection> {
    let record_file = run.join("run.json");
    let bad_record = |problem: String| Rejection::Record { file: record_file.clone(), problem };
    let text = std::fs::read_to_string(&record_file).map_err(|e| bad_record(e.to_string()))?;
    let record: Record = serde_json::from_str(&text).map_err(|e| bad_record(e.to_string()))?;
    let scene = Scene::load(&run.join("scene"))?;
    if ipc_types::hexadecimal(&scene.digest) != record.scene_digest {
        return Err(bad_record(format!(
            "scene_digest is {}, but scene/ has {}",
            record.scene_digest,
            ipc_types::hexadecimal(&scene.digest)
        )));
    }
    let certify = run.join("certify");
    let regions: RegionsFile = read_both(&certify, "regions", &scene)?;
    let regions_file = certify.join("regions.bin");
    let bad_regions =
        |problem: &str| Rejection::Regions { file: regions_file.clone(), problem: problem.to_owned() };
    if regions.coordinates.iter().ne(scene.coordinates.iter().map(|c| &c.name)) {
        return Err(bad_regions("its coordinates are not the scene's"));
    }
    let mut by_id = BTreeMap::new();
    for region in &regions.regions {
        if by_id.insert(region.id, region).is_some() {
            return Err(bad_regions("a region id stands twice"));
        }
    }
    if !regions.regions.iter().any(|region| region.certified) {
        return Err(Rejection::NotCertified { file: regions_file });
    }
    let task = scene.task(record.task.as_deref()).ok();
    let clearance = record.clearance.or(task.map(|task| task.clearance)).unwrap_or(0.0);
    let certificates: CertificatesFile =
        store::read_bin(&certify.join("certificates.bin"), Some(&scene.digest))?;
    let mut by_region = BTreeMap::new();
    for certificate in &certificates.regions {
        if by_region.insert(certificate.region_id, certificate).is_some() {
            return Err(bad_regions("a region has two certificates"));
        }
    }
    let mut verdict = Verdict {
        n_regions: 0,
        n_cells: 0,
        n_sos_points: 0,
        clearance,
        n_grasps: None,
        n_control_points: 0,
        kept_residual: 0.0,
        answer: None,
        not_verified: Vec::new(),
    };
    let mut proven = BTreeMap::new();
    for region in regions.regions.iter().filter(|region| region.certified) {
        let certificate = by_region.remove(&region.id).ok_or_else(|| {
            bad_regions(&format!("region {} is certified, but has no certificate", region.id))
        })?;
        let counts = region::verify(&scene, region, certificate, clearance)?;
        verdict.n_cells += counts.cells;
        verdict.n_sos_points += counts.sos_points;
        verdict.n_regions += 1;
        proven.insert(region.id, true);
    }
    if let Some((region_id, _)) = by_region.first_key_value() {
        return Err(bad_regions(&format!(
            "there is a certificate for region {region_id}, which is not certified"
        )));
    }
    if record.asked == Asked::Regions {
        // Else a plan that is not looked at would seem to be accepted with them.
        return match ["miqp", "gcs"].into_iter().find(|stage| run.join(stage).exists()) {
            Some(stage) => Err(bad_record(format!("asked is regions, but there is {stage}/"))),
            None => Ok(verdict),
        };
    }
    let task =
        task.ok_or_else(|| bad_record("task names none of the scene, and a plan has one".to_owned()))?;
    if !run.join("miqp").join("plan.bin").exists() {
        return Err(StoreError::NotThere { folder: run.join("miqp"), name: "plan".to_owned() }.into());
    }
    let plan: PlanFile = read_both(&run.join("miqp"), "plan", &scene)?;
    verdict.n_grasps = plan.n_grasps;
    if plan.status != PlanStatus::Infeasible {
        let trajectory: TrajectoryFile = read_both(&run.join("gcs"), "trajectory", &scene)?;
        let facts = motion::verify(&scene, task, &plan, &trajectory, &by_id, &proven)?;
        verdict.n_control_points = facts.n_control_points;
        verdict.kept_residual = facts.kept_residual;
        verdict.not_verified.push("the lower bounds on the lengths of segments".to_owned());
    }
    // A program in place of miqp need not prove its answer.
    let proof_file = run.join("miqp").join("proof.bin");
    if proof_file.exists() {
        let proof: ProofFile = store::read_bin(&proof_file, Some(&scene.digest))?;
        let answer = answer::verify(task, &regions.regions, &plan, &proof)?;
        if plan.n_grasps.is_some_and(|n_grasps| answer.fewest < n_grasps) {
            verdict.not_verified.push(format!("that {} grasps do not suffice", answer.fewest));
        }
        verdict.answer = Some(answer);
    } else {
        verdict.not_verified.push(match plan.status {
            PlanStatus::Infeasible => "that there is no plan with at most as many grasps as tried".to_owned(),
            _ => "that no plan has fewer grasps or less cost".to_owned(),
        });
    }
    Ok(verdict)
}

/// Reads a `.bin`, and its `.json` twin if there is one, which must say the same.
fn read_both<A: Artefact + PartialEq>(folder: &Path, name: &str, scene: &Scene) -> Result<A, Rejection> {
    let value: A = store::read_bin(&folder.join(format!("{name}.bin")), Some(&scene.digest))?;
    let file = folder.join(format!("{name}.json"));
    if file.exists() && store::read_json::<A>(&file)? != value {
        return Err(Rejection::Twin { file });
    }
    Ok(value)
}
