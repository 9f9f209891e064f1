//! The nearest point at which a gap closes, by sequential quadratic programming.
//!
//! min ½‖w‖²  s.t.  g(w) ≤ 0,  G w ≤ h.
//!
//! The search aims at g = -`DEPTH`, a little inside: from outside of a convex obstacle the iterates approach it without
//! ever reaching it. At each iterate w, with B an approximation of the Hessian of ½‖w‖² + λ g (damped BFGS, Powell
//! 1978), the quadratic programme
//!
//! min ½ dᵀB d + w·d  s.t.  g + ∇g·d ≤ -depth,  G (w + d) ≤ h
//!
//! is a nearest point of a polyhedron in z = Lᵀd + L⁻¹w, B = L Lᵀ (`least_norm_point`). Its step is shortened until the
//! merit ½‖w‖² + c·max(g + depth, 0) falls enough.

use convex_sets::least_norm_point;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Value and gradient of g; `None` where it has none.
pub(crate) type Gap<'a> = dyn FnMut(&DVector<f64>) -> Option<(f64, DVector<f64>)> + 'a;

/// How far inside the search aims, metres.
const DEPTH: f64 = 1e-6;
const MAX_STEPS: usize = 40;
/// The search ends when a step is shorter than this share of ‖w‖.
const LAST_STEP: f64 = 1e-6;
/// Halvings of a step.
const MAX_HALVINGS: usize = 12;
/// Shares of g that the linearisation is asked to close, if the constraints do not allow more.
const SHARES: [f64; 3] = [1.0, 0.5, 0.2];

/// The nearest iterate with g ≤ 0 from `w`, if there is any: near a local minimum. Rows of `G`
/// [m × n] and `h` [m].
pub(crate) fn nearest_closing(
    g: &mut Gap<'_>,
    G: &DMatrix<f64>,
    h: &DVector<f64>,
    mut w: DVector<f64>,
) -> Option<DVector<f64>> {
    let (m, n) = (G.nrows(), w.len());
    let (mut value, mut gradient) = g(&w)?;
    let mut best: Option<DVector<f64>> = None;
    let keep = |w: &DVector<f64>, value: f64, best: &mut Option<DVector<f64>>| {
        let inside = (0..m).all(|i| rows_hold(G, h, i, w));
        if value <= 0.0 && inside && best.as_ref().is_none_or(|best| w.norm_squared() < best.norm_squared()) {
            *best = Some(w.clone());
        }
    };
    keep(&w, value, &mut best);
    let mut B = DMatrix::identity(n, n);
    let mut penalty: f64 = 0.0;
    for _ in 0..MAX_STEPS {
        let slope_squared = gradient.norm_squared();
        if !(slope_squared > 0.0 && slope_squared.is_finite() && value.is_finite()) {
            break;
        }
        let Some(step) = quadratic_step(&B, &w, value, &gradient, G, h) else { break };
        let last = if value <= 0.0 { LAST_STEP } else { 1e-3 * LAST_STEP };
        if step.norm() <= last * w.norm().max(1e-9) {
            break;
        }
        // λ by least squares over ∇f + B d + λ ∇g = 0.
        let lambda = (-gradient.dot(&(&B * &step + &w)) / slope_squared).max(0.0);
        penalty = penalty.max(2.0 * lambda);
        let excess = |value: f64| (value + DEPTH).max(0.0);
        let merit = |w: &DVector<f64>, value: f64| 0.5 * w.norm_squared() + penalty * excess(value);
        let (now, fall) = (merit(&w, value), -w.dot(&step) + penalty * excess(value));
        let mut share = 1.0;
        let mut moved = None;
        for _ in 0..MAX_HALVINGS {
            let next = &w + share * &step;
            let Some((next_value, next_gradient)) = g(&next) else { break };
            keep(&next, next_value, &mut best);
            if merit(&next, next_value) <= now - 1e-3 * share * fall.max(0.0) {
                moved = Some((next, next_value, next_gradient));
                break;
            }
            share *= 0.5;
        }
        let Some((next, next_value, next_gradient)) = moved else { break };
        let s = &next - &w;
        let y = &s + lambda * (&next_gradient - &gradient);
        update(&mut B, &s, &y);
        (w, value, gradient) = (next, next_value, next_gradient);
    }
    best
}

