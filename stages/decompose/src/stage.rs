//! The stage: scene and task in, candidate regions out.

use collision::CollisionChecker;
use decompose::{
    Anchor, Decomposition, Ending, Estimate, Options, Problem, ProblemError, Sink, decompose,
    parse_configuration, problem_of_scene, regions_at,
};
use ipc_types::artefact::{self, Coverage};
use scene::Scene;
use stage_kit::{Host, Input, Job, Outcome, Stage, StageError, StageName, spans};
use wire::Region;

/// `regrasp-decompose`.
#[derive(Debug, Default)]
pub struct DecomposeStage;

impl Stage for DecomposeStage {
    type Options = Options;

    const NAME: StageName = StageName::Decompose;
    const ABOUT: &'static str = "Convex regions of the collision-free configuration space";
    const READS: &'static [Input] = &[Input::Feedback];

    fn run(&mut self, job: &Job, options: &Options, host: &mut Host) -> Result<Outcome, StageError> {
        let task = job.task.as_ref();
        let checker = match task {
            Some(task) => CollisionChecker::for_task(&job.scene, task),
            None => CollisionChecker::new(&job.scene),
        };
        options.check().map_err(StageError::bad_input)?;
        let mut problem = problem_of_scene(&job.scene, task, &checker);
        let stop = host.stop_flag();
        if !options.region_at.is_empty() {
            problem.anchors = given_anchors(options, job.scene.dim()).map_err(StageError::bad_input)?;
            let bad = |error| bad_anchor(&job.scene, &checker, &problem, &error, "--region-at");
            problem.check().map_err(bad)?;
            let mut sink = HostSink { host, dim: job.scene.dim() };
            let regions = regions_at(&problem, options, job.seed, &mut sink, &|| stop.is_set())?;
            host.check_stop()?;
            let (n, n_given) = (regions.len(), problem.anchors.len());
            return Ok(Outcome::Done(format!("{n} regions around {n_given} configurations")));
        }
        let field = task.map_or_else(String::new, |task| format!("task.{}", task.name));
        problem.check().map_err(|error| bad_anchor(&job.scene, &checker, &problem, &error, &field))?;
        let found = {
            let _span = spans::enter("decompose.cover", 0);
            let mut sink = HostSink { host, dim: job.scene.dim() };
            decompose(&problem, options, job.seed, &mut sink, &|| stop.is_set())?
        };
        host.coverage(Coverage {
            total: share(found.total),
            grasp: found.grasp.map(share),
            placement: found.placement.map(share),
        });
        for (set, estimate) in &found.certified {
            host.detail(&format!("certified_{set}"), [estimate.value, estimate.low, estimate.high]);
        }
        if let Some(chord) = &found.chord {
            host.detail("longest_chord_covered", chord.share());
        }
        outcome(&found)
    }
}

fn outcome(found: &Decomposition) -> Result<Outcome, StageError> {
    let n = found.regions.len();
    match &found.ending {
        Ending::Covered => {
            Ok(Outcome::Done(format!("{n} regions cover {:.4} of CS_free", found.total.value)))
        }
        Ending::Short(words) => Ok(Outcome::Limit(format!("{n} regions; {words}"))),
        Ending::NowhereFree { set, n_samples } => {
            Ok(Outcome::Negative(format!("{set}: none of {n_samples} samples is free of collision")))
        }
        Ending::Stopped => Err(StageError::Stopped),
    }
}

/// The configurations of `--region-at`.
fn given_anchors(options: &Options, n: usize) -> Result<Vec<Anchor>, ProblemError> {
    let anchor = |text: &String| Ok(Anchor { name: text.clone(), q: parse_configuration(text, n)? });
    options.region_at.iter().map(anchor).collect()
}

/// A configuration that is not free: which, the pair of bodies, and what to do.
fn bad_anchor(
    scene: &Scene,
    checker: &CollisionChecker,
    problem: &Problem<'_>,
    error: &ProblemError,
    field: &str,
) -> StageError {
    let ProblemError::NotFree { name } = error else {
        return StageError::BadInput(format!("scene.toml of {}: {field}: {error}", scene.name));
    };
    let anchor = problem.anchors.iter().find(|anchor| anchor.name == *name);
    let value = anchor.map_or_else(String::new, |anchor| format!(" = {:?}", anchor.q.as_slice()));
    let pair = anchor.and_then(|anchor| checker.colliding_pair(anchor.q.as_slice()));
    let pair = pair.map_or_else(String::new, |pair| {
        format!(
            ": {} and {} are in collision",
            scene.bodies[pair.body_a].name, scene.bodies[pair.body_b].name
        )
    });
    StageError::BadInput(format!(
        "scene.toml of {}: {field}.{name}{value}{pair}; move it, or lower the clearance",
        scene.name
    ))
}

fn share(estimate: Estimate) -> artefact::Estimate {
    artefact::Estimate(estimate.value, estimate.low, estimate.high)
}

/// Passes regions on as they are found, and asks what certification made of them.
struct HostSink<'a, 'b> {
    host: &'a mut Host<'b>,
    dim: usize,
}

impl Sink for HostSink<'_, '_> {
    type Error = StageError;

    fn region(&mut self, region: &Region) -> Result<(), StageError> {
        self.host.candidate(region.to_artefact())
    }

    fn progress(&mut self, n_regions: usize, coverage: f64, message: &str) {
        self.host.progress(n_regions as u64, 0, coverage, message);
    }

    fn certified(&mut self, ids: &[u64]) -> Result<Option<Vec<Region>>, StageError> {
        let Some(regions) = self.host.certified_versions(ids)? else { return Ok(None) };
        let regions = regions.iter().map(|region| Region::from_artefact(region, self.dim));
        regions.collect::<Result<_, _>>().map(Some).map_err(StageError::failed)
    }
}
