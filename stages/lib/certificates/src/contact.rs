//! Where a region touches or enters a C-obstacle, found by descent of the gap.
//!
//! Guides refusals; proves nothing but what it shows (a configuration without a separating plane).

use crate::cell::CellBox;
use crate::pair_model::PairModel;
use crate::row_program::RowProgram;
use crate::rows::Rows;

/// Steps of descent.
const MAX_DESCENTS: usize = 12;

/// A configuration of the region with a small gap, by repeated steps to the vertex where the linearised gap is least
/// (Frank & Wolfe 1956), and the gap there, metres.
pub fn least_gap(
    model: &PairModel,
    rows: &Rows,
    limits: &CellBox,
    from: &[f64],
    program: &mut RowProgram,
) -> (f64, Vec<f64>) {
    let mut q = from.to_vec();
    let mut tangent = model.tangent(0, &q);
    for _ in 0..MAX_DESCENTS {
        program.minimize(rows, rows.active(), limits, &tangent.g, f64::INFINITY);
        let vertex = program.point(limits);
        let next = model.tangent(0, &vertex);
        if !(next.gap < tangent.gap) {
            break;
        }
        (q, tangent) = (vertex, next);
    }
    (tangent.gap, q)
}
