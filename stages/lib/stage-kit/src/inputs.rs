//! What a stage reads: scene, task, and the outputs of stages before it.

use crate::stage::StageError;
use ipc_types::Digest;
use ipc_types::artefact::{CutsFile, LeafCut, PlanFile, Region, RegionsFile};
use ipc_types::store::{StoreError, find_artefact, read_artefact};
use ipc_types::validate::{self, Violation};
use scene::{CollisionPair, Scene, Task};
use std::collections::BTreeSet;
use std::path::Path;

/// A thing that a stage reads of a run directory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// `decompose/regions`: [`crate::Host::next_candidate`] gives them one by one.
    Candidates,
    /// `certify/regions` of the same candidates, if they are there: [`crate::Host::certified_versions`].
    Feedback,
    /// `certify/regions`: [`Job::regions`].
    Regions,
    /// `miqp/plan`: [`Job::plan`].
    Plan,
    /// `gcs/cuts`, if they are there: [`Job::cuts`].
    Cuts,
}

impl Input {
    /// A line of the help text.
    pub(crate) fn help(self) -> &'static str {
        match self {
            Input::Candidates => "decompose/regions.bin or .json: the candidate regions",
            Input::Feedback => {
                "decompose/regions and certify/regions, if they are there and from the same options: which candidates \
                 came back smaller"
            }
            Input::Regions => "certify/regions.bin or .json: the certified regions",
            Input::Plan => "miqp/plan.bin or .json: the grasp plan",
            Input::Cuts => "gcs/cuts.bin or .json, if they are there: leaf cuts found so far",
        }
    }
}

/// What a stage is given.
#[derive(Debug, Clone)]
pub struct Job {
    /// The scene.
    pub scene: Scene,
    /// The task; `None` only if the scene has none. `--clearance` has replaced its clearance.
    pub task: Option<Task>,
    /// Distance to keep between bodies, metres: `--clearance`, else the task's, else 0.
    pub clearance: f64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Certified regions, sorted by id; empty unless the stage reads [`Input::Regions`].
    pub regions: Vec<Region>,
    /// Grasp plan, if the stage reads [`Input::Plan`].
    pub plan: Option<PlanFile>,
    /// Leaf cuts found so far.
    pub cuts: Vec<LeafCut>,
}

impl Job {
    /// A job before its artefacts are read.
    pub(crate) fn new(scene: Scene, task: Option<Task>, clearance: Option<f64>, seed: u64) -> Job {
        let clearance = clearance.or(task.as_ref().map(|task| task.clearance)).unwrap_or(0.0);
        Job { scene, task, clearance, seed, regions: Vec::new(), plan: None, cuts: Vec::new() }
    }

    /// Distance in metres that the bodies of `pair` must keep, whether there is a task or not: 0, which is no
    /// penetration, for bodies that come into contact by design.
    pub fn required_clearance(&self, pair: CollisionPair) -> f64 {
        if self.scene.is_contact_pair(pair) { 0.0 } else { self.clearance }
    }

    /// The task, for stages that cannot work without one.
    pub fn task(&self) -> Result<&Task, StageError> {
        self.task.as_ref().ok_or_else(|| {
            StageError::BadInput(format!(
                "scene.toml of {}: has no task; add a [task.NAME] table",
                self.scene.name
            ))
        })
    }

    /// Names of the coordinates.
    pub fn coordinates(&self) -> Vec<String> {
        self.scene.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect()
    }
}

/// The scene and its task, with the clearance replaced if one is given.
pub(crate) fn load_scene(
    path: &Path,
    task: Option<&str>,
    clearance: Option<f64>,
) -> Result<(Scene, Option<Task>), StageError> {
    let scene = Scene::load(path).map_err(StageError::bad_input)?;
    let mut chosen = match task {
        None if scene.tasks.is_empty() => None,
        name => Some(scene.task(name).map_err(StageError::bad_input)?.clone()),
    };
    if let (Some(task), Some(clearance)) = (&mut chosen, clearance) {
        task.clearance = clearance;
    }
    Ok((scene, chosen))
}

/// Fills regions, plan and cuts of `job` from the run directory, as far as the stage reads them.
pub(crate) fn load_artefacts(job: &mut Job, reads: &[Input], run: &Path) -> Result<(), StageError> {
    let digest = job.scene.digest;
    if reads.contains(&Input::Regions) {
        job.regions = load_regions(job, &run.join("certify"))?;
    }
    if reads.contains(&Input::Plan) {
        let folder = run.join("miqp");
        let plan = read_artefact::<PlanFile>(&folder, "plan", Some(&digest)).map_err(of_store)?;
        validate::plan(&plan, job.scene.dim()).map_err(|rule| broken(&folder.join("plan"), &rule))?;
        job.plan = Some(plan);
    }
    if reads.contains(&Input::Cuts) {
        job.cuts = load_cuts(&run.join("gcs"), &digest, &job.regions)?;
    }
    Ok(())
}

/// The regions in `folder`, sorted by id.
pub(crate) fn load_regions(job: &Job, folder: &Path) -> Result<Vec<Region>, StageError> {
    let file = read_artefact::<RegionsFile>(folder, "regions", Some(&job.scene.digest)).map_err(of_store)?;
    validate::regions(&file, &job.coordinates()).map_err(|rule| broken(&folder.join("regions"), &rule))?;
    let mut regions = file.regions;
    regions.sort_by_key(|region| region.id);
    Ok(regions)
}

fn load_cuts(folder: &Path, digest: &Digest, regions: &[Region]) -> Result<Vec<LeafCut>, StageError> {
    let file = find_artefact::<CutsFile>(folder, "cuts", Some(digest)).map_err(of_store)?;
    let cuts = file.map_or_else(Vec::new, |file| file.cuts);
    let known: BTreeSet<u64> = regions.iter().map(|region| region.id).collect();
    for cut in &cuts {
        validate::cut(cut, &known).map_err(|rule| {
            let file = folder.join("cuts");
            StageError::BadInput(format!(
                "{}: {rule}; the cuts are of other regions, remove them",
                file.display()
            ))
        })?;
    }
    Ok(cuts)
}

/// Bad input: an artefact that is missing, damaged, or of another scene.
pub(crate) fn of_store(error: StoreError) -> StageError {
    match error {
        StoreError::Write { .. } => StageError::failed(error),
        other => StageError::bad_input(other),
    }
}

/// Bad input: an artefact that breaks its own rules.
pub(crate) fn broken(file: &Path, rule: &Violation) -> StageError {
    StageError::BadInput(format!("{}: {rule}; run the stage that wrote it again", file.display()))
}
