//! Bounds from multipliers that hold whatever the multipliers are.
//!
//! For y ∈ K*, any x̂, and every x in the box that is feasible (s = b − A x ∈ K, so y·s ≥ 0):
//!
//! ```text
//! f(x) ≥ f(x) − y·(b − A x)
//!      ≥ −b·y + Σ_k w_k (r_k e_k − ½ r_k²) + (c + Σ_k w_k r_k d_k + Aᵀ y)·x        r_k = d_k·x̂ + e_k
//!      ≥ −b·y + Σ_k w_k (r_k e_k − ½ r_k²) + Σ_j min { g_j x_j : lower_j ≤ x_j ≤ upper_j }
//! ```
//!
//! The second line is the tangent of each square at r_k, which holds for any number r_k, so that r_k needs no care.
//! A b that is known only within a tolerance costs |y| times that. Everything else is summed with a bound on its
//! rounding error, taken off at the end. With f = 0 a positive value says that no x in the box is feasible (Farkas).

use crate::program::{Cone, ConicProgram};
use crate::rounding::{RoundedSum, norm_above};

/// A number not above the least value of `program` over the box `lower ≤ x ≤ upper`; -∞ if `y` says nothing. It is
/// tight when `y` is optimal and `x_hat` is the optimum, but holds for any `y` [m] and `x_hat` [n]: `y` is projected
/// into K* first. Every feasible point that is to be bounded must lie in the box.
///
/// Slices that are too short, or hold NaN, count as having zeros there (bounds: as having infinities).
pub fn safe_lower_bound(
    program: &ConicProgram,
    y: &[f64],
    x_hat: &[f64],
    lower: &[f64],
    upper: &[f64],
) -> f64 {
    let y = project_dual(program, y);
    let mut gradient = aggregate(program, &y);
    for (g, &c) in gradient.iter_mut().zip(program.c()) {
        g.add(c);
    }
    let mut constant = RoundedSum::default();
    for square in program.squares() {
        let form = &square.form;
        let at_x_hat =
            form.terms.iter().map(|&(j, d)| d * number(x_hat, j, 0.0)).sum::<f64>() + form.constant;
        let r = if at_x_hat.is_finite() { at_x_hat } else { 0.0 };
        // The slope w r is rounded once and is then itself the number that is used: with w > 0 it is the slope of
        // the tangent at slope / w, whose constant is slope·e − slope² / (2 w).
        let slope = square.weight * r;
        if slope == 0.0 || !slope.is_finite() {
            continue;
        }
        for &(j, d) in &form.terms {
            gradient[j].add_product(slope, d);
        }
        constant.add_product(slope, form.constant);
        let half_square = ((slope * slope).next_up() / (2.0 * square.weight)).next_up();
        constant.add(-half_square);
    }
    bound(program, &y, &gradient, constant, lower, upper)
}

/// Whether `y` proves that no x with `lower ≤ x ≤ upper` satisfies the rows of `program`: Farkas' inequality in
/// outward-rounded arithmetic. False says nothing. `y` is projected into K* first.
pub fn safe_farkas(program: &ConicProgram, y: &[f64], lower: &[f64], upper: &[f64]) -> bool {
    let y = project_dual(program, y);
    let gradient = aggregate(program, &y);
    bound(program, &y, &gradient, RoundedSum::default(), lower, upper) > 0.0
}

