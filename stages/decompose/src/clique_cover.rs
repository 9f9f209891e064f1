//! Covers a visibility graph with cliques (Werner et al. 2023; thesis 2, definition 11), greedily: from the vertex
//! with most neighbours left, the clique takes the candidate that keeps most other candidates, until none is left.

use convex_sets::{Hyperellipsoid, min_enclosing_ellipsoid};
use nalgebra::DVector;

use crate::domain::Domain;
use crate::seed::Seed;
use crate::visibility::VisibilityGraph;

/// Shortest half-axis of a clique's ellipsoid, in units of the domain.
const LEAST_HALF_AXIS: f64 = 0.01;

/// Disjoint cliques that cover all vertices, largest first, each sorted.
pub(crate) fn clique_cover(graph: &VisibilityGraph) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..graph.n_vertices()).collect();
    let mut cliques = Vec::new();
    while !left.is_empty() {
        let clique = greedy_clique(graph, &left);
        left.retain(|vertex| clique.binary_search(vertex).is_err());
        cliques.push(clique);
    }
    cliques.sort_by_key(|clique| std::cmp::Reverse(clique.len()));
    cliques
}

/// A clique among `vertices` (not empty) that no other of them can join.
fn greedy_clique(graph: &VisibilityGraph, vertices: &[usize]) -> Vec<usize> {
    let mut candidates = vertices.to_vec();
    let mut clique = Vec::new();
    while !candidates.is_empty() {
        let mut best = (candidates[0], 0);
        for (idx, &vertex) in candidates.iter().enumerate() {
            let n_kept = candidates.iter().filter(|&&other| graph.sees(vertex, other)).count();
            if idx == 0 || n_kept > best.1 {
                best = (vertex, n_kept);
            }
        }
        clique.push(best.0);
        candidates.retain(|&other| graph.sees(best.0, other));
    }
    clique.sort_unstable();
    clique
}

/// The seed of a clique: the ellipsoid around its points, about its center if that is free and `is_new` (no region
/// has it yet), else about the member nearest to it.
pub(crate) fn seed_of_clique(
    domain: &Domain<'_>,
    points: &[DVector<f64>],
    is_new: &dyn Fn(&DVector<f64>) -> bool,
) -> Option<Seed> {
    if let [point] = points {
        return Some(Seed::ball(point.clone()));
    }
    let ellipsoid = min_enclosing_ellipsoid(points, LEAST_HALF_AXIS)?;
    let witness = if domain.is_free(&ellipsoid.center) && is_new(&ellipsoid.center) {
        ellipsoid.center.clone()
    } else {
        points.iter().min_by(|p, q| ellipsoid.distance(p).total_cmp(&ellipsoid.distance(q)))?.clone()
    };
    Some(Seed::new(Hyperellipsoid { A: ellipsoid.A, center: witness.clone() }, witness))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_triangles_that_share_an_edge() {
        let graph = VisibilityGraph::from_edges(4, &[(0, 1), (0, 2), (1, 2), (1, 3), (2, 3)]);
        assert_eq!(clique_cover(&graph), vec![vec![0, 1, 2], vec![3]]);
    }

    #[test]
    fn no_edges_no_vertices_and_all_edges() {
        assert_eq!(clique_cover(&VisibilityGraph::from_edges(2, &[])), vec![vec![0], vec![1]]);
        assert!(clique_cover(&VisibilityGraph::from_edges(0, &[])).is_empty());
        let edges: Vec<(usize, usize)> = (0..5).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        assert_eq!(clique_cover(&VisibilityGraph::from_edges(5, &edges)), vec![vec![0, 1, 2, 3, 4]]);
    }

    #[test]
    fn cliques_are_maximal_among_what_is_left() {
        // A star: the center sees all, the leaves see no one else.
        let graph = VisibilityGraph::from_edges(4, &[(0, 1), (0, 2), (0, 3)]);
        let cover = clique_cover(&graph);
        assert_eq!(cover[0], vec![0, 1]);
        assert_eq!(cover.len(), 3);
    }
}
