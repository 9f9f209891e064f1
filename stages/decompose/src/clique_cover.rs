//! Covers a visibility graph with cliques (Werner et al. 2023; thesis 2, definition 11): the largest one first, then the
//! largest among the vertices that are left, and so on.

use convex_sets::{Hyperellipsoid, min_enclosing_ellipsoid};
use nalgebra::DVector;

use crate::domain::Domain;
use crate::max_clique::{greedy_clique, largest_clique};
use crate::seed::Seed;
use crate::vertex_set::VertexSet;
use crate::visibility::VisibilityGraph;

/// Shortest half-axis of a clique's ellipsoid, in units of the domain.
const LEAST_HALF_AXIS: f64 = 0.01;

/// Disjoint cliques that cover all vertices, largest first, each sorted. While at most `max_exact` vertices are left,
/// the clique taken is the largest there is; with more it is a greedy one with swaps.
pub(crate) fn clique_cover(graph: &VisibilityGraph, max_exact: usize) -> Vec<Vec<usize>> {
    let mut left = VertexSet::all(graph.n_vertices());
    let mut cliques = Vec::new();
    while !left.is_empty() {
        let clique = match left.len() <= max_exact {
            true => largest_clique(graph, &left),
            false => greedy_clique(graph, &left),
        };
        clique.iter().for_each(|&vertex| left.remove(vertex));
        cliques.push(clique);
    }
    cliques.sort_by_key(|clique| std::cmp::Reverse(clique.len()));
    cliques
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
        for max_exact in [0, 4] {
            assert_eq!(clique_cover(&graph, max_exact), vec![vec![0, 1, 2], vec![3]]);
        }
    }

    #[test]
    fn no_edges_no_vertices_and_all_edges() {
        assert_eq!(clique_cover(&VisibilityGraph::from_edges(2, &[]), 9), vec![vec![0], vec![1]]);
        assert!(clique_cover(&VisibilityGraph::from_edges(0, &[]), 9).is_empty());
        let edges: Vec<(usize, usize)> = (0..5).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
        assert_eq!(clique_cover(&VisibilityGraph::from_edges(5, &edges), 9), vec![vec![0, 1, 2, 3, 4]]);
    }

    #[test]
    fn cliques_are_maximal_among_what_is_left() {
        // A star: the center sees all, the leaves see no one else.
        let graph = VisibilityGraph::from_edges(4, &[(0, 1), (0, 2), (0, 3)]);
        for max_exact in [0, 4] {
            let cover = clique_cover(&graph, max_exact);
            assert_eq!(cover[0], vec![0, 1]);
            assert_eq!(cover.len(), 3);
        }
    }

    /// Random graphs: a partition into cliques, and the exact one starts with a clique at least as large.
    #[test]
    fn covers_are_partitions_into_cliques() {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for n in [1, 7, 40, 130] {
            let edges: Vec<(usize, usize)> = (0..n)
                .flat_map(|i| (0..i).map(move |j| (i, j)))
                .filter(|_| rng.random::<f64>() < 0.5)
                .collect();
            let graph = VisibilityGraph::from_edges(n, &edges);
            let covers = [clique_cover(&graph, 0), clique_cover(&graph, 200)];
            assert!(covers[1][0].len() >= covers[0][0].len());
            for cover in covers {
                let mut vertices: Vec<usize> = cover.concat();
                vertices.sort_unstable();
                assert!(vertices.into_iter().eq(0..n));
                for clique in cover {
                    for (k, &i) in clique.iter().enumerate() {
                        assert!(clique[..k].iter().all(|&j| graph.sees(i, j)));
                    }
                }
            }
        }
    }
}
