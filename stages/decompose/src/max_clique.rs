//! Large cliques: greedily with swaps, and the largest by branch and bound.
//!
//! A greedy clique takes the candidate that keeps most other candidates, until none is left. A *swap* gives one member
//! for two vertices that see each other and all other members; it is repeated while there is one (the 2-opt
//! neighbourhood of Katayama, Hamamoto & Narihisa 2005). Branch and bound (Tomita & Seki 2003) colours the candidates
//! greedily: a clique has at most one vertex of each colour, so a branch ends where the colours left cannot make the
//! clique larger than the best.

use crate::vertex_set::VertexSet;
use crate::visibility::VisibilityGraph;

/// Branches after which the best clique so far is taken: a bound that does not depend on the machine.
const MAX_BRANCHES: usize = 20_000;

/// A clique among `vertices` (not empty) that no other of them can join, and no swap enlarges; sorted.
pub(crate) fn greedy_clique(graph: &VisibilityGraph, vertices: &VertexSet) -> Vec<usize> {
    let mut clique = Vec::new();
    let mut candidates = vertices.clone();
    while let Some(vertex) = most_visible(graph, &candidates) {
        clique.push(vertex);
        candidates.keep(graph.neighbors(vertex));
    }
    while let Some((out, pair)) = swap(graph, vertices, &clique) {
        clique.retain(|&member| member != out);
        clique.extend(pair);
        // Others may fit now.
        let mut candidates = common_neighbors(graph, vertices, &clique);
        while let Some(vertex) = most_visible(graph, &candidates) {
            clique.push(vertex);
            candidates.keep(graph.neighbors(vertex));
        }
    }
    clique.sort_unstable();
    clique
}

/// The largest clique among `vertices` (not empty), sorted, if branch and bound ends within its budget; otherwise the
/// best that it found, which is at least as large as the greedy one.
pub(crate) fn largest_clique(graph: &VisibilityGraph, vertices: &VertexSet) -> Vec<usize> {
    let mut search =
        Search { graph, best: greedy_clique(graph, vertices), clique: Vec::new(), n_branches: 0 };
    search.expand(vertices.clone());
    search.best.sort_unstable();
    search.best
}

/// The candidate that sees most others; of equals the first.
fn most_visible(graph: &VisibilityGraph, candidates: &VertexSet) -> Option<usize> {
    let mut best: Option<(usize, usize)> = None;
    for vertex in candidates.iter() {
        let n_seen = graph.neighbors(vertex).n_common(candidates);
        if best.is_none_or(|(most, _)| n_seen > most) {
            best = Some((n_seen, vertex));
        }
    }
    best.map(|(_, vertex)| vertex)
}

fn common_neighbors(graph: &VisibilityGraph, vertices: &VertexSet, clique: &[usize]) -> VertexSet {
    let mut common = vertices.clone();
    for &member in clique {
        common.keep(graph.neighbors(member));
    }
    common
}

/// A member to give for two vertices that see each other and all other members.
fn swap(graph: &VisibilityGraph, vertices: &VertexSet, clique: &[usize]) -> Option<(usize, [usize; 2])> {
    for &out in clique {
        let others: Vec<usize> = clique.iter().copied().filter(|&member| member != out).collect();
        let mut free = common_neighbors(graph, vertices, &others);
        free.remove(out);
        for first in free.iter() {
            if let Some(second) = free.and(graph.neighbors(first)).first() {
                return Some((out, [first, second]));
            }
        }
    }
    None
}

struct Search<'a> {
    graph: &'a VisibilityGraph,
    best: Vec<usize>,
    clique: Vec<usize>,
    n_branches: usize,
}

