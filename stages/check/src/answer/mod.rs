//! The answer itself: that there are no fewer grasps, no lower cost, or no plan at all, over the regions of the run.
//!
//! `miqp/proof.bin` holds multipliers and trees; [`ipc_types::artefact::ProofFile`] has the mathematics. Everything that they are
//! applied to comes from the scene and the regions: the sets, the connected regions, the chains, the exits.

mod chain;
mod relations;
mod sets;
#[cfg(test)]
mod tests;
mod tree;

use crate::interval::Interval;
use chain::Ground;
use ipc_types::artefact::{Mode, PlanFile, PlanStatus, ProofFile, ProofSet, Region, TriedStatus};
use relations::Relations;
use scene::{LinearForm, Task};
use serde::Serialize;
use sets::BoxedSet;
use std::cmp::Ordering;

/// How far a cost may be rounded up, and a bound may exceed it where kept forms are no doubles: a share of it.
const TOL_COST: f64 = 1e-9;

/// What the proof of an answer has proven.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// No motion over the regions has fewer grasps than this.
    pub fewest: usize,
    /// With as many grasps as the plan has, squared steps sum to no less; `None` without a plan.
    pub cost_lower_bound: Option<f64>,
    /// What the plan's own squared steps sum to; `None` without a plan.
    pub cost: Option<f64>,
    /// Nodes that were replayed.
    pub n_nodes: usize,
}

/// Why an answer is not proven.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum AnswerError {
    #[error("{what} {position} does not exist: there are {count}")]
    NoSuch { what: &'static str, position: u32, count: usize },
    #[error("the multiplier of row {row} is {value}, not a number of at least 0")]
    Multiplier { row: u32, value: f64 },
    #[error("{0} has a number that is not finite, or too few or too many numbers")]
    NotFinite(&'static str),
    #[error("a bound has as many {0} as its node does not have")]
    Shape(&'static str),
    #[error("region {region}: its multipliers do not prove its {set:?} set empty")]
    NotEmpty { set: ProofSet, region: usize },
    #[error("regions {a} and {b} are not proven apart in a {mode}")]
    NotApart { mode: &'static str, a: usize, b: usize },
    #[error(
        "the grasps in region {inner} are not proven to lie in region {outer}, or that one is left out itself"
    )]
    NotContained { inner: usize, outer: usize },
    #[error("the tree for {n_grasps} grasps, node {position}: {problem}")]
    Tree { n_grasps: usize, position: usize, problem: &'static str },
    #[error("nothing is proven of {n_grasps} grasps, though the plan claims something")]
    Missing { n_grasps: usize },
    #[error(
        "with {n_grasps} grasps a cost of {bound} is left possible, though the plan claims that there is no motion"
    )]
    NotExcluded { n_grasps: usize, bound: f64 },
    #[error("with {n_grasps} grasps the cost is proven to be at least {bound}, the plan claims {claimed}")]
    Bound { n_grasps: usize, bound: f64, claimed: f64 },
    #[error("the plan's list of tried numbers of grasps is not 1, 2, …, {0}")]
    Tried(usize),
    #[error("the plan says that it costs {claimed:?}, its steps cost {lower} to {upper}")]
    Cost { claimed: Option<f64>, lower: f64, upper: f64 },
    #[error("the plan is called optimal without a lower bound")]
    NoBound,
    #[error("the plan costs {cost}, but its cost is proven to be at least {bound}: one of them is wrong")]
    Contradiction { cost: f64, bound: f64 },
}

/// The task over the regions.
#[derive(Debug)]
pub struct Problem<'a> {
    task: &'a Task,
    /// Sorted by id.
    regions: Vec<&'a Region>,
}

impl<'a> Problem<'a> {
    fn new(task: &'a Task, regions: &'a [Region]) -> Result<Self, AnswerError> {
        let n = task.start.len();
        let good = |row: &Vec<f64>| row.len() == n && row.iter().all(|x| x.is_finite());
        let fits =
            |r: &Region| r.A.len() == r.b.len() && r.A.iter().all(good) && r.b.iter().all(|b| b.is_finite());
        if !regions.iter().all(fits) {
            return Err(AnswerError::NotFinite("a region"));
        }
        let mut regions: Vec<&Region> = regions.iter().collect();
        regions.sort_by_key(|region| region.id);
        Ok(Self { task, regions })
    }

    fn dim(&self) -> usize {
        self.task.start.len()
    }

    fn forms(&self, mode: Mode) -> &[LinearForm] {
        match mode {
            Mode::Transit => &self.task.transit_keep,
            Mode::Transfer => &self.task.transfer_keep,
        }
    }

    fn region(&self, position: u32) -> Result<usize, AnswerError> {
        let count = self.regions.len();
        let found = self.regions.get(position as usize).map(|_| position as usize);
        found.ok_or(AnswerError::NoSuch { what: "region", position, count })
    }

    fn set_of_mode(&self, mode: Mode, regions: &[usize]) -> BoxedSet {
        let space = match mode {
            Mode::Transit => &self.task.placement,
            Mode::Transfer => &self.task.grasp,
        };
        BoxedSet::new(&[space], &regions.iter().map(|&idx| self.regions[idx]).collect::<Vec<_>>())
    }

