//! Branch and bound for one number of grasps.
//!
//! A node is closed only by a bound that holds in exact arithmetic and is kept for `proof.bin` ([`crate::proof`]). Its relaxed point is turned
//! into regions; if every waypoint lies in its region the node's bound is the cost of a plan, up to margins. Otherwise
//! the waypoint that misses its region most is branched on: by connected region of CG_free while it has several, then by
//! region. A violated cut is branched on its ways of being satisfied. Both are finite.

use crate::assignment::{Assignment, TOL_VIOLATION, assign, price_of_violation, violation};
use crate::fixed_regions::{ExactPlan, plan_in_regions};
use crate::hull::Hulls;
use crate::instance::Instance;
use crate::kept_system::KeptSystem;
use crate::node::Node;
use crate::proof::{Branching, ProofTree};
use crate::relaxation::{Relaxed, RelaxedPoint, relax};
use conic::ConicError;
use manipulation::PathMode;
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeMap, BinaryHeap};

/// Limits of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Relative gap at which a node is closed.
    pub gap: f64,
    /// Most nodes.
    pub max_nodes: u64,
}

/// How a search ended.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOutcome {
    /// Cheapest plan found.
    pub plan: Option<ExactPlan>,
    /// No plan with this many grasps costs less: proven. +∞ if none exists.
    pub lower_bound: f64,
    /// Whether every node was closed.
    pub is_complete: bool,
    /// Nodes whose relaxation was solved.
    pub nodes: u64,
    /// Nodes that could not be decided: their plans, if any, touch the faces of their regions to within rounding.
    pub n_undecided: u64,
    /// Whether the cancel flag ended the search.
    pub is_canceled: bool,
    /// What proves `lower_bound`.
    pub tree: ProofTree,
}

impl SearchOutcome {
    /// Whether it is proven that no plan exists.
    pub fn is_infeasible(&self) -> bool {
        self.plan.is_none() && self.lower_bound == f64::INFINITY
    }
}

/// A node in the queue: least bound first, then the deepest, then the oldest.
struct Queued {
    node: Node,
    sequence: u64,
}

impl Queued {
    fn key(&self) -> (f64, Reverse<usize>, u64) {
        (self.node.lower_bound, Reverse(self.node.depth), self.sequence)
    }
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> Ordering {
        let (a, b) = (self.key(), other.key());
        // The heap gives its largest element first.
        b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)).then(b.2.cmp(&a.2))
    }
}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Queued {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Queued {}

/// Searches all plans of `instance` with `n_grasps` grasps. `on_incumbent` hears of each better plan with the bound
/// known then.
pub fn search(
    instance: &Instance,
    n_grasps: usize,
    limits: &Limits,
    on_incumbent: &mut dyn FnMut(f64, f64),
    cancel: &dyn Fn() -> bool,
) -> Result<SearchOutcome, ConicError> {
    let mut search = Search {
        instance,
        system: KeptSystem::new(instance.manipulation, &instance.start, &instance.goal, n_grasps),
        gap: limits.gap,
        hulls: Hulls::default(),
        queue: BinaryHeap::new(),
        incumbent: None,
        closed_bound: f64::INFINITY,
        sequence: 0,
        nodes: 0,
        n_undecided: 0,
        tree: ProofTree::default(),
    };
    search.push(Node::root(instance, n_grasps));
    let mut is_complete = true;
    let mut is_canceled = false;
    while let Some(queued) = search.queue.pop() {
        is_canceled = cancel();
        if is_canceled || search.nodes >= limits.max_nodes {
            search.queue.push(queued);
            is_complete = false;
            break;
        }
        let known = search.queue.peek().map_or(f64::INFINITY, |next| next.node.lower_bound);
        let before = search.cost();
        search.visit(queued.node)?;
        if search.cost() < before {
            on_incumbent(search.cost(), known.min(search.closed_bound).min(search.cost()));
        }
    }
    let open = search.queue.iter().map(|queued| queued.node.lower_bound).fold(f64::INFINITY, f64::min);
    let lower_bound = open.min(search.closed_bound).min(search.cost());
    Ok(SearchOutcome {
        is_complete: is_complete && search.n_undecided == 0,
        plan: search.incumbent,
        lower_bound,
        nodes: search.nodes,
        n_undecided: search.n_undecided,
        is_canceled,
        tree: search.tree,
    })
}

struct Search<'a> {
    instance: &'a Instance<'a>,
    system: KeptSystem,
    gap: f64,
    hulls: Hulls,
    queue: BinaryHeap<Queued>,
    incumbent: Option<ExactPlan>,
    /// Least proven bound of the nodes that were closed by it.
    closed_bound: f64,
    sequence: u64,
    nodes: u64,
    n_undecided: u64,
    tree: ProofTree,
}

