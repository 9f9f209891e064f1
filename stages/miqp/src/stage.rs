//! The stage: regions and cuts in, plan out.

use crate::error::MiqpError;
use crate::grasp_plan::{PlanOutcome, PlanSink, Question, plan};
use crate::options::MiqpOptions;
use ipc_types::artefact::{PlanFile, PlanStatus, ProofFile, Tried, TriedStatus};
use manipulation::Manipulation;
use stage_kit::{Host, Input, Job, Outcome, Stage, StageError, StageName, spans};
use std::time::Instant;

/// `regrasp-miqp`.
#[derive(Debug, Default)]
pub struct MiqpStage;

impl Stage for MiqpStage {
    type Options = MiqpOptions;

    const NAME: StageName = StageName::Miqp;
    const ABOUT: &'static str =
        "Fewest grasps that bring the object to its goal, by a mixed-integer quadratic programme";
    const READS: &'static [Input] = &[Input::Regions, Input::Cuts];

    fn run(&mut self, job: &Job, options: &MiqpOptions, host: &mut Host) -> Result<Outcome, StageError> {
        let task = job.task()?;
        let mut polytopes = Vec::with_capacity(job.regions.len());
        for region in &job.regions {
            let region =
                wire::Region::from_artefact(region, job.scene.dim()).map_err(StageError::bad_input)?;
            polytopes.push(region.polyhedron);
        }
        let region_ids: Vec<u64> = job.regions.iter().map(|region| region.id).collect();
        host.progress(0, 0, 0.0, "connected regions");
        let manipulation = {
            let _span = spans::enter("miqp.regions", polytopes.len() as u64);
            Manipulation::new(&job.scene, task, &polytopes).map_err(StageError::bad_input)?
        };
        host.check_stop()?;
        let coordinates = job.coordinates();
        let question = Question {
            manipulation: &manipulation,
            region_ids: &region_ids,
            coordinates: &coordinates,
            start: &task.start,
            goal: &task.goal,
            max_grasps: task.max_grasps,
            cuts: &job.cuts,
        };
        let stop = host.stop_flag();
        let max_grasps = if options.max_grasps > 0 { options.max_grasps } else { task.max_grasps };
        let mut sink =
            HostSink { host, max_grasps, since: Instant::now(), seconds: Vec::new(), nodes: 0, proof: None };
        let outcome = {
            let _span = spans::enter("miqp.plan", polytopes.len() as u64);
            plan(&question, options, &mut sink, &|| stop.is_set()).map_err(of_plan)?
        };
        let (seconds, nodes, proof) = (sink.seconds, sink.nodes, sink.proof);
        host.solver_calls(nodes);
        host.detail("seconds_per_n_grasps", seconds);
        match outcome {
            PlanOutcome::Settled(file) => {
                let ending = ending_of(&file);
                host.plan(file, proof)?;
                Ok(ending)
            }
            PlanOutcome::Open { is_canceled: true, .. } => Err(StageError::Stopped),
            PlanOutcome::Open { tried, .. } => {
                let open: Vec<String> = tried
                    .iter()
                    .filter(|entry| entry.status != TriedStatus::Infeasible)
                    .map(|entry| format!("{} grasps: {}", entry.n_grasps, entry.reason))
                    .collect();
                host.detail("tried", &tried);
                Ok(Outcome::Limit(format!("no plan and no proof that there is none; {}", open.join("; "))))
            }
        }
    }
}

/// How the work ended, in words.
fn ending_of(file: &PlanFile) -> Outcome {
    let last_reason = file.tried.last().map_or("", |entry| entry.reason.as_str());
    match (file.status, file.n_grasps, file.cost, file.lower_bound) {
        (PlanStatus::Infeasible, ..) => Outcome::Negative(format!(
            "no plan with at most {} grasps over these regions: {last_reason}",
            file.tried.len()
        )),
        (status, n_grasps, cost, lower_bound) => {
            let proven = if status == PlanStatus::Optimal { "fewest, proven" } else { "fewer not excluded" };
            Outcome::Done(format!(
                "{} grasps ({proven}), cost {:.4}, at least {:.4}",
                n_grasps.unwrap_or(0),
                cost.unwrap_or(0.0),
                lower_bound.unwrap_or(0.0)
            ))
        }
    }
}

fn of_plan(error: MiqpError) -> StageError {
    match error {
        MiqpError::Conic(_) => StageError::failed(error),
        other => StageError::bad_input(other),
    }
}

/// Passes on what is found, and measures each number of grasps.
struct HostSink<'a, 'b> {
    host: &'a mut Host<'b>,
    max_grasps: usize,
    since: Instant,
    seconds: Vec<(usize, f64)>,
    nodes: u64,
    proof: Option<ProofFile>,
}

impl PlanSink for HostSink<'_, '_> {
    fn tried(&mut self, tried: &Tried) {
        let now = Instant::now();
        self.seconds.push((tried.n_grasps, (now - self.since).as_secs_f64()));
        self.since = now;
        self.nodes += tried.nodes;
        let message = format!("{} grasps: {}", tried.n_grasps, tried.reason);
        let value = tried.cost.unwrap_or(0.0);
        self.host.progress(tried.n_grasps as u64, self.max_grasps as u64, value, &message);
    }

    fn proof(&mut self, proof: ProofFile) {
        self.proof = Some(proof);
    }

    fn incumbent(&mut self, n_grasps: usize, cost: f64, lower_bound: f64) {
        let message = format!("{n_grasps} grasps: cost {cost:.4}, at least {lower_bound:.4}");
        self.host.progress(n_grasps as u64, self.max_grasps as u64, cost, &message);
    }
}
