//! The convex relaxation of the shortest path in the graph of convex sets.
//!
//! Every edge e has a flow y_e ∈ [0, 1]; an edge (u, v) between vertices carries y_e times the point where the path
//! passes from u to v, z_e, and y_e times the point where it leaves v again, w_e:
//!
//! ```text
//! min  Σ_e ‖B (w_e − z_e)‖
//! s.t. Σ_in y_e = Σ_out y_e ≤ 1          at each vertex; one unit leaves the start
//!      Σ_in w_e = Σ_out z_e              at each vertex; z = 0 at the start, z = y u_goal at the goal
//!      z_e ∈ y_e (P_u ∩ P_v),  w_e ∈ y_e P_v                              (perspectives)
//! ```
//!
//! With y ∈ {0, 1} this is the shortest path; its convex relaxation bounds from below the length of any path inside
//! the leaf, since a shortest path in a union of convex sets visits each set at most once and is straight inside
//! (Marcucci et al. 2023, with the cost of a vertex charged to the edge that enters it).

use crate::leaf_graph::{Contact, LeafGraph};
use conic::{Affine, ConicProgram, Settings};
use convex_sets::HPolyhedron;

/// An edge of the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowEdge {
    /// From the start into a vertex that holds it.
    Start {
        /// The vertex.
        to: usize,
    },
    /// From one vertex into another.
    Between {
        /// Vertex that is left.
        from: usize,
        /// Vertex that is entered.
        to: usize,
    },
    /// From a vertex that holds the goal to the goal.
    Goal {
        /// The vertex.
        from: usize,
    },
}

impl FlowEdge {
    /// The vertex that the edge enters; `None` for the goal.
    pub fn enters(self) -> Option<usize> {
        match self {
            FlowEdge::Start { to } | FlowEdge::Between { to, .. } => Some(to),
            FlowEdge::Goal { .. } => None,
        }
    }

    /// The vertex that the edge leaves; `None` for the start.
    pub fn leaves(self) -> Option<usize> {
        match self {
            FlowEdge::Start { .. } => None,
            FlowEdge::Between { from, .. } | FlowEdge::Goal { from } => Some(from),
        }
    }
}

/// All edges that some shortest path may use. A path that enters a vertex with the start inside could have begun
/// there, one that leaves a vertex with the goal inside could have ended there, and neither would be longer.
pub fn flow_edges(graph: &LeafGraph) -> Vec<FlowEdge> {
    let mut edges = Vec::new();
    for (v, vertex) in graph.vertices.iter().enumerate() {
        if vertex.start != Contact::Outside {
            edges.push(FlowEdge::Start { to: v });
        }
        if vertex.goal != Contact::Outside {
            edges.push(FlowEdge::Goal { from: v });
        }
    }
    for &(a, b) in graph.overlaps.keys() {
        for (from, to) in [(a, b), (b, a)] {
            if graph.vertices[to].start != Contact::Inside && graph.vertices[from].goal != Contact::Inside {
                edges.push(FlowEdge::Between { from, to });
            }
        }
    }
    edges
}

/// What the relaxation says.
#[derive(Debug, Clone, PartialEq)]
pub struct Relaxation {
    /// Proven: no path over these edges is shorter. +∞ if there is none.
    pub bound: f64,
    /// Flow of each edge; 0 for edges that were left out.
    pub flows: Vec<f64>,
}

/// Positions of an edge's variables.
#[derive(Debug, Clone, Copy)]
struct EdgeVariables {
    y: usize,
    z: Option<usize>,
    w: Option<usize>,
}

/// Solves the relaxation over the edges with `alive`.
pub fn relax(graph: &LeafGraph, edges: &[FlowEdge], alive: &[bool]) -> Relaxation {
    let mut program = ConicProgram::new(0);
    let (mut lower, mut upper) = (Vec::new(), Vec::new());
    let variables: Vec<Option<EdgeVariables>> = edges
        .iter()
        .zip(alive)
        .map(|(&edge, &alive)| alive.then(|| add_edge(graph, edge, &mut program, &mut lower, &mut upper)))
        .collect();
    add_conservation(graph, edges, &variables, &mut program);
    let alive_edges = || edges.iter().zip(&variables).filter_map(|(&edge, v)| v.map(|v| (edge, v)));
    for (edge, v) in alive_edges() {
        add_membership(graph, edge, v, &mut program);
    }
    for (edge, v) in alive_edges() {
        add_length(graph, edge, v, &mut program, &mut lower, &mut upper);
    }
    let mut flows = vec![0.0; edges.len()];
    let Ok(solution) = conic::solve(&program, &Settings::default()) else {
        // Data that the solver refuses give no bound beyond the trivial one.
        return Relaxation { bound: 0.0, flows };
    };
    for (flow, v) in flows.iter_mut().zip(&variables) {
        let y = v.map_or(0.0, |v| solution.x[v.y]);
        *flow = if y.is_finite() { y.clamp(0.0, 1.0) } else { 0.0 };
    }
    let bound = if conic::safe_farkas(&program, &solution.y, &lower, &upper) {
        f64::INFINITY
    } else {
        conic::safe_lower_bound(&program, &solution.y, &solution.x, &lower, &upper).max(0.0)
    };
    Relaxation { bound, flows }
}

