//! A node of the search: what is still allowed.

use crate::instance::Instance;
use crate::kept_system::mode_of_segment;
use crate::proof::Branching;

/// The plans whose waypoint i lies in a region of `allowed[i]` and whose segments pass the `exits`.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Allowed regions of x_0 … x_{2ℓ+1}, sorted.
    pub allowed: Vec<Vec<usize>>,
    /// (segment, cut, exit): the exit that the segment passes.
    pub exits: Vec<(usize, usize, usize)>,
    /// Proven lower bound of the cost, from the parent.
    pub lower_bound: f64,
    /// Branchings above it.
    pub depth: usize,
    /// Whether its relaxation takes the hull of the sets themselves, not of polytopes around many of them.
    pub is_refined: bool,
    /// Position of its record in the tree of the search.
    pub record: usize,
}

impl Node {
    /// All plans with `n_grasps` grasps.
    pub fn root(instance: &Instance, n_grasps: usize) -> Self {
        let mut allowed = vec![instance.inner_regions(); 2 * n_grasps + 2];
        allowed[0] = instance.start_regions.clone();
        allowed[2 * n_grasps + 1] = instance.goal_regions.clone();
        Self { allowed, exits: Vec::new(), lower_bound: 0.0, depth: 0, is_refined: false, record: 0 }
    }

    /// Removes regions of a waypoint that share no connected region with its neighbors, until none is left; `false`
    /// if a waypoint has nothing left (thesis 2, Eq. 5.6d, 5.6e).
    pub fn propagate(&mut self, instance: &Instance) -> bool {
        let last = self.allowed.len() - 1;
        // One sweep each way is complete on a chain.
        let forward = (0..last).map(|segment_idx| (segment_idx, segment_idx + 1, segment_idx));
        let backward = (0..last).rev().map(|segment_idx| (segment_idx + 1, segment_idx, segment_idx));
        for (fixed, pruned, segment_idx) in forward.chain(backward) {
            let mode = mode_of_segment(segment_idx);
            let support = self.allowed[fixed].clone();
            self.allowed[pruned].retain(|&b| support.iter().any(|&a| instance.connected(mode, a, b)));
            if self.allowed[pruned].is_empty() {
                return false;
            }
        }
        !self.allowed[0].is_empty()
    }

    /// The same node with the tighter relaxation.
    pub fn refined(mut self) -> Self {
        self.is_refined = true;
        self
    }

    /// The part of the node in which waypoint `waypoint_idx` lies in one of `regions`.
    fn restricted(&self, waypoint_idx: usize, regions: Vec<usize>) -> Self {
        let mut child = self.clone();
        child.allowed[waypoint_idx] = regions;
        child.depth += 1;
        child
    }

    /// Parts that together hold every plan of the node; some may be empty.
    pub fn parts(&self, instance: &Instance, branching: &Branching) -> Vec<Self> {
        match branching {
            Branching::Waypoint(waypoint_idx, groups) => {
                groups.iter().map(|regions| self.restricted(*waypoint_idx, regions.clone())).collect()
            }
            Branching::Cut(segment_idx, cut_idx) => self.split_by_cut(instance, *segment_idx, *cut_idx),
        }
    }

    /// The ways in which segment `segment_idx` can satisfy cut `cut_idx`: both ends among the cut's regions, neither, or
    /// through one of its exits.
    fn split_by_cut(&self, instance: &Instance, segment_idx: usize, cut_idx: usize) -> Vec<Self> {
        let cut = &instance.cuts[cut_idx];
        let mut children = Vec::with_capacity(2 + cut.exits.len());
        for side in [true, false] {
            let mut child = self.clone();
            child.depth += 1;
            for waypoint_idx in [segment_idx, segment_idx + 1] {
                child.allowed[waypoint_idx].retain(|&idx| cut.is_reached[idx] == side);
            }
            children.push(child);
        }
        for exit_idx in 0..cut.exits.len() {
            let mut child = self.clone();
            child.depth += 1;
            child.exits.push((segment_idx, cut_idx, exit_idx));
            children.push(child);
        }
        children
    }

    /// The exit that was chosen for a segment and a cut.
    pub fn chosen_exit(&self, segment_idx: usize, cut_idx: usize) -> Option<usize> {
        self.exits.iter().find(|exit| exit.0 == segment_idx && exit.1 == cut_idx).map(|exit| exit.2)
    }
}
