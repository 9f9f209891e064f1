//! The shortest path in the graph of one segment, with a proven lower bound: relaxation, rounding, restriction, and
//! branch and bound over the edges while a gap is left.

use crate::detour::detour_bound;
use crate::first_path::{first_path, locally_shortest};
use crate::leaf_graph::LeafGraph;
use crate::options::Options;
use crate::path::Path;
use crate::relaxation::{FlowEdge, flow_edges, relax};
use crate::restriction::shortest_through;
use crate::rounding::round;
use convex_sets::HPolyhedron;
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

/// A flow this near to 0 or 1 counts as decided. Erring side: a larger value stops branching early, with the gap
/// that is left reported.
const TOL_INTEGRAL: f64 = 1e-4;

/// A path and what is proven about shorter ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Verified path.
    pub path: Path,
    /// Proven: no path inside the leaf of these regions is shorter. At most the path's length.
    pub lower_bound: f64,
    /// Relaxations that were solved.
    pub n_relaxations: usize,
}

/// A set of edges that is still to be looked at, and a bound for the paths over them.
struct Node {
    bound: f64,
    alive: Vec<bool>,
}

/// The shortest path from the start to `g`; `None` if none was found that could be verified. `cancelled` ends the
/// search early, with the bound that holds until then.
pub fn search(
    graph: &LeafGraph,
    g: &DVector<f64>,
    free: &[Option<HPolyhedron>],
    options: &Options,
    rng: &mut ChaCha8Rng,
    cancelled: &dyn Fn() -> bool,
) -> Option<Found> {
    let straight = straight_bound(&graph.frame.s, g);
    let mut incumbent = first_path(graph, g, free);
    let edges = flow_edges(graph);
    let close_enough = |incumbent: &Option<Path>| match incumbent {
        Some(path) => path.length() * (1.0 - options.tol_gap),
        None => f64::INFINITY,
    };
    let (alive, mut closed_bound) = pruned(graph, &edges, close_enough(&incumbent), straight);
    let mut nodes = vec![Node { bound: straight, alive }];
    let mut n_relaxations = 0;
    let mut tried: BTreeSet<Vec<usize>> = BTreeSet::new();
    // The node with the least bound first; ties by age.
    while let Some(next) = (0..nodes.len()).min_by(|&a, &b| nodes[a].bound.total_cmp(&nodes[b].bound)) {
        if nodes[next].bound >= close_enough(&incumbent) || n_relaxations >= options.max_nodes || cancelled()
        {
            break;
        }
        let mut node = nodes.remove(next);
        if !drop_dead_ends(&edges, graph.vertices.len(), &mut node.alive) {
            continue;
        }
        let relaxation = relax(graph, &edges, &node.alive);
        n_relaxations += 1;
        node.bound = node.bound.max(relaxation.bound);
        if node.bound >= close_enough(&incumbent) {
            closed_bound = closed_bound.min(node.bound);
            continue;
        }
        for vertices in round(&edges, &relaxation.flows, graph.vertices.len(), options.n_roundings, rng) {
            if !tried.insert(vertices.clone()) {
                continue;
            }
            if let Some(path) = shortest_through(graph, &vertices, g, free)
                && incumbent.as_ref().is_none_or(|best| path.length() < best.length())
            {
                incumbent = Some(locally_shortest(graph, vertices, path, g, free));
            }
        }
        if node.bound >= close_enough(&incumbent) {
            closed_bound = closed_bound.min(node.bound);
            continue;
        }
        match most_fractional(&relaxation.flows, &node.alive) {
            Some(edge) => {
                let (without, with) = branches(&edges, &node.alive, edge);
                nodes.push(Node { bound: node.bound, alive: without });
                nodes.push(Node { bound: node.bound, alive: with });
            }
            // Nothing to branch on: the gap stays.
            None => closed_bound = closed_bound.min(node.bound),
        }
    }
    let open_bound = nodes.iter().map(|node| node.bound).fold(closed_bound, f64::min);
    let path = incumbent?;
    let lower_bound = open_bound.max(straight).min(path.length());
    Some(Found { path, lower_bound, n_relaxations })
}

/// ‖g − s‖ rounded down: no path is shorter.
pub fn straight_bound(s: &DVector<f64>, g: &DVector<f64>) -> f64 {
    let mut squares = conic::RoundedSum::default();
    for (a, b) in s.iter().zip(g) {
        let difference = (b - a).abs().next_down().max(0.0);
        squares.add_product(difference, difference);
    }
    squares.lower().max(0.0).sqrt().next_down().max(0.0)
}