/// Variables y, z, w of an edge and their box: y ∈ [0, 1], z and w in y times the box of u.
fn add_edge(
    graph: &LeafGraph,
    edge: FlowEdge,
    program: &mut ConicProgram,
    lower: &mut Vec<f64>,
    upper: &mut Vec<f64>,
) -> EdgeVariables {
    let d = graph.frame.dimension();
    let y = program.add_variables(1);
    lower.push(0.0);
    upper.push(1.0);
    let mut point = || {
        lower.extend(graph.u_lower.iter().map(|l| l.min(0.0)));
        upper.extend(graph.u_upper.iter().map(|u| u.max(0.0)));
        program.add_variables(d)
    };
    let z = matches!(edge, FlowEdge::Between { .. }).then(&mut point);
    let w = edge.enters().map(|_| point());
    EdgeVariables { y, z, w }
}

fn add_conservation(
    graph: &LeafGraph,
    edges: &[FlowEdge],
    variables: &[Option<EdgeVariables>],
    program: &mut ConicProgram,
) {
    let d = graph.frame.dimension();
    let n_vertices = graph.vertices.len();
    let mut start = Vec::new();
    let mut balance = vec![Vec::new(); n_vertices];
    let mut inflow = vec![Vec::new(); n_vertices];
    let mut points = vec![vec![Vec::new(); d]; n_vertices];
    for (&edge, v) in edges.iter().zip(variables) {
        let Some(v) = *v else { continue };
        if let FlowEdge::Start { .. } = edge {
            start.push((v.y, 1.0));
        }
        if let (Some(to), Some(w)) = (edge.enters(), v.w) {
            balance[to].push((v.y, 1.0));
            inflow[to].push((v.y, 1.0));
            (0..d).for_each(|k| points[to][k].push((w + k, 1.0)));
        }
        if let Some(from) = edge.leaves() {
            balance[from].push((v.y, -1.0));
            for k in 0..d {
                points[from][k].push(match v.z {
                    Some(z) => (z + k, -1.0),
                    None => (v.y, -graph.u_goal[k]),
                });
            }
        }
    }
    program.add_equality(start, 1.0);
    for vertex_idx in 0..n_vertices {
        if balance[vertex_idx].is_empty() {
            continue;
        }
        program.add_equality(std::mem::take(&mut balance[vertex_idx]), 0.0);
        for (k, terms) in std::mem::take(&mut points[vertex_idx]).into_iter().enumerate() {
            let row = program.add_equality(terms, 0.0);
            // The goal's coordinate was rounded once; its flow is at most 1.
            program.set_tolerance(row, f64::EPSILON * graph.u_goal[k].abs());
        }
    }
    for terms in inflow {
        if terms.len() > 1 {
            program.add_less_equal(terms, 1.0);
        }
    }
}

fn add_membership(graph: &LeafGraph, edge: FlowEdge, v: EdgeVariables, program: &mut ConicProgram) {
    let mut within = |P: &HPolyhedron, point: usize| {
        for row_idx in 0..P.n_faces() {
            let mut terms: Vec<(usize, f64)> = P.A.row(row_idx).iter().copied().enumerate().collect();
            terms.retain(|&(_, a)| a != 0.0);
            terms.iter_mut().for_each(|(k, _)| *k += point);
            terms.push((v.y, -P.b[row_idx]));
            program.add_less_equal(terms, 0.0);
        }
    };
    if let (FlowEdge::Between { from, to }, Some(z)) = (edge, v.z) {
        within(&graph.vertices[from].polytope, z);
        within(&graph.vertices[to].polytope, z);
        within(&graph.slab, z);
    }
    if let (Some(to), Some(w)) = (edge.enters(), v.w) {
        within(&graph.vertices[to].polytope, w);
        within(&graph.slab, w);
    }
    program.add_less_equal(vec![(v.y, -1.0)], 0.0);
}

fn add_length(
    graph: &LeafGraph,
    edge: FlowEdge,
    v: EdgeVariables,
    program: &mut ConicProgram,
    lower: &mut Vec<f64>,
    upper: &mut Vec<f64>,
) {
    let (d, B) = (graph.frame.dimension(), &graph.frame.B);
    let Some(w) = v.w.filter(|_| edge.enters().is_some()) else { return };
    let length = program.add_variables(1);
    program.add_linear_cost(length, 1.0);
    lower.push(0.0);
    upper.push(diameter(graph));
    let parts = (0..B.nrows()).map(|j| {
        let mut terms = Vec::new();
        for k in (0..d).filter(|&k| B[(j, k)] != 0.0) {
            terms.push((w + k, B[(j, k)]));
            if let Some(z) = v.z {
                terms.push((z + k, -B[(j, k)]));
            }
        }
        Affine::new(terms, 0.0)
    });
    let parts = parts.filter(|form| !form.terms.is_empty()).collect();
    program.add_second_order_cone(Affine::variable(length), parts);
}

/// At least the length of any straight line within the box of u, rounded up.
fn diameter(graph: &LeafGraph) -> f64 {
    let B = &graph.frame.B;
    let sides: Vec<f64> = (0..B.nrows())
        .map(|j| {
            let mut side = conic::RoundedSum::default();
            for k in 0..B.ncols() {
                let width = (graph.u_upper[k] - graph.u_lower[k]).next_up();
                side.add_product(B[(j, k)].abs(), width);
            }
            side.upper()
        })
        .collect();
    conic::norm_above(&sides)
}
