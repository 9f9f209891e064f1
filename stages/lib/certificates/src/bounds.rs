//! What the rows of a region say of each coordinate.

use crate::cell::CellBox;
use crate::row_program::RowProgram;
use crate::rows::{Multipliers, RowBound, Rows};

/// Bounds of the region are moved outwards by this share of the range, so that multipliers prove them.
const BOUND_SLACK: f64 = 1e-7;

/// Lower and upper bound of one coordinate, each with its proof; `None` where the rows say no more than the limits.
pub type CoordinateBounds = [Option<(f64, Multipliers)>; 2];

/// For each coordinate what the rows imply on both sides, where that is inside the joint limits.
pub fn coordinate_bounds(rows: &Rows, limits: &CellBox) -> Vec<CoordinateBounds> {
    let n = limits.lower.len();
    let mut program = RowProgram::default();
    let mut bound = |j: usize, sign: f64| {
        let mut g = vec![0.0; n];
        g[j] = sign;
        let RowBound::Bound { value, multipliers } = rows.minimize(&mut program, limits, &g, f64::INFINITY)
        else {
            return None;
        };
        let slack = BOUND_SLACK * (limits.upper[j] - limits.lower[j]);
        (!multipliers.is_empty()).then(|| (limits.center(j) + sign * (value - slack), multipliers))
    };
    (0..n).map(|j| [bound(j, 1.0), bound(j, -1.0)]).collect()
}