/// A vector in K*, near `y`, exactly: negative multipliers of inequalities become 0, the head of a second-order cone
/// is raised to the norm of its tail rounded up, the diagonal of a matrix until it is dominant (safe, but not tight),
/// entries that are missing or not finite become 0 with their cone.
pub fn project_dual(program: &ConicProgram, y: &[f64]) -> Vec<f64> {
    let mut projected: Vec<f64> = (0..program.n_rows()).map(|row| number(y, row, 0.0)).collect();
    let mut first = 0;
    for cone in program.cones() {
        let block = &mut projected[first..first + cone.n_rows()];
        first += cone.n_rows();
        match cone {
            Cone::Zero(_) => finite_or_zero(block),
            Cone::Nonnegative(_) => {
                finite_or_zero(block);
                block.iter_mut().for_each(|y| *y = y.max(0.0));
            }
            Cone::SecondOrder(_) => {
                if let Some((head, tail)) = block.split_first_mut() {
                    *head = head.max(norm_above(tail));
                }
                if block.iter().any(|y| !y.is_finite()) {
                    block.fill(0.0);
                }
            }
            Cone::PositiveSemidefinite(order) => make_dominant(block, *order),
        }
    }
    projected
}

/// Raises the diagonal of the matrix with this svec until it is diagonally dominant, which makes it positive
/// semidefinite exactly: enough to be safe, not to be tight.
fn make_dominant(svec: &mut [f64], order: usize) {
    let at = |i: usize, j: usize| i.min(j) + i.max(j) * (i.max(j) + 1) / 2;
    for i in 0..order {
        let mut others = RoundedSum::default();
        for j in (0..order).filter(|&j| j != i) {
            // The double 1/√2 is above the number.
            others.add_product(svec[at(i, j)].abs(), std::f64::consts::FRAC_1_SQRT_2);
        }
        svec[at(i, i)] = svec[at(i, i)].max(others.upper().max(0.0));
    }
    if svec.iter().any(|y| !y.is_finite()) {
        svec.fill(0.0);
    }
}

/// Aᵀ y, summed with error bounds.
fn aggregate(program: &ConicProgram, y: &[f64]) -> Vec<RoundedSum> {
    let mut gradient = vec![RoundedSum::default(); program.n_variables()];
    for (row, &y) in y.iter().enumerate().filter(|&(_, &y)| y != 0.0) {
        for &(j, a) in program.row(row) {
            gradient[j].add_product(a, y);
        }
    }
    gradient
}

/// −b·y + constant + Σ_j min over the box of g_j x_j, rounded down.
fn bound(
    program: &ConicProgram,
    y: &[f64],
    gradient: &[RoundedSum],
    constant: RoundedSum,
    lower: &[f64],
    upper: &[f64],
) -> f64 {
    let mut total = RoundedSum::default();
    for (&b, &y) in program.b().iter().zip(y).filter(|&(_, &y)| y != 0.0) {
        total.add_product(-b, y);
    }
    for &(row, tolerance) in program.b_tolerances() {
        total.add_product(-number(y, row, 0.0).abs(), tolerance);
    }
    total.add(constant.lower());
    for (j, g) in gradient.iter().enumerate() {
        let (g_low, g_high) = if *g == RoundedSum::default() { (0.0, 0.0) } else { (g.lower(), g.upper()) };
        let (l, u) = (number(lower, j, f64::NEG_INFINITY), number(upper, j, f64::INFINITY));
        // The least of g x over both intervals is at a corner; 0 · ∞ is 0 here, since x is a number.
        let (mut worst, mut at) = (f64::INFINITY, (0.0, 0.0));
        for (g, x) in [(g_low, l), (g_low, u), (g_high, l), (g_high, u)] {
            let product = if g == 0.0 { 0.0 } else { g * x };
            if product < worst || product.is_nan() {
                (worst, at) = (product, if g == 0.0 { (0.0, 0.0) } else { (g, x) });
            }
        }
        total.add_product(at.0, at.1);
    }
    total.lower()
}

fn finite_or_zero(block: &mut [f64]) {
    block.iter_mut().filter(|y| !y.is_finite()).for_each(|y| *y = 0.0);
}

/// `values[index]`, or `missing` where there is none or it is NaN.
fn number(values: &[f64], index: usize, missing: f64) -> f64 {
    values.get(index).copied().filter(|value| !value.is_nan()).unwrap_or(missing)
}

#[cfg(test)]
mod tests;
