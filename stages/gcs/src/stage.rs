//! The stage: regions and plan in, paths or cuts out.

use crate::options::Options;
use crate::plan_paths::{PathsOutcome, Regions, Sink, plan_paths};
use crate::search::Found;
use ipc_types::artefact::{LeafCut, Segment};
use manipulation::Manipulation;
use stage_kit::{Host, Input, Job, Outcome, Stage, StageError, StageName, spans};

/// `regrasp-gcs`.
#[derive(Debug, Default)]
pub struct GcsStage;

impl Stage for GcsStage {
    type Options = Options;

    const NAME: StageName = StageName::Gcs;
    const ABOUT: &'static str =
        "Shortest transit and transfer paths of a grasp plan, in graphs of convex sets";
    const READS: &'static [Input] = &[Input::Regions, Input::Plan, Input::Cuts];

    fn run(&mut self, job: &Job, options: &Options, host: &mut Host) -> Result<Outcome, StageError> {
        let task = job.task()?;
        let Some(plan) = &job.plan else {
            return Err(StageError::BadInput("miqp/plan: there is no plan; run miqp first".into()));
        };
        let mut polytopes = Vec::with_capacity(job.regions.len());
        for region in &job.regions {
            let region =
                wire::Region::from_artefact(region, job.scene.dim()).map_err(StageError::bad_input)?;
            polytopes.push(region.polyhedron);
        }
        let manipulation = {
            let _span = spans::enter("gcs.regions", polytopes.len() as u64);
            Manipulation::new(&job.scene, task, &polytopes).map_err(StageError::bad_input)?
        };
        host.check_stop()?;
        let ids: Vec<u64> = job.regions.iter().map(|region| region.id).collect();
        let certified: Vec<bool> = job.regions.iter().map(|region| region.certified).collect();
        let coordinates = job.coordinates();
        let regions = Regions {
            manipulation: &manipulation,
            ids: &ids,
            certified: &certified,
            coordinates: &coordinates,
        };
        let stop = host.stop_flag();
        let n_segments = plan.modes.as_ref().map_or(0, Vec::len) as u64;
        let mut sink = HostSink { host, n_segments, length: 0.0, n_relaxations: 0, failure: None };
        let outcome = plan_paths(regions, plan, options, job.seed, &mut sink, &|| stop.is_set())
            .map_err(StageError::bad_input)?;
        let (n_relaxations, failure) = (sink.n_relaxations, sink.failure);
        host.solver_calls(n_relaxations);
        if let Some(failure) = failure {
            return Err(failure);
        }
        match outcome {
            PathsOutcome::Found(trajectory) => {
                let lower_bound: f64 = trajectory.segments.iter().map(|segment| segment.lower_bound).sum();
                host.detail("gap", trajectory.length - lower_bound);
                let (n, length) = (trajectory.segments.len(), trajectory.length);
                Ok(Outcome::Done(format!("{n} segments, length {length:.4}, at least {lower_bound:.4}")))
            }
            PathsOutcome::NoPath(cuts) => Ok(Outcome::Negative(format!(
                "the plan has segments without a path in their leaf; {} leaf cuts exclude them",
                cuts.len()
            ))),
            PathsOutcome::Undecided { segment_idx, reason } => {
                Ok(Outcome::Limit(format!("segment {segment_idx} has neither a path nor a proof: {reason}")))
            }
            PathsOutcome::NoPlan => Ok(Outcome::Negative("there is no plan to find paths for".into())),
            PathsOutcome::Cancelled => Err(StageError::Stopped),
        }
    }
}

/// Passes on what is found; after a failure nothing more.
struct HostSink<'a, 'b> {
    host: &'a mut Host<'b>,
    n_segments: u64,
    length: f64,
    n_relaxations: u64,
    failure: Option<StageError>,
}

impl HostSink<'_, '_> {
    fn keep_failure(&mut self, result: Result<(), StageError>) {
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
        }
    }
}

impl Sink for HostSink<'_, '_> {
    fn segment(&mut self, segment_idx: usize, segment: &Segment, found: &Found) {
        self.length += segment.length;
        self.n_relaxations += found.n_relaxations as u64;
        let result = self.host.segment(segment_idx, segment.clone());
        self.keep_failure(result);
        let message = format!("{} in {} pieces", segment.mode.word(), segment.pieces.len());
        self.host.progress(segment_idx as u64 + 1, self.n_segments, self.length, &message);
    }

    fn cut(&mut self, segment_idx: usize, cut: &LeafCut) {
        let result = self.host.cut(cut.clone());
        self.keep_failure(result);
        let message = format!("segment {segment_idx} has no path in its leaf");
        self.host.progress(segment_idx as u64 + 1, self.n_segments, self.length, &message);
    }
}
