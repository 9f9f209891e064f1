//! How long a path must be that visits a given set: min ‖B u‖ + ‖B (u_goal − u)‖ over u in the set.

use crate::leaf_graph::LeafGraph;
use conic::{Affine, ConicProgram, Settings};
use convex_sets::HPolyhedron;

/// Proven: no path from start to goal that visits the intersection of `sets` is shorter. +∞ if it is proven empty.
pub fn detour_bound(graph: &LeafGraph, sets: &[&HPolyhedron]) -> f64 {
    let (d, B) = (graph.frame.dimension(), &graph.frame.B);
    let mut program = ConicProgram::new(d + 2);
    for P in sets {
        for row_idx in 0..P.n_faces() {
            let terms = (0..d).map(|k| (k, P.A[(row_idx, k)])).filter(|&(_, a)| a != 0.0).collect();
            program.add_less_equal(terms, P.b[row_idx]);
        }
    }
    for (length, is_second) in [(d, false), (d + 1, true)] {
        program.add_linear_cost(length, 1.0);
        let parts = (0..B.nrows()).filter(|&j| B.row(j).iter().any(|&b| b != 0.0)).map(|j| {
            let constant = if is_second { -graph.shift_to_goal[j] } else { 0.0 };
            let terms = (0..d).map(|k| (k, B[(j, k)])).filter(|&(_, b)| b != 0.0).collect();
            Affine::new(terms, constant)
        });
        let parts: Vec<Affine> = parts.collect();
        let constants: Vec<f64> = parts.iter().map(|form| form.constant).collect();
        let head = program.add_second_order_cone(Affine::variable(length), parts);
        for (part_idx, constant) in constants.into_iter().enumerate() {
            // g − s was rounded once.
            program.set_tolerance(head + 1 + part_idx, f64::EPSILON * constant.abs());
        }
    }
    let Ok(solution) = conic::solve(&program, &Settings::default()) else { return 0.0 };
    let reach = 4.0 * (1.0 + (&graph.u_upper - &graph.u_lower).amax() * B.abs().sum());
    let lower: Vec<f64> = graph.u_lower.iter().copied().chain([0.0, 0.0]).collect();
    let upper: Vec<f64> = graph.u_upper.iter().copied().chain([reach, reach]).collect();
    if conic::safe_farkas(&program, &solution.y, &lower, &upper) {
        return f64::INFINITY;
    }
    conic::safe_lower_bound(&program, &solution.y, &solution.x, &lower, &upper)
}
