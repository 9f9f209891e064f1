//! `proof.bin` from relations, bounds and trees.

use super::chain::{ChainValue, Multipliers};
use super::relations::{Relations, word_of};
use super::sets::Sparse;
use super::tree::{Branching, ProofTree};
use crate::instance::Instance;
use ipc_types::artefact::{Apart, ChainBound, Contained, EmptySet, ProofCut, ProofFile, ProofNode, Search};
use std::collections::BTreeMap;

/// Collects the parts of a proof.
#[derive(Debug, Default)]
pub struct ProofWriter {
    file: ProofFile,
    /// Lists that are in the file, by their bits.
    known: BTreeMap<Vec<(u32, u64)>, u32>,
}

impl ProofWriter {
    /// What a search proves for `n_grasps` grasps: at least `bound`.
    pub fn search(&mut self, instance: &Instance, n_grasps: usize, tree: &ProofTree, bound: f64) {
        let nodes = tree.nodes(instance, n_grasps, bound, self);
        self.push(n_grasps, n_grasps, nodes);
    }

    /// One bound, for every ℓ from `first` to `last`.
    pub fn leaf(&mut self, first: usize, last: usize, multipliers: &Multipliers, value: &ChainValue) {
        // Where connected regions alone tell, there is nothing to write.
        let says = *multipliers != Multipliers::default();
        let position = says.then(|| self.bound(multipliers, value));
        self.push(first, last, vec![ProofNode::Leaf(position)]);
    }

    fn push(&mut self, first: usize, last: usize, nodes: Vec<ProofNode>) {
        self.file.searches.push(Search { first: first as u32, last: last as u32, nodes });
    }

    /// The file.
    pub fn finish(mut self, instance: &Instance) -> ProofFile {
        let relations: &Relations = &instance.relations;
        for (&(set, region_idx), proof) in &relations.empty {
            let multipliers = self.sparse(proof);
            self.file.empty.push(EmptySet { set, region: region_idx as u32, multipliers });
        }
        for (&(mode, a, b), proof) in &relations.apart {
            let multipliers = self.sparse(proof);
            self.file.apart.push(Apart { mode: word_of(mode), a: a as u32, b: b as u32, multipliers });
        }
        for (inner, outer, proofs) in &relations.contained {
            let faces = proofs.iter().map(|proof| self.sparse(proof)).collect();
            self.file.contained.push(Contained { inner: *inner as u32, outer: *outer as u32, faces });
        }
        for cut in &instance.cuts {
            let inside = (0..cut.is_reached.len()).filter(|&idx| cut.is_reached[idx]);
            let inside = inside.map(|idx| idx as u32).collect();
            self.file.cuts.push(ProofCut { mode: word_of(cut.mode), inside });
        }
        self.file
    }

    /// Position of a bound.
    pub(super) fn bound(&mut self, multipliers: &Multipliers, value: &ChainValue) -> u32 {
        let waypoints = value.waypoints.iter().map(|supports| {
            let listed = supports.iter().filter(|(_, proof)| !proof.is_empty());
            listed.map(|(region_idx, proof)| (*region_idx as u32, self.sparse(proof))).collect()
        });
        let waypoints = waypoints.collect();
        let exits = value.exits.iter().enumerate().map(|(position, proof)| {
            (multipliers.exits.get(position).cloned().unwrap_or_default(), self.sparse(proof))
        });
        let exits = exits.collect();
        let segments = multipliers
            .segments
            .iter()
            .map(|by_class| by_class.iter().map(|(&class, kept)| (class as u32, kept.clone())).collect());
        self.file.bounds.push(ChainBound {
            steps: multipliers.steps.iter().map(|step| step.iter().copied().collect()).collect(),
            segments: segments.collect(),
            waypoints,
            exits,
        });
        (self.file.bounds.len() - 1) as u32
    }

    pub(super) fn branching(&self, branching: &Branching) -> ProofNode {
        match branching {
            Branching::Waypoint(waypoint_idx, groups) => ProofNode::Waypoint {
                waypoint: *waypoint_idx as u32,
                groups: groups.iter().map(|group| group.iter().map(|&idx| idx as u32).collect()).collect(),
            },
            Branching::Cut(segment_idx, cut_idx) => {
                ProofNode::Cut { segment: *segment_idx as u32, cut: *cut_idx as u32 }
            }
        }
    }

    fn sparse(&mut self, list: &Sparse) -> u32 {
        let bits = list.iter().map(|&(row, y)| (row, y.to_bits())).collect();
        let next = self.file.multipliers.len() as u32;
        let position = *self.known.entry(bits).or_insert(next);
        if position == next {
            self.file.multipliers.push(list.clone());
        }
        position
    }
}
