//! The grasp plan with the fewest grasps (thesis 2, section 5.4; Algorithm 1, the loop over ℓ).

use crate::branch_and_bound::{Limits, SearchOutcome, search};
use crate::error::MiqpError;
use crate::exact::same_leaf;
use crate::fixed_regions::cost_above;
use crate::grasp_bound::grasp_bound;
use crate::instance::Instance;
use crate::node::Node;
use crate::options::MiqpOptions;
use crate::proof::{KnownSupports, Multipliers, ProofWriter, evaluate};
use ipc_types::artefact::{LeafCut, Mode, PlanFile, PlanStatus, ProofFile, Tried, TriedStatus};
use manipulation::{Manipulation, PathMode};
use nalgebra::DVector;

/// Hears of what is found on the way.
pub trait PlanSink {
    /// A number of grasps is settled.
    fn tried(&mut self, _tried: &Tried) {}
    /// A better plan with `n_grasps` grasps, and the bound known then.
    fn incumbent(&mut self, _n_grasps: usize, _cost: f64, _lower_bound: f64) {}
    /// The proof of a settled answer, just before it is returned.
    fn proof(&mut self, _proof: ProofFile) {}
}

/// A sink that listens to nothing.
#[derive(Debug, Default)]
pub struct NoSink;

impl PlanSink for NoSink {}

/// How planning ended.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanOutcome {
    /// A plan, or the proof that none with at most K grasps exists over these regions.
    Settled(PlanFile),
    /// A limit, or the cancel flag, ended it without a plan and without a proof.
    Open {
        /// What was tried.
        tried: Vec<Tried>,
        /// Whether it was the cancel flag.
        is_canceled: bool,
    },
}

/// What is asked.
#[derive(Debug, Clone, Copy)]
pub struct Question<'a> {
    /// The sets of the task over the regions.
    pub manipulation: &'a Manipulation,
    /// Ids of the regions, in their order.
    pub region_ids: &'a [u64],
    /// Names of the coordinates, for words.
    pub coordinates: &'a [String],
    /// x_0.
    pub start: &'a DVector<f64>,
    /// x_{2ℓ+1}.
    pub goal: &'a DVector<f64>,
    /// K of the task.
    pub max_grasps: usize,
    /// Leaf cuts found so far.
    pub cuts: &'a [LeafCut],
}

/// The plan with the fewest grasps, least cost among these.
///
/// A start that is the goal, or that a transit alone takes there, is a plan with 0 grasps and one transit segment;
/// `tried` speaks of ℓ ≥ 1 only.
pub fn plan(
    question: &Question,
    options: &MiqpOptions,
    sink: &mut dyn PlanSink,
    cancel: &dyn Fn() -> bool,
) -> Result<PlanOutcome, MiqpError> {
    if !(options.gap > 0.0 && options.gap <= 1.0) {
        return Err(MiqpError::Gap { gap: options.gap });
    }
    let instance = Instance::new(
        question.manipulation,
        question.start.clone(),
        question.goal.clone(),
        question.region_ids,
        question.cuts,
    )?;
    let mut proof = ProofWriter::default();
    if let Some(regions) = transit_alone(&instance) {
        let x = [instance.start.clone(), instance.goal.clone()];
        let multipliers = Multipliers { steps: vec![&x[1] - &x[0]], ..Multipliers::default() };
        let root = Node::root(&instance, 0);
        let value = evaluate(&instance, &root.allowed, &[], &multipliers, &mut KnownSupports::new());
        proof.leaf(0, 0, &multipliers, &value);
        let file =
            plan_file(question, PlanStatus::Optimal, &x, &regions, cost_above(&x), value.bound, Vec::new());
        sink.proof(proof.finish(&instance));
        return Ok(PlanOutcome::Settled(file));
    }
    let limits = Limits { gap: options.gap, max_nodes: options.max_nodes };
    // A transit alone is no number of grasps that was tried, but "no fewer" speaks of it too.
    let at_least_one = Limits { max_nodes: limits.max_nodes.max(1), ..limits };
    let transit = search(&instance, 0, &at_least_one, &mut |_, _| {}, cancel)?;
    if transit.is_canceled {
        return Ok(PlanOutcome::Open { tried: Vec::new(), is_canceled: true });
    }
    proof.search(&instance, 0, &transit.tree, transit.lower_bound);
    if let Some(found) = &transit.plan {
        let is_closed = transit.lower_bound >= found.cost - options.gap * found.cost;
        let status = if is_closed { PlanStatus::Optimal } else { PlanStatus::Feasible };
        let (cost, bound) = (found.cost, transit.lower_bound);
        let file = plan_file(question, status, &found.x, &found.regions, cost, bound, Vec::new());
        sink.proof(proof.finish(&instance));
        return Ok(PlanOutcome::Settled(file));
    }
    let max_grasps = if options.max_grasps > 0 { options.max_grasps } else { question.max_grasps };
    let bound = grasp_bound(&instance, question.coordinates)?;
    let mut first = 1;
    if let Some((last, value)) = bound.proven(&instance, max_grasps) {
        proof.leaf(1, last, &bound.multipliers, &value);
        first = last + 1;
    }
    let mut tried: Vec<Tried> = Vec::new();
    for n_grasps in 1..first {
        settle(&mut tried, excluded(n_grasps, &bound.reason), sink);
    }
    for n_grasps in first..=max_grasps {
        let mut on_incumbent = |cost, lower_bound| sink.incumbent(n_grasps, cost, lower_bound);
        let outcome = search(&instance, n_grasps, &limits, &mut on_incumbent, cancel)?;
        let entry = describe(n_grasps, &outcome, instance.cuts.len(), options);
        settle(&mut tried, entry.clone(), sink);
        proof.search(&instance, n_grasps, &outcome.tree, outcome.lower_bound);
        if let Some(found) = outcome.plan {
            let all_fewer_excluded = transit.is_infeasible()
                && tried[..tried.len() - 1].iter().all(|earlier| earlier.status == TriedStatus::Infeasible);
            let status = if all_fewer_excluded && entry.status == TriedStatus::Optimal {
                PlanStatus::Optimal
            } else {
                PlanStatus::Feasible
            };
            let file =
                plan_file(question, status, &found.x, &found.regions, found.cost, outcome.lower_bound, tried);
            sink.proof(proof.finish(&instance));
            return Ok(PlanOutcome::Settled(file));
        }
        if outcome.is_canceled {
            return Ok(PlanOutcome::Open { tried, is_canceled: true });
        }
    }
    if !transit.is_infeasible() {
        let entry = Tried { status: TriedStatus::Limit, ..excluded(0, "a transit alone is not excluded") };
        tried.insert(0, entry);
    }
    if tried.iter().any(|entry| entry.status != TriedStatus::Infeasible) {
        return Ok(PlanOutcome::Open { tried, is_canceled: false });
    }
    sink.proof(proof.finish(&instance));
    Ok(PlanOutcome::Settled(PlanFile {
        status: PlanStatus::Infeasible,
        n_grasps: None,
        configurations: None,
        regions: None,
        modes: None,
        cost: None,
        lower_bound: None,
        tried,
    }))
}

