//! The tree of a search, replayed.

use super::chain::Ground;
use super::relations::holding;
use super::{AnswerError, mode_of_segment};
use ipc_types::artefact::{ProofNode, Search};
use std::collections::BTreeSet;

/// A way out of a set of regions that a segment takes.
#[derive(Debug, Clone)]
pub struct Exit {
    /// Segment.
    pub segment: usize,
    /// Region inside the set.
    pub inside: usize,
    /// Region outside it.
    pub outside: usize,
}

/// The motions whose points x_i lie in regions of `allowed[i]` and whose segments take `exits`.
#[derive(Debug, Clone)]
pub struct Node {
    /// Regions of each point.
    pub allowed: Vec<Vec<usize>>,
    /// Exits, in the order in which they were chosen.
    pub exits: Vec<Exit>,
}

impl Node {
    /// Leaves out regions that lie on no chain; whether any chain is left. A sweep each way is complete.
    fn propagate(&mut self, ground: &Ground) -> bool {
        let n_segments = self.allowed.len() - 1;
        let forward = (0..n_segments).map(|segment| (segment, segment + 1, segment));
        let backward = (0..n_segments).rev().map(|segment| (segment + 1, segment, segment));
        for (from, to, segment) in forward.chain(backward) {
            let class = |region: &usize| ground.relations.class(mode_of_segment(segment), *region);
            let reached: BTreeSet<usize> = self.allowed[from].iter().filter_map(class).collect();
            self.allowed[to].retain(|region| class(region).is_some_and(|class| reached.contains(&class)));
        }
        self.allowed.iter().all(|regions| !regions.is_empty())
    }

    fn restricted(&self, point: usize, keep: impl Fn(usize) -> bool) -> Self {
        let mut child = self.clone();
        child.allowed[point].retain(|&region| keep(region));
        child
    }
}

/// Replays a search for `n_grasps` grasps; the least cost that it leaves possible, +∞ if it leaves no motion.
pub fn replay(ground: &Ground, search: &Search, n_grasps: usize) -> Result<f64, AnswerError> {
    let task = ground.problem.task;
    let mut allowed = vec![ground.relations.inner.clone(); 2 * n_grasps + 2];
    allowed[0] = holding(ground.problem, task.start.as_slice());
    allowed[2 * n_grasps + 1] = holding(ground.problem, task.goal.as_slice());
    let mut stack = vec![Node { allowed, exits: Vec::new() }];
    let mut least = f64::INFINITY;
    for (position, proof_node) in search.nodes.iter().enumerate() {
        let tree = |problem| AnswerError::Tree { n_grasps, position, problem };
        let mut node = stack.pop().ok_or_else(|| tree("it follows a tree that is complete"))?;
        let has_chain = node.propagate(ground);
        // Each node that waits needs one of those that follow; no more children than that are made.
        let room = (search.nodes.len() - position - 1).saturating_sub(stack.len());
        let too_few = "the nodes after it are too few for its children";
        let mut children = match proof_node {
            ProofNode::Leaf(_) if !has_chain => Vec::new(),
            ProofNode::Leaf(None) => {
                least = least.min(0.0);
                Vec::new()
            }
            ProofNode::Leaf(Some(bound)) => {
                let count = ground.proof.bounds.len();
                let chain = ground.proof.bounds.get(*bound as usize);
                let chain = chain.ok_or(AnswerError::NoSuch { what: "bound", position: *bound, count })?;
                least = least.min(ground.bound(&node, chain)?);
                Vec::new()
            }
            ProofNode::Waypoint { waypoint, groups } => {
                let point = *waypoint as usize;
                if !(1..=2 * n_grasps).contains(&point) {
                    return Err(tree("it splits by a point that is none"));
                }
                if groups.len() > room {
                    return Err(tree(too_few));
                }
                let groups: Vec<BTreeSet<usize>> =
                    groups.iter().map(|group| group.iter().map(|&idx| idx as usize).collect()).collect();
                let is_covered = |region: &usize| groups.iter().any(|group| group.contains(region));
                if !node.allowed[point].iter().all(is_covered) {
                    return Err(tree("a region of its point is in no child"));
                }
                groups.iter().map(|group| node.restricted(point, |idx| group.contains(&idx))).collect()
            }
            ProofNode::Cut { segment, cut } => {
                let split = Split::new(ground, &node, *segment, *cut)?;
                let split = split.ok_or_else(|| tree("it splits by a segment that is none"))?;
                if 2 + split.exits.len() > room {
                    return Err(tree(too_few));
                }
                split.children(&node)
            }
        };
        children.reverse();
        stack.extend(children);
    }
    // Only a search without nodes leaves one.
    match stack.is_empty() {
        true => Ok(least),
        false => Err(AnswerError::Tree { n_grasps, position: 0, problem: "there are no nodes" }),
    }
}

/// A segment and a set of regions: both ends inside, both outside, or through one of the exits.
struct Split {
    segment: usize,
    inside: BTreeSet<usize>,
    exits: Vec<(usize, usize)>,
}

impl Split {
    /// `None` if the segment is none of the cut's mode.
    fn new(ground: &Ground, node: &Node, segment: u32, cut: u32) -> Result<Option<Self>, AnswerError> {
        let count = ground.proof.cuts.len();
        let found = ground.proof.cuts.get(cut as usize);
        let found = found.ok_or(AnswerError::NoSuch { what: "cut", position: cut, count })?;
        let segment = segment as usize;
        if segment + 1 >= node.allowed.len() || mode_of_segment(segment) != found.mode {
            return Ok(None);
        }
        let mut inside = BTreeSet::new();
        for &region in &found.inside {
            inside.insert(ground.problem.region(region)?);
        }
        let exits = ground.relations.exits(found.mode, &inside);
        Ok(Some(Self { segment, inside, exits }))
    }

    fn children(&self, node: &Node) -> Vec<Node> {
        let sides = [true, false].map(|side| {
            let keep = |region: usize| self.inside.contains(&region) == side;
            node.restricted(self.segment, keep).restricted(self.segment + 1, keep)
        });
        let through = self.exits.iter().map(|&(inside, outside)| {
            let mut child = node.clone();
            child.exits.push(Exit { segment: self.segment, inside, outside });
            child
        });
        sides.into_iter().chain(through).collect()
    }
}
