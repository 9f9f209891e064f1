//! The stage: scene and task in, candidate regions out.

use crate::earlier_run::regions_of_run;
use certificates::Purpose;
use collision::{CollisionChecker, EdgeOutcome};
use decompose::{
    Anchor, Decomposition, Ending, Estimate, Options, Problem, ProblemError, ProvableSpace, Segment, Sink,
    decompose, extend, parse_configuration, problem_of_scene, regions_along, regions_at,
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
        let checker = CollisionChecker::with_clearances(&job.scene, |pair| job.required_clearance(pair));
        options.check().map_err(StageError::bad_input)?;
        let mut space = ProvableSpace::new(&job.scene, &checker);
        if options.certify_growth > 0 {
            let purpose = task.map_or_else(Purpose::default, |task| Purpose::of_task(&job.scene, task));
            space = space.with_certifier(purpose, job.seed).map_err(StageError::bad_input)?;
        }
        let mut problem = Problem { free: &space, ..problem_of_scene(&job.scene, task, &checker) };
        let named = |j: usize| job.scene.coordinates[j].name.clone();
        options.method.check(&problem, &named).map_err(StageError::bad_input)?;
        let stop = host.stop_flag();
        if options.cover {
            problem = space_to_cover(job, options, &checker, problem)?;
        } else if !options.region_at.is_empty() || !options.region_along.is_empty() {
            return single_regions(job, options, &checker, problem, host);
        }
        let field = task.map_or_else(String::new, |task| format!("task.{}", task.name));
        problem.check().map_err(|error| bad_anchor(&job.scene, &checker, &problem, &error, &field))?;
        let earlier = options.extend.as_deref().map(|run| regions_of_run(run, &job.coordinates()));
        let earlier = earlier.transpose().map_err(StageError::BadInput)?;
        let (found, kept) = {
            let _span = spans::enter("decompose.cover", 0);
            let mut sink = HostSink { host, dim: job.scene.dim() };
            let is_stopped = || stop.is_set();
            match &earlier {
                Some(earlier) => {
                    let (found, kept) = extend(&problem, earlier, options, job.seed, &mut sink, &is_stopped)?;
                    (found, Some(kept))
                }
                None => (decompose(&problem, options, job.seed, &mut sink, &is_stopped)?, None),
            }
        };
        if let Some(kept) = kept {
            host.detail("earlier_regions_free", kept.n_free);
            host.detail("earlier_regions_cut", kept.n_cut);
            host.detail("earlier_regions_lost", kept.n_lost);
        }
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

/// What `--cover` asks for: the space without the task, or the part of it in a box around one free configuration.
fn space_to_cover<'a>(
    job: &Job,
    options: &Options,
    checker: &CollisionChecker,
    problem: Problem<'a>,
) -> Result<Problem<'a>, StageError> {
    let problem = problem.without_task();
    let (text, radius) = match options.region_at.as_slice() {
        _ if !options.region_along.is_empty() => {
            return Err(StageError::bad_input("options cover and region-along: give one of them"));
        }
        [] => return Ok(problem),
        [text] if options.domain_radius > 0.0 => (text, options.domain_radius),
        _ => {
            let expected = "one region-at with a positive domain-radius, or none";
            return Err(StageError::bad_input(format!("option cover: expected {expected}")));
        }
    };
    let q = parse_configuration(text, job.scene.dim()).map_err(StageError::bad_input)?;
    let middle = Problem { anchors: vec![Anchor { name: text.clone(), q: q.clone() }], ..problem.clone() };
    middle.check().map_err(|error| bad_anchor(&job.scene, checker, &middle, &error, "--region-at"))?;
    Ok(problem.within(&q, radius))
}

/// The regions of `--region-at` or `--region-along`.
fn single_regions(
    job: &Job,
    options: &Options,
    checker: &CollisionChecker,
    mut problem: Problem<'_>,
    host: &mut Host,
) -> Result<Outcome, StageError> {
    let (n, stop) = (job.scene.dim(), host.stop_flag());
    let is_stopped = || stop.is_set();
    let anchor = |text: &String| Ok(Anchor { name: text.clone(), q: parse_configuration(text, n)? });
    let anchors: Result<Vec<Anchor>, ProblemError> = options.region_at.iter().map(anchor).collect();
    let segments: Result<Vec<Segment>, ProblemError> =
        options.region_along.iter().map(|text| Segment::parse(text, n)).collect();
    problem.anchors = anchors.map_err(StageError::bad_input)?;
    let segments = segments.map_err(StageError::bad_input)?;
    if !problem.anchors.is_empty() && !segments.is_empty() {
        return Err(StageError::bad_input("options region-at and region-along: give one of them"));
    }
    let mut ends =
        Problem { anchors: segments.iter().flat_map(Segment::anchors).collect(), ..problem.clone() };
    let (field, given) = match segments.is_empty() {
        true => ("--region-at", &mut problem),
        false => ("--region-along", &mut ends),
    };
    given.check().map_err(|error| bad_anchor(&job.scene, checker, given, &error, field))?;
    for segment in &segments {
        segment_is_free(&job.scene, checker, segment).map_err(StageError::bad_input)?;
    }
    let mut sink = HostSink { host, dim: n };
    let (regions, n_given) = match segments.is_empty() {
        true => {
            let regions = regions_at(&problem, options, job.seed, &mut sink, &is_stopped)?;
            (regions, format!("{} configurations", problem.anchors.len()))
        }
        false => {
            let regions = regions_along(&problem, &segments, options, job.seed, &mut sink, &is_stopped)?;
            (regions, format!("{} segments", segments.len()))
        }
    };
    host.check_stop()?;
    Ok(Outcome::Done(format!("{} regions around {n_given}", regions.len())))
}

/// Whether a segment is free all along; otherwise where it is not.
fn segment_is_free(scene: &Scene, checker: &CollisionChecker, segment: &Segment) -> Result<(), ProblemError> {
    let [end_0, end_1] = &segment.ends;
    let reason = match checker.edge_is_free(end_0.as_slice(), end_1.as_slice()) {
        EdgeOutcome::Free => return Ok(()),
        EdgeOutcome::Colliding { t, pair } => format!(
            "{} and {} are in collision at {t} of its length; go around",
            scene.bodies[pair.body_a].name, scene.bodies[pair.body_b].name
        ),
        EdgeOutcome::Undecided => "it touches an obstacle, or nearly so; keep away from it".to_owned(),
    };
    Err(ProblemError::SegmentNotFree { name: segment.name.clone(), reason })
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
