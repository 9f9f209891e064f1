//! Cells: boxes of configurations, and the tree that they form.

use ipc_types::artefact::Cell;

/// A box of configurations; all coordinates, also those that the pair does not depend on.
#[derive(Debug, Clone, PartialEq)]
pub struct CellBox {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
}

impl CellBox {
    /// Centre of coordinate `j`, as a verifier computes it.
    #[inline]
    pub fn center(&self, j: usize) -> f64 {
        0.5 * self.lower[j] + 0.5 * self.upper[j]
    }

    /// Half-width of coordinate `j` about the centre.
    #[inline]
    pub fn half(&self, j: usize) -> f64 {
        let center = self.center(j);
        (self.upper[j] - center).max(center - self.lower[j])
    }

    /// The centre.
    pub fn centers(&self) -> Vec<f64> {
        (0..self.lower.len()).map(|j| self.center(j)).collect()
    }
}

/// A binary tree of cells, grown in any order.
#[derive(Debug, Clone)]
pub struct CellTree {
    nodes: Vec<Node>,
}

#[derive(Debug, Clone)]
enum Node {
    Open,
    Split { coordinate: usize, at: f64, children: [usize; 2] },
    Leaf(Cell),
}

impl CellTree {
    /// One open cell, node 0.
    pub fn new() -> Self {
        Self { nodes: vec![Node::Open] }
    }

    /// Splits the open cell `node`; returns the nodes of the lower and the upper part.
    pub fn split(&mut self, node: usize, coordinate: usize, at: f64) -> [usize; 2] {
        let children = [self.nodes.len(), self.nodes.len() + 1];
        self.nodes.extend([Node::Open, Node::Open]);
        self.nodes[node] = Node::Split { coordinate, at, children };
        children
    }

    /// Closes the open cell `node`.
    pub fn close(&mut self, node: usize, leaf: Cell) {
        self.nodes[node] = Node::Leaf(leaf);
    }

    /// The nodes in preorder; `None` while a cell is open.
    pub fn preorder(&self) -> Option<Vec<Cell>> {
        let mut cells = Vec::with_capacity(self.nodes.len());
        let mut stack = vec![0];
        while let Some(node) = stack.pop() {
            match &self.nodes[node] {
                Node::Open => return None,
                Node::Leaf(leaf) => cells.push(leaf.clone()),
                Node::Split { coordinate, at, children } => {
                    cells.push(Cell::Split { coordinate: *coordinate as u16, at: *at });
                    stack.extend([children[1], children[0]]);
                }
            }
        }
        Some(cells)
    }
}
