//! The shortest path through given regions in a given order.
//!
//! min Σ_i ‖B (p_{i+1} − p_i)‖  s.t. p_0 = 0, p_{k+1} = u_goal, p_i ∈ O(v_{i−1}, v_i), i = 1 … k
//!
//! with O the overlap inside the leaf, moved inwards by a margin so that rounding the bends keeps them inside.
//! (Marcucci et al. 2023, the convex restriction.)

use crate::leaf_graph::LeafGraph;
use crate::path::Path;
use conic::{Affine, ConicProgram, Settings};
use convex_sets::HPolyhedron;
use nalgebra::DVector;

/// Inward shifts of the overlaps' faces that are tried, in units of u. Erring side: a larger one lengthens the path
/// by about as much at each bend.
const MARGINS: [f64; 3] = [1e-9, 1e-8, 1e-7];

/// The shortest path through `vertices` (positions in the graph) from the start to `g`, verified; `None` if an
/// overlap is too thin or no margin gave a path that could be verified.
pub fn shortest_through(
    graph: &LeafGraph,
    vertices: &[usize],
    g: &DVector<f64>,
    free: &[Option<HPolyhedron>],
) -> Option<Path> {
    let passes = || vertices.windows(2).map(|pair| (pair[0], pair[1]));
    if passes().any(|(a, b)| graph.usable(a, b).is_none()) {
        return None;
    }
    let regions: Vec<usize> = vertices.iter().map(|&v| graph.vertices[v].region_idx).collect();
    MARGINS.iter().find_map(|&margin| {
        let mut points = vec![graph.frame.s.clone()];
        for u in bends(graph, vertices, margin)? {
            points.push(graph.frame.place(&u)?);
        }
        points.push(g.clone());
        let path = Path { regions: regions.clone(), points };
        path.is_verified(free, &graph.frame).then_some(path)
    })
}

/// Bends of the shortest path, with the overlaps' faces moved inwards by `margin`.
fn bends(graph: &LeafGraph, vertices: &[usize], margin: f64) -> Option<Vec<DVector<f64>>> {
    let d = graph.frame.dimension();
    let n_bends = vertices.len().saturating_sub(1);
    if n_bends == 0 {
        return Some(Vec::new());
    }
    let mut program = ConicProgram::new(n_bends * d);
    for (i, pair) in vertices.windows(2).enumerate() {
        for &v in pair {
            let P = &graph.vertices[v].polytope;
            for row_idx in 0..P.n_faces() {
                let row = P.A.row(row_idx);
                let terms = (0..d).map(|k| (i * d + k, row[k])).collect();
                program.add_less_equal(terms, P.b[row_idx] - margin * row.norm());
            }
        }
        for row_idx in 0..graph.slab.n_faces() / 2 {
            let terms = (0..d).map(|k| (i * d + k, graph.slab.A[(row_idx, k)])).collect();
            program.add_equality(terms, 0.0);
        }
    }
    for i in 0..=n_bends {
        // Piece i runs from bend i − 1 (or the start, u = 0) to bend i (or the goal).
        let length = program.add_variables(1);
        program.add_linear_cost(length, 1.0);
        let parts = graph.frame.B.row_iter().map(|b| {
            let mut form = Affine::default();
            for k in 0..d {
                if i < n_bends {
                    form.terms.push((i * d + k, b[k]));
                } else {
                    form.constant += b[k] * graph.u_goal[k];
                }
                if i > 0 {
                    form.terms.push(((i - 1) * d + k, -b[k]));
                }
            }
            form.terms.retain(|&(_, coefficient)| coefficient != 0.0);
            form
        });
        let parts = parts.filter(|form| !form.terms.is_empty() || form.constant != 0.0).collect();
        program.add_second_order_cone(Affine::variable(length), parts);
    }
    let solution = conic::solve(&program, &Settings::default()).ok()?;
    // Whatever the status, the bends are verified; a bad point only fails there.
    let finite = solution.x.iter().all(|x| x.is_finite());
    finite
        .then(|| (0..n_bends).map(|i| DVector::from_column_slice(&solution.x[i * d..(i + 1) * d])).collect())
}