impl Search<'_> {
    fn cost(&self) -> f64 {
        self.incumbent.as_ref().map_or(f64::INFINITY, |plan| plan.cost)
    }

    /// A node with at least this bound cannot improve the incumbent by more than the gap.
    fn cutoff(&self) -> f64 {
        let cost = self.cost();
        if cost.is_finite() { cost - self.gap * cost.abs() } else { cost }
    }

    fn push(&mut self, node: Node) {
        self.queue.push(Queued { node, sequence: self.sequence });
        self.sequence += 1;
    }

    /// Closes a node that its bound closes.
    fn closes(&mut self, lower_bound: f64) -> bool {
        let closes = lower_bound >= self.cutoff();
        if closes {
            self.closed_bound = self.closed_bound.min(lower_bound);
        }
        closes
    }

    fn visit(&mut self, mut node: Node) -> Result<(), ConicError> {
        if self.closes(node.lower_bound) || !node.propagate(self.instance) {
            return Ok(());
        }
        self.nodes += 1;
        let (lower_bound, point) = match relax(self.instance, &mut self.hulls, &node)? {
            Relaxed::Infeasible(multipliers) => {
                self.tree.bounded(node.record, f64::INFINITY, multipliers);
                return Ok(());
            }
            Relaxed::Bounded { lower_bound, multipliers, point } => {
                self.tree.bounded(node.record, lower_bound, multipliers);
                (lower_bound, point)
            }
        };
        node.lower_bound = node.lower_bound.max(lower_bound);
        if self.system.is_contradictory() {
            // There is no plan, but no proof of that in the terms of the file; parts of the node would not give one.
            self.leave_undecided(&node);
            return Ok(());
        }
        if self.closes(node.lower_bound) {
            return Ok(());
        }
        let assignment = match &point {
            Some(point) => self.round(&node, point)?,
            None => None,
        };
        if self.closes(node.lower_bound) {
            return Ok(());
        }
        self.branch(node, point.as_ref(), assignment.as_ref());
        Ok(())
    }

    /// Looks for a plan near the relaxed point; the regions that the point violates least.
    fn round(&mut self, node: &Node, point: &RelaxedPoint) -> Result<Option<Assignment>, ConicError> {
        let instance = self.instance;
        let last = node.allowed.len() - 1;
        let by_violation = assign(instance, node, &point.x, |waypoint_idx, position| {
            if waypoint_idx == 0 || waypoint_idx == last {
                return 0.0;
            }
            let region_idx = node.allowed[waypoint_idx][position];
            price_of_violation(violation(instance, region_idx, &point.x[waypoint_idx]))
        });
        if let Some(assignment) = &by_violation {
            self.try_regions(assignment)?;
        }
        if self.incumbent.is_none() {
            // The weights see what hulls hide: a point between two regions may belong to either.
            let by_weight = assign(instance, node, &point.x, |waypoint_idx, position| {
                if waypoint_idx == 0 || waypoint_idx == last {
                    return 0.0;
                }
                1.0 - point.weights[waypoint_idx].get(position).copied().unwrap_or(0.0)
            });
            if let Some(assignment) = by_weight.filter(|assignment| Some(assignment) != by_violation.as_ref())
            {
                self.try_regions(&assignment)?;
            }
        }
        Ok(by_violation)
    }

    fn try_regions(&mut self, assignment: &Assignment) -> Result<(), ConicError> {
        if !assignment.violated_cuts.is_empty() {
            return Ok(());
        }
        let plan = plan_in_regions(self.instance, &self.system, &assignment.regions, &assignment.exits)?;
        if let Some(plan) = plan.filter(|plan| plan.cost < self.cost()) {
            self.incumbent = Some(plan);
        }
        Ok(())
    }

    /// Splits a node into parts that cover it; counts it as undecided if it has no parts.
    fn branch(&mut self, node: Node, point: Option<&RelaxedPoint>, assignment: Option<&Assignment>) {
        let inner = 1..node.allowed.len() - 1;
        let miss = |waypoint_idx: usize| match (point, assignment) {
            (Some(point), Some(assignment)) => {
                violation(self.instance, assignment.regions[waypoint_idx], &point.x[waypoint_idx])
            }
            _ => 0.0,
        };
        let worst = inner
            .clone()
            .filter(|&idx| node.allowed[idx].len() > 1)
            .map(|idx| (idx, miss(idx)))
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        let violated_cut = assignment.and_then(|assignment| assignment.violated_cuts.first().copied());
        let branching = match (worst, violated_cut) {
            (Some((waypoint_idx, miss)), cut) if miss > TOL_VIOLATION || cut.is_none() => {
                let is_mixed = self.grasp_classes(&node, waypoint_idx).len() > 1;
                if !is_mixed && !node.is_refined {
                    // The same node once more, tighter, before regions are told apart.
                    self.push(node.refined());
                    return;
                }
                Branching::Waypoint(waypoint_idx, self.groups(&node, waypoint_idx))
            }
            (_, Some((segment_idx, cut_idx))) => Branching::Cut(segment_idx, cut_idx),
            _ => match self.unresolved_cut(&node) {
                Some((segment_idx, cut_idx)) => Branching::Cut(segment_idx, cut_idx),
                None => return self.leave_undecided(&node),
            },
        };
        let parts = node.parts(self.instance, &branching);
        let records = self.tree.split(node.record, branching, parts.len());
        for (part, record) in parts.into_iter().zip(records) {
            self.push(Node { record, ..part });
        }
    }

    /// Counts a node that cannot be split further.
    fn leave_undecided(&mut self, node: &Node) {
        self.n_undecided += 1;
        self.closed_bound = self.closed_bound.min(node.lower_bound);
    }

    /// One child for each connected region of CG_free if there are several, else one for each region.
    fn groups(&self, node: &Node, waypoint_idx: usize) -> Vec<Vec<usize>> {
        let by_class = self.grasp_classes(node, waypoint_idx);
        if by_class.len() > 1 {
            by_class.into_values().collect()
        } else {
            node.allowed[waypoint_idx].iter().map(|&region_idx| vec![region_idx]).collect()
        }
    }

    /// Allowed regions of a waypoint by connected region of CG_free.
    fn grasp_classes(&self, node: &Node, waypoint_idx: usize) -> BTreeMap<Option<usize>, Vec<usize>> {
        let mut by_class: BTreeMap<Option<usize>, Vec<usize>> = BTreeMap::new();
        for &region_idx in &node.allowed[waypoint_idx] {
            by_class.entry(self.instance.class(PathMode::Transfer, region_idx)).or_default().push(region_idx);
        }
        by_class
    }

    /// A segment and a cut that the node neither satisfies by its regions nor by an exit.
    fn unresolved_cut(&self, node: &Node) -> Option<(usize, usize)> {
        (0..node.allowed.len() - 1).find_map(|segment_idx| {
            let cut_idx = (0..self.instance.cuts.len()).find(|&cut_idx| {
                let cut = &self.instance.cuts[cut_idx];
                let (from, to) = (&node.allowed[segment_idx], &node.allowed[segment_idx + 1]);
                cut.mode == crate::kept_system::mode_of_segment(segment_idx)
                    && node.chosen_exit(segment_idx, cut_idx).is_none()
                    && from.iter().any(|&a| to.iter().any(|&b| cut.parts(a, b)))
            })?;
            Some((segment_idx, cut_idx))
        })
    }
}
