//! The visibility graph: free samples, joined where the straight edge between them is free (thesis 2, definition 10).

use nalgebra::DVector;

use crate::domain::Domain;

/// An undirected graph without loops.
#[derive(Debug, Clone)]
pub(crate) struct VisibilityGraph {
    adjacent: Vec<Vec<bool>>,
}

impl VisibilityGraph {
    /// Joins the free `points` of `domain` that see each other.
    pub(crate) fn new(domain: &Domain<'_>, points: &[DVector<f64>]) -> Self {
        let mut adjacent = vec![vec![false; points.len()]; points.len()];
        for i in 0..points.len() {
            for j in i + 1..points.len() {
                let sees = domain.edge_is_free(&points[i], &points[j]);
                adjacent[i][j] = sees;
                adjacent[j][i] = sees;
            }
        }
        Self { adjacent }
    }

    /// The graph with these edges on `n` vertices.
    #[cfg(test)]
    pub(crate) fn from_edges(n: usize, edges: &[(usize, usize)]) -> Self {
        let mut adjacent = vec![vec![false; n]; n];
        for &(i, j) in edges {
            adjacent[i][j] = true;
            adjacent[j][i] = true;
        }
        Self { adjacent }
    }

    pub(crate) fn n_vertices(&self) -> usize {
        self.adjacent.len()
    }

    pub(crate) fn sees(&self, i: usize, j: usize) -> bool {
        self.adjacent[i][j]
    }
}
