//! Bounds of linear programmes that hold whatever rounding does.

use nalgebra::{DMatrix, DVector};

/// A number that `min { cᵀx : A x ≤ b, lower ≤ x ≤ upper }` is not below, for any `y` (entries that are not
/// positive count as 0): -bᵀy + min over the box of (c + Aᵀy)ᵀx, rounded down.
///
/// With c = 0 a positive value proves that the set is empty. `c` [n], `A` [m × n], `b`, `y` [m]; `-∞` if
/// anything is not finite.
pub fn safe_lower_bound(
    c: &DVector<f64>,
    A: &DMatrix<f64>,
    b: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    y: &DVector<f64>,
) -> f64 {
    let (m, n) = (A.nrows(), c.len());
    // A sum of k products in floating point is off by at most k u Σ|products| / (1 - k u) (Higham 2002, 3.5);
    // the factor below is more than twice that for every sum taken here, which also covers the rounding of
    // the error terms themselves. Subnormal products are covered by `TINY` each.
    let rounding = 4.0 * (m + n + 4) as f64 * f64::EPSILON;
    const TINY: f64 = 1e-300;
    let mut value = 0.0;
    let mut size = 0.0;
    for i in 0..m {
        if y[i] > 0.0 {
            value -= b[i] * y[i];
            size += (b[i] * y[i]).abs() + TINY;
        }
    }
    for j in 0..n {
        let mut slope = c[j];
        let mut slope_size = c[j].abs();
        for i in 0..m {
            if y[i] > 0.0 {
                slope += A[(i, j)] * y[i];
                slope_size += (A[(i, j)] * y[i]).abs() + TINY;
            }
        }
        let reach = lower[j].abs().max(upper[j].abs());
        value += (slope * lower[j]).min(slope * upper[j]);
        size += slope.abs() * reach + slope_size * reach + TINY;
    }
    let bound = value - rounding * size - TINY;
    if bound.is_finite() { bound } else { f64::NEG_INFINITY }
}
