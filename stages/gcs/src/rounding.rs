//! Paths from the flows of the relaxation.

use crate::relaxation::FlowEdge;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

/// Paths, as lists of vertices, that the flows suggest: first the greedy one, then `n_roundings` drawn at random with
/// the flows as probabilities, each once (Marcucci et al. 2023, randomised depth-first search without a way back).
pub fn round(
    edges: &[FlowEdge],
    flows: &[f64],
    n_vertices: usize,
    n_roundings: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Vec<usize>> {
    let mut paths: Vec<Vec<usize>> = Vec::new();
    let mut seen = BTreeSet::new();
    for draw in 0..=n_roundings {
        let path = walk(edges, n_vertices, |out: &[usize]| {
            if draw == 0 {
                // The first of the largest.
                return (0..out.len()).rev().max_by(|&a, &b| flows[out[a]].total_cmp(&flows[out[b]]));
            }
            let total: f64 = out.iter().map(|&e| flows[e]).sum();
            if total <= TOL_FLOW {
                return None;
            }
            let mut rest = rng.random::<f64>() * total;
            out.iter().position(|&e| {
                rest -= flows[e];
                rest < 0.0
            })
        });
        if let Some(path) = path
            && seen.insert(path.clone())
        {
            paths.push(path);
        }
    }
    paths
}

/// Flows whose sum is below this are noise of the solver. Erring side: a larger value ends draws early.
const TOL_FLOW: f64 = 1e-6;

/// Walks from the start along the edges that `choose` picks among those to vertices not yet visited, and back where
/// there is none, until the goal.
fn walk(
    edges: &[FlowEdge],
    n_vertices: usize,
    mut choose: impl FnMut(&[usize]) -> Option<usize>,
) -> Option<Vec<usize>> {
    let mut visited = vec![false; n_vertices];
    let mut path: Vec<usize> = Vec::new();
    loop {
        let at = path.last().copied();
        let out: Vec<usize> = (0..edges.len())
            .filter(|&e| edges[e].leaves() == at && edges[e].enters().is_none_or(|to| !visited[to]))
            .collect();
        match (choose(&out).map(|position| edges[out[position]]), at) {
            (Some(FlowEdge::Goal { .. }), Some(_)) => return Some(path),
            (Some(edge), _) => {
                let to = edge.enters()?;
                visited[to] = true;
                path.push(to);
            }
            (None, Some(_)) => {
                path.pop();
            }
            (None, None) => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// start → 0 → {1, 2} → 3 → goal, and a dead end 4.
    fn diamond() -> Vec<FlowEdge> {
        vec![
            FlowEdge::Start { to: 0 },
            FlowEdge::Between { from: 0, to: 4 },
            FlowEdge::Between { from: 0, to: 1 },
            FlowEdge::Between { from: 0, to: 2 },
            FlowEdge::Between { from: 1, to: 3 },
            FlowEdge::Between { from: 2, to: 3 },
            FlowEdge::Goal { from: 3 },
        ]
    }

    #[test]
    fn greedy_goes_first_and_leaves_dead_ends() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let paths = round(&diamond(), &[1.0, 0.5, 0.2, 0.3, 0.2, 0.3, 1.0], 5, 0, &mut rng);
        assert_eq!(paths, vec![vec![0, 2, 3]]);
    }

    #[test]
    fn draws_find_both_ways_and_repeat_for_a_seed() {
        let draw = || {
            round(&diamond(), &[1.0, 0.0, 0.5, 0.5, 0.5, 0.5, 1.0], 5, 20, &mut ChaCha8Rng::seed_from_u64(7))
        };
        let mut paths = draw();
        assert_eq!(paths, draw());
        paths.sort();
        assert_eq!(paths, vec![vec![0, 1, 3], vec![0, 2, 3]]);
    }

    #[test]
    fn no_way_is_no_path() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let edges = [FlowEdge::Start { to: 0 }, FlowEdge::Goal { from: 1 }];
        assert!(round(&edges, &[1.0, 1.0], 2, 3, &mut rng).is_empty());
    }
}