/// Edges left after those are dropped whose use makes a path at least `enough` long, and the least bound of those
/// that were dropped.
fn pruned(graph: &LeafGraph, edges: &[FlowEdge], enough: f64, straight: f64) -> (Vec<bool>, f64) {
    let mut alive = vec![true; edges.len()];
    let mut dropped_bound = f64::INFINITY;
    if enough <= straight || !enough.is_finite() {
        return (alive, dropped_bound);
    }
    let too_long = |bound: f64, dropped_bound: &mut f64| {
        let drop = bound >= enough;
        if drop {
            *dropped_bound = dropped_bound.min(bound);
        }
        drop
    };
    let dropped_vertices: Vec<bool> = graph
        .vertices
        .iter()
        .map(|vertex| too_long(detour_bound(graph, &[&vertex.polytope]), &mut dropped_bound))
        .collect();
    let is_dropped = |v: Option<usize>| v.is_some_and(|v| dropped_vertices[v]);
    for (alive, edge) in alive.iter_mut().zip(edges) {
        *alive = !is_dropped(edge.enters()) && !is_dropped(edge.leaves());
    }
    let mut dropped_overlaps = BTreeSet::new();
    for &(a, b) in graph.overlaps.keys().filter(|&&(a, b)| !dropped_vertices[a] && !dropped_vertices[b]) {
        let bound = detour_bound(graph, &[&graph.vertices[a].polytope, &graph.vertices[b].polytope]);
        if too_long(bound, &mut dropped_bound) {
            dropped_overlaps.insert((a, b));
        }
    }
    for (alive, edge) in alive.iter_mut().zip(edges) {
        if let FlowEdge::Between { from, to } = *edge {
            *alive &= !dropped_overlaps.contains(&(from.min(to), from.max(to)));
        }
    }
    (alive, dropped_bound)
}

/// Drops edges that lie on no way from the start to the goal; false if none is left.
fn drop_dead_ends(edges: &[FlowEdge], n_vertices: usize, alive: &mut [bool]) -> bool {
    let spread = |alive: &[bool], forward: bool| {
        let mut marked = vec![false; n_vertices];
        loop {
            let mut grew = false;
            for (edge, _) in edges.iter().zip(alive).filter(|&(_, &alive)| alive) {
                let (from, to) =
                    if forward { (edge.leaves(), edge.enters()) } else { (edge.enters(), edge.leaves()) };
                if from.is_none_or(|v| marked[v])
                    && let Some(to) = to
                    && !marked[to]
                {
                    marked[to] = true;
                    grew = true;
                }
            }
            if !grew {
                return marked;
            }
        }
    };
    let from_start = spread(alive, true);
    let to_goal = spread(alive, false);
    for (alive, edge) in alive.iter_mut().zip(edges) {
        *alive &= edge.leaves().is_none_or(|v| from_start[v] && to_goal[v])
            && edge.enters().is_none_or(|v| from_start[v] && to_goal[v]);
    }
    edges.iter().zip(alive.iter()).any(|(edge, &alive)| alive && edge.enters().is_none())
}

/// The edge whose flow is farthest from 0 and 1.
fn most_fractional(flows: &[f64], alive: &[bool]) -> Option<usize> {
    let distance = |e: usize| flows[e].min(1.0 - flows[e]);
    (0..flows.len())
        .rev()
        .filter(|&e| alive[e] && distance(e) > TOL_INTEGRAL)
        .max_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}

/// Two sets of edges that together hold every path: without `edge`, and with it, that is without all others that
/// leave the vertex it leaves or enter the vertex it enters.
fn branches(edges: &[FlowEdge], alive: &[bool], edge: usize) -> (Vec<bool>, Vec<bool>) {
    let mut without = alive.to_vec();
    without[edge] = false;
    let chosen = edges[edge];
    let with = edges
        .iter()
        .zip(alive)
        .enumerate()
        .map(|(e, (other, &alive))| {
            // Start and goal are vertices too: their only edge is the chosen one.
            let conflicts = other.leaves() == chosen.leaves() || other.enters() == chosen.enters();
            alive && (e == edge || !conflicts)
        })
        .collect();
    (without, with)
}