fn settle(tried: &mut Vec<Tried>, entry: Tried, sink: &mut dyn PlanSink) {
    sink.tried(&entry);
    tried.push(entry);
}

/// Regions of start and goal if a single transit joins them as far as regions, kept forms and cuts tell.
fn transit_alone(instance: &Instance) -> Option<Vec<usize>> {
    let manipulation = instance.manipulation;
    if !same_leaf(&manipulation.F_transit, &instance.start, &instance.goal) {
        return None;
    }
    let joined = |a: usize, b: usize| {
        instance.connected(PathMode::Transit, a, b)
            && instance.cuts.iter().all(|cut| {
                cut.mode != PathMode::Transit
                    || !cut.parts(a, b)
                    || cut.exit_at(manipulation, &instance.start).is_some()
            })
    };
    instance.start_regions.iter().find_map(|&a| {
        let b = instance.goal_regions.iter().copied().find(|&b| joined(a, b))?;
        Some(vec![a, b])
    })
}

fn excluded(n_grasps: usize, reason: &str) -> Tried {
    Tried {
        n_grasps,
        status: TriedStatus::Infeasible,
        reason: reason.to_owned(),
        cost: None,
        lower_bound: None,
        nodes: 0,
    }
}

fn describe(n_grasps: usize, outcome: &SearchOutcome, n_cuts: usize, options: &MiqpOptions) -> Tried {
    let nodes = outcome.nodes;
    let cost = outcome.plan.as_ref().map(|plan| plan.cost);
    let is_closed = cost.is_some_and(|cost| outcome.lower_bound >= cost - options.gap * cost);
    let (status, reason) = if outcome.is_infeasible() {
        let reason = if n_cuts > 0 {
            format!(
                "no choice of regions satisfies the constraints ({nodes} nodes closed by proof); paths are missing where \
                 {n_cuts} leaf cuts exclude them"
            )
        } else {
            format!(
                "grasps are missing: no choice of regions satisfies the constraints ({nodes} nodes closed by proof)"
            )
        };
        (TriedStatus::Infeasible, reason)
    } else if cost.is_some() && is_closed {
        (TriedStatus::Optimal, format!("least cost within a gap of {:e}", options.gap))
    } else if outcome.is_canceled {
        (open_status(cost), "stopped before the search ended".to_owned())
    } else if outcome.is_complete || outcome.n_undecided > 0 {
        let n = outcome.n_undecided;
        (
            open_status(cost),
            format!("{n} choices of regions touch their faces to within rounding and stay undecided"),
        )
    } else {
        (open_status(cost), format!("the limit of {} nodes was reached", options.max_nodes))
    };
    let lower_bound = (outcome.lower_bound.is_finite()).then_some(outcome.lower_bound);
    Tried { n_grasps, status, reason, cost, lower_bound, nodes }
}

fn open_status(cost: Option<f64>) -> TriedStatus {
    if cost.is_some() { TriedStatus::Feasible } else { TriedStatus::Limit }
}

fn plan_file(
    question: &Question,
    status: PlanStatus,
    x: &[DVector<f64>],
    regions: &[usize],
    cost: f64,
    lower_bound: f64,
    tried: Vec<Tried>,
) -> PlanFile {
    let modes = (0..x.len() - 1)
        .map(|segment_idx| match crate::kept_system::mode_of_segment(segment_idx) {
            PathMode::Transit => Mode::Transit,
            PathMode::Transfer => Mode::Transfer,
        })
        .collect();
    PlanFile {
        status,
        n_grasps: Some(x.len() / 2 - 1),
        configurations: Some(x.iter().map(|x| x.iter().copied().collect()).collect()),
        regions: Some(regions.iter().map(|&idx| question.region_ids[idx]).collect()),
        modes: Some(modes),
        cost: Some(cost),
        lower_bound: Some(lower_bound.min(cost)),
        tried,
    }
}