/// The step of the quadratic programme of the module's head; with less of g closed if that is all that G allows.
fn quadratic_step(
    B: &DMatrix<f64>,
    w: &DVector<f64>,
    value: f64,
    gradient: &DVector<f64>,
    G: &DMatrix<f64>,
    h: &DVector<f64>,
) -> Option<DVector<f64>> {
    let (m, n) = (G.nrows(), w.len());
    let L = Cholesky::new(B.clone())?.l();
    let offset = L.solve_lower_triangular(w)?;
    let mut rows = DMatrix::zeros(m + 1, n);
    let mut offsets = DVector::zeros(m + 1);
    let mut set_row = |i: usize, a: &DVector<f64>, b: f64| {
        // a·d ≤ b over z.
        if let Some(over_z) = L.solve_lower_triangular(a) {
            let norm = over_z.norm().max(f64::MIN_POSITIVE);
            offsets[i] = (b + over_z.dot(&offset)) / norm;
            rows.set_row(i, &(over_z / norm).transpose());
        }
    };
    for i in 0..m {
        let a = G.row(i).transpose();
        let room = h[i] - a.dot(w);
        set_row(i, &a, room);
    }
    let close = value + DEPTH;
    set_row(m, gradient, -close);
    let per_unit = close / L.solve_lower_triangular(gradient)?.norm().max(f64::MIN_POSITIVE);
    for share in SHARES {
        let mut offsets = offsets.clone();
        if close > 0.0 {
            offsets[m] += (1.0 - share) * per_unit;
        }
        if let Some(z) = least_norm_point(&rows, &offsets) {
            return L.tr_solve_lower_triangular(&(z - &offset));
        }
        if close <= 0.0 {
            break;
        }
    }
    None
}

/// Powell's damped BFGS update of `B` for the step `s` along which the gradient changed by `y`.
fn update(B: &mut DMatrix<f64>, s: &DVector<f64>, y: &DVector<f64>) {
    let Bs = &*B * s;
    let (sBs, sy) = (s.dot(&Bs), s.dot(y));
    if !(sBs > 0.0 && sy.is_finite()) {
        return;
    }
    let theta = if sy >= 0.2 * sBs { 1.0 } else { 0.8 * sBs / (sBs - sy) };
    let r = theta * y + (1.0 - theta) * &Bs;
    let sr = s.dot(&r);
    if sr > 0.0 {
        B.ger(-1.0 / sBs, &Bs, &Bs, 1.0);
        B.ger(1.0 / sr, &r, &r, 1.0);
    }
}

/// Whether `w` satisfies row `i` up to rounding.
fn rows_hold(G: &DMatrix<f64>, h: &DVector<f64>, i: usize, w: &DVector<f64>) -> bool {
    let value: f64 = (0..w.len()).map(|j| G[(i, j)] * w[j]).sum();
    value <= h[i] + 1e-9 * (1.0 + h[i].abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    fn nothing(n: usize) -> (DMatrix<f64>, DVector<f64>) {
        (DMatrix::zeros(0, n), DVector::zeros(0))
    }

    /// Gap of a ball of radius `r` about `c`.
    fn ball(c: DVector<f64>, r: f64) -> impl FnMut(&DVector<f64>) -> Option<(f64, DVector<f64>)> {
        move |w| {
            let d = w - &c;
            Some((d.norm() - r, d.clone() / d.norm()))
        }
    }

    #[test]
    fn nearest_point_of_a_ball_from_inside_and_outside() {
        let (G, h) = nothing(3);
        for start in [[1.2, 1.0, -0.3], [3.0, -1.0, 2.0], [-1.0, 0.1, 0.0]] {
            let c = vector(&[2.0, 1.0, -1.0]);
            let w = nearest_closing(&mut ball(c.clone(), 0.5), &G, &h, vector(&start)).unwrap();
            let expected = &c * (1.0 - 0.5 / c.norm());
            assert!((&w - &expected).norm() < 1e-3, "{w} {expected}");
            assert!((&w - &c).norm() <= 0.5);
        }
    }

    #[test]
    fn constraints_move_the_nearest_point_or_leave_none() {
        let c = vector(&[2.0, 0.0]);
        let G = DMatrix::from_row_slice(1, 2, &[0.0, -1.0]);
        // w_1 ≥ 0.3: the ball's points at that height begin at x = 2 - 0.4.
        let w =
            nearest_closing(&mut ball(c.clone(), 0.5), &G, &vector(&[-0.3]), vector(&[0.0, 0.0])).unwrap();
        assert!((w - vector(&[1.6, 0.3])).norm() < 1e-3);
        // w_1 ≥ 0.6: none.
        let none = nearest_closing(&mut ball(c, 0.5), &G, &vector(&[-0.6]), vector(&[0.0, 0.0]));
        assert!(none.is_none(), "{none:?}");
    }

    /// A concave boundary: min w² with w_1 ≥ 1 - 2 w_0² has two minima, and the search ends in one of them.
    #[test]
    fn a_boundary_that_curves_towards_the_origin() {
        let mut g = |w: &DVector<f64>| Some((1.0 - 2.0 * w[0] * w[0] - w[1], vector(&[-4.0 * w[0], -1.0])));
        let (G, h) = nothing(2);
        let w = nearest_closing(&mut g, &G, &h, vector(&[0.3, 1.5])).unwrap();
        // w_1 = 1 - 2 w_0², minimal where w_1 = 1/4.
        assert!((w[0].abs() - 0.375_f64.sqrt()).abs() < 2e-2 && (w[1] - 0.25).abs() < 2e-2, "{w}");
    }
}