    fn waypoint_set(&self, region: usize) -> BoxedSet {
        BoxedSet::new(&[&self.task.grasp, &self.task.placement], &[self.regions[region]])
    }
}

/// Verifies what `plan` claims of its number of grasps and its cost, by `proof`.
pub fn verify(
    task: &Task,
    regions: &[Region],
    plan: &PlanFile,
    proof: &ProofFile,
) -> Result<Answer, AnswerError> {
    let problem = Problem::new(task, regions)?;
    let relations = Relations::verify(&problem, proof)?;
    let waypoint_sets = (0..problem.regions.len()).map(|idx| problem.waypoint_set(idx)).collect();
    let ground = Ground { problem: &problem, proof, relations: &relations, waypoint_sets };
    let mut n_nodes = 0;
    let mut proven = |n_grasps: usize| -> Result<Option<f64>, AnswerError> {
        let covers = |first: u32, last: u32| (first as usize..=last as usize).contains(&n_grasps);
        let search = proof.searches.iter().find(|search| covers(search.first, search.last));
        let Some(search) = search else { return Ok(None) };
        n_nodes += search.nodes.len();
        tree::replay(&ground, search, n_grasps).map(Some)
    };
    let n_tried = plan.n_grasps.unwrap_or(plan.tried.len());
    if plan.tried.iter().map(|tried| tried.n_grasps).ne(1..=n_tried) {
        return Err(AnswerError::Tried(n_tried));
    }
    // Every ℓ below the answer, a transit alone included; all that were tried if there is no plan.
    let n_excluded = plan.n_grasps.unwrap_or(n_tried + 1);
    let mut fewest = None;
    for n_grasps in 0..n_excluded {
        let tried = n_grasps.checked_sub(1).and_then(|idx| plan.tried.get(idx));
        let is_claimed = plan.status != PlanStatus::Feasible
            || tried.is_some_and(|tried| tried.status == TriedStatus::Infeasible);
        let bound = proven(n_grasps)?;
        let is_excluded = bound == Some(f64::INFINITY);
        if is_claimed && !is_excluded {
            return Err(match bound {
                Some(bound) => AnswerError::NotExcluded { n_grasps, bound },
                None => AnswerError::Missing { n_grasps },
            });
        }
        verify_bound(n_grasps, bound, tried.and_then(|tried| tried.lower_bound))?;
        if !is_excluded {
            fewest = fewest.or(Some(n_grasps));
        }
    }
    let fewest = fewest.unwrap_or(n_excluded);
    let Some(n_grasps) = plan.n_grasps else {
        return Ok(Answer { fewest, cost_lower_bound: None, cost: None, n_nodes });
    };
    let cost = verify_cost(plan)?;
    let bound = proven(n_grasps)?;
    let tried = plan.tried.last().filter(|_| n_grasps > 0);
    if plan.status == PlanStatus::Optimal && plan.lower_bound.is_none() {
        return Err(AnswerError::NoBound);
    }
    for claimed in [plan.lower_bound, tried.and_then(|tried| tried.lower_bound)] {
        verify_bound(n_grasps, bound, claimed)?;
    }
    if let Some(bound) = bound.filter(|bound| *bound > cost + TOL_COST * (1.0 + cost)) {
        return Err(AnswerError::Contradiction { cost, bound });
    }
    Ok(Answer { fewest, cost_lower_bound: bound, cost: Some(cost), n_nodes })
}

/// A claimed lower bound is not above the proven one.
fn verify_bound(n_grasps: usize, bound: Option<f64>, claimed: Option<f64>) -> Result<(), AnswerError> {
    let Some(claimed) = claimed else { return Ok(()) };
    let bound = bound.ok_or(AnswerError::Missing { n_grasps })?;
    let holds = matches!(claimed.partial_cmp(&bound), Some(Ordering::Less | Ordering::Equal));
    if holds { Ok(()) } else { Err(AnswerError::Bound { n_grasps, bound, claimed }) }
}

/// The plan's cost is what its configurations cost, rounded up a little at most; the cost.
fn verify_cost(plan: &PlanFile) -> Result<f64, AnswerError> {
    let mut sum = Interval::ZERO;
    for pair in plan.configurations.iter().flat_map(|x| x.windows(2)) {
        for (&from, &to) in pair[0].iter().zip(&pair[1]) {
            sum = sum + (Interval::point(to) - Interval::point(from)).square();
        }
    }
    let is_near = |cost: f64| sum.lo() <= cost && cost <= sum.hi() + TOL_COST * (1.0 + sum.hi());
    match plan.cost.filter(|&cost| is_near(cost)) {
        Some(cost) => Ok(cost),
        None => Err(AnswerError::Cost { claimed: plan.cost, lower: sum.lo(), upper: sum.hi() }),
    }
}

/// Transits and transfers alternate, a transit comes first.
fn mode_of_segment(segment: usize) -> Mode {
    if segment.is_multiple_of(2) { Mode::Transit } else { Mode::Transfer }
}