impl Search<'_> {
    /// All cliques that extend the present one by `candidates`.
    fn expand(&mut self, mut candidates: VertexSet) {
        let colored = self.colors(&candidates);
        // Highest colours first: when their bound fails, so do all that follow.
        for &(vertex, n_colors) in colored.iter().rev() {
            if self.clique.len() + n_colors <= self.best.len() || self.n_branches >= MAX_BRANCHES {
                return;
            }
            self.n_branches += 1;
            self.clique.push(vertex);
            let next = candidates.and(self.graph.neighbors(vertex));
            if !next.is_empty() {
                self.expand(next);
            } else if self.clique.len() > self.best.len() {
                self.best = self.clique.clone();
            }
            self.clique.pop();
            candidates.remove(vertex);
        }
    }

    /// The candidates with the number of colours used up to each, in the order of colours.
    fn colors(&self, candidates: &VertexSet) -> Vec<(usize, usize)> {
        let mut left = candidates.clone();
        let mut colored = Vec::with_capacity(left.len());
        let mut n_colors = 0;
        while !left.is_empty() {
            n_colors += 1;
            // One colour: vertices that do not see each other.
            let mut open = left.clone();
            while let Some(vertex) = open.first() {
                open.remove(vertex);
                open.drop_all(self.graph.neighbors(vertex));
                left.remove(vertex);
                colored.push((vertex, n_colors));
            }
        }
        colored
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn graph(n: usize, edges: &[bool]) -> VisibilityGraph {
        let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
        let edges: Vec<(usize, usize)> =
            pairs.zip(edges).filter(|(_, edge)| **edge).map(|(pair, _)| pair).collect();
        VisibilityGraph::from_edges(n, &edges)
    }

    fn is_clique(graph: &VisibilityGraph, clique: &[usize]) -> bool {
        clique.iter().enumerate().all(|(k, &i)| clique[..k].iter().all(|&j| graph.sees(i, j)))
    }

    /// Size of the largest clique among `vertices`, over all subsets.
    fn brute_force(graph: &VisibilityGraph, vertices: &VertexSet) -> usize {
        let vertices: Vec<usize> = vertices.iter().collect();
        let subset = |bits: u32| -> Vec<usize> {
            (0..vertices.len()).filter(|k| bits >> k & 1 == 1).map(|k| vertices[k]).collect()
        };
        (0..1u32 << vertices.len())
            .map(subset)
            .filter(|clique| is_clique(graph, clique))
            .map(|clique| clique.len())
            .max()
            .unwrap_or(0)
    }

    proptest! {
        #[test]
        fn the_largest_clique_is_that_of_brute_force(
            n in 1..12_usize,
            edges in prop::collection::vec(prop::bool::weighted(0.6), 66),
            left_out in 0..12_usize,
        ) {
            let graph = graph(n, &edges);
            let mut vertices = VertexSet::all(n);
            if left_out < n && n > 1 {
                vertices.remove(left_out);
            }
            let most = brute_force(&graph, &vertices);
            let (exact, greedy) = (largest_clique(&graph, &vertices), greedy_clique(&graph, &vertices));
            prop_assert_eq!(exact.len(), most);
            for clique in [exact, greedy] {
                prop_assert!(is_clique(&graph, &clique) && clique.is_sorted());
                prop_assert!(clique.iter().all(|&vertex| vertices.contains(vertex)));
                prop_assert!(common_neighbors(&graph, &vertices, &clique).is_empty(), "not maximal");
                prop_assert!(swap(&graph, &vertices, &clique).is_none());
            }
        }
    }

    /// The vertex that sees most is in no large clique: greed alone starts there, and ends with an edge.
    #[test]
    fn a_swap_finds_what_greed_misses() {
        // A square 0-1-2-3 with both diagonals is a clique of 4; 4 sees 0, 5, 6, 7, 8, which see no one else.
        let mut edges = vec![(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        edges.extend([0, 5, 6, 7, 8].map(|other| (4, other)));
        let graph = VisibilityGraph::from_edges(9, &edges);
        assert_eq!(greedy_clique(&graph, &VertexSet::all(9)), [0, 1, 2, 3]);
    }

    /// A graph of 200 vertices in 10 classes without edges inside: cliques of 10, by colours at once.
    #[test]
    fn complete_multipartite_graphs_are_easy() {
        let edges: Vec<(usize, usize)> =
            (0..200).flat_map(|i| (0..i).map(move |j| (i, j))).filter(|(i, j)| i % 10 != j % 10).collect();
        let graph = VisibilityGraph::from_edges(200, &edges);
        assert_eq!(largest_clique(&graph, &VertexSet::all(200)).len(), 10);
    }
}
