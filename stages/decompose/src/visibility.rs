//! The visibility graph: free samples, joined where the straight edge between them is free (thesis 2, definition 10).
//!
//! Edges are tested continuously, by the second-order bound of `collision::edge`, not at fixed steps.

use nalgebra::DVector;

use crate::domain::Domain;
use crate::parallel::for_each;
use crate::vertex_set::VertexSet;

/// An undirected graph without loops.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct VisibilityGraph {
    neighbors: Vec<VertexSet>,
}

impl VisibilityGraph {
    /// Joins the free `points` of `domain` that see each other; the same on any number of `threads`.
    pub(crate) fn new(domain: &Domain<'_>, points: &[DVector<f64>], threads: usize) -> Self {
        let n = points.len();
        let rows = for_each(n, threads, &|| false, &|i| {
            let seen = (i + 1..n).filter(|&j| domain.edge_is_free(&points[i], &points[j]));
            Some(seen.collect::<Vec<usize>>())
        });
        let edges =
            rows.into_iter().flatten().enumerate().flat_map(|(i, row)| row.into_iter().map(move |j| (i, j)));
        Self::from_edges(n, &edges.collect::<Vec<_>>())
    }

    /// The graph with these edges on `n` vertices.
    pub(crate) fn from_edges(n: usize, edges: &[(usize, usize)]) -> Self {
        let mut neighbors = vec![VertexSet::empty(n); n];
        for &(i, j) in edges {
            neighbors[i].insert(j);
            neighbors[j].insert(i);
        }
        Self { neighbors }
    }

    pub(crate) fn n_vertices(&self) -> usize {
        self.neighbors.len()
    }

    /// What `vertex` sees.
    pub(crate) fn neighbors(&self, vertex: usize) -> &VertexSet {
        &self.neighbors[vertex]
    }

    #[cfg(test)]
    pub(crate) fn sees(&self, i: usize, j: usize) -> bool {
        self.neighbors[i].contains(j)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::Coordinates;
    use collision::CollisionChecker;
    use convex_sets::Hyperrectangle;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// In `slider-gap` what collides is two rectangles: who sees whom is known exactly.
    #[test]
    fn edges_of_a_plane_with_two_rectangles() {
        let scene = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/slider-gap");
        let scene = scene::Scene::load(&scene).unwrap();
        let checker = CollisionChecker::new(&scene);
        let limits = Hyperrectangle { lower: scene.lower(), upper: scene.upper() };
        let coordinates = Coordinates::new(limits.clone(), &[true, true]);
        let domain = Domain::new(&coordinates, &checker, &DVector::from_element(2, 1.0), &limits);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut points = Vec::new();
        while points.len() < 60 {
            let u = DVector::from_fn(2, |_, _| 2.0 * rng.random::<f64>() - 1.0);
            if domain.is_free(&u) {
                points.push(u);
            }
        }
        let graph = VisibilityGraph::new(&domain, &points, 1);
        assert_eq!(graph, VisibilityGraph::new(&domain, &points, 3));
        // u = (slide, 2 lift): the segment meets |slide| ≤ 0.2 with lift beyond ±0.1 iff it does at an end of its part
        // within |slide| ≤ 0.2.
        let free = |p: &DVector<f64>, q: &DVector<f64>| {
            let cut = |x: f64| if p[0] == q[0] { 0.0 } else { ((x - p[0]) / (q[0] - p[0])).clamp(0.0, 1.0) };
            let at = |t: f64| (p[0] + t * (q[0] - p[0]), 0.5 * (p[1] + t * (q[1] - p[1])));
            [0.0, 1.0, cut(-0.2), cut(0.2)]
                .into_iter()
                .map(at)
                .all(|(x, z)| x.abs() > 0.2 - 1e-12 || z.abs() < 0.1)
                && [cut(-0.2), cut(0.2)]
                    .into_iter()
                    .map(at)
                    .all(|(x, z)| (x.abs() - 0.2).abs() > 1e-9 || z.abs() < 0.1)
        };
        let (mut n_edges, mut n_pairs) = (0, 0);
        for i in 0..points.len() {
            for j in 0..i {
                n_pairs += 1;
                n_edges += usize::from(graph.sees(i, j));
                assert_eq!(graph.sees(i, j), free(&points[i], &points[j]), "{} {}", points[i], points[j]);
            }
        }
        assert!(n_edges > n_pairs / 4 && n_edges < 3 * n_pairs / 4, "{n_edges} of {n_pairs}");
    }
}
