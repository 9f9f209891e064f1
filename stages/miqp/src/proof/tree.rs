//! The tree that a search leaves behind.

use super::chain::{KnownSupports, Multipliers, evaluate};
use super::writer::ProofWriter;
use crate::instance::Instance;
use crate::node::Node;
use ipc_types::artefact::ProofNode;

/// How a node was split.
#[derive(Debug, Clone, PartialEq)]
pub enum Branching {
    /// By the regions of a waypoint; a list for each child.
    Waypoint(usize, Vec<Vec<usize>>),
    /// By a cut: (segment, cut).
    Cut(usize, usize),
}

/// What is remembered of a node.
#[derive(Debug, Clone, PartialEq, Default)]
struct Record {
    /// The best bound of its own, and the multipliers that give it.
    own: Option<(f64, Multipliers)>,
    children: Option<(Branching, Vec<usize>)>,
}

/// The nodes of a search. The first is the root.
#[derive(Debug, Clone, PartialEq)]
pub struct ProofTree {
    records: Vec<Record>,
}

impl Default for ProofTree {
    fn default() -> Self {
        Self { records: vec![Record::default()] }
    }
}

impl ProofTree {
    /// Remembers a bound of a node if it is better than what is known.
    pub fn bounded(&mut self, record: usize, bound: f64, multipliers: Multipliers) {
        let own = &mut self.records[record].own;
        if own.as_ref().is_none_or(|(known, _)| bound > *known) {
            *own = Some((bound, multipliers));
        }
    }

    /// Remembers how a node is split; the records of its children, in the order of the branching.
    pub fn split(&mut self, record: usize, branching: Branching, n_children: usize) -> Vec<usize> {
        let first = self.records.len();
        let children: Vec<usize> = (first..first + n_children).collect();
        self.records.resize(first + n_children, Record::default());
        self.records[record].children = Some((branching, children.clone()));
        children
    }

    /// The nodes that prove `bound` for `n_grasps` grasps, in preorder: a node whose own bound suffices is a leaf.
    pub fn nodes(
        &self,
        instance: &Instance,
        n_grasps: usize,
        bound: f64,
        writer: &mut ProofWriter,
    ) -> Vec<ProofNode> {
        let mut nodes = Vec::new();
        let mut stack = vec![(Node::root(instance, n_grasps), 0)];
        while let Some((mut node, record)) = stack.pop() {
            let record = &self.records[record];
            let has_chain = node.propagate(instance);
            match (&record.own, &record.children) {
                _ if !has_chain || bound <= 0.0 => nodes.push(ProofNode::Leaf(None)),
                (Some((own, multipliers)), _) if *own >= bound => {
                    let mut known = KnownSupports::new();
                    let value = evaluate(instance, &node.allowed, &node.exits, multipliers, &mut known);
                    nodes.push(ProofNode::Leaf(Some(writer.bound(multipliers, &value))));
                }
                (_, Some((branching, children))) => {
                    nodes.push(writer.branching(branching));
                    let parts = node.parts(instance, branching);
                    stack.extend(parts.into_iter().zip(children.iter().copied()).rev());
                }
                // The bound of a node above it, which is a leaf then.
                _ => nodes.push(ProofNode::Leaf(None)),
            }
        }
        nodes
    }
}
