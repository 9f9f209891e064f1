//! Largest ellipsoid inside a polyhedron.
//!
//! Symbols: P = {x | A x ≤ b} (m faces, n dims); E = {L u + d : ‖u‖ ≤ 1}, L lower triangular, L_kk > 0, which
//! every ellipsoid has exactly one of.
//!
//! max Σ log L_kk  s.t.  ‖Lᵀ a_i‖ ≤ s_i := b_i - a_iᵀd: convex in (L, d). Solved by Newton's method on
//!
//! φ_t(L, d) = -t Σ log L_kk - Σ_i log(s_i² - ‖Lᵀa_i‖²), t → ∞,
//!
//! whose terms are self-concordant barriers of second-order cones (degree 2): at the minimiser of φ_t the
//! volume is within 2 m / t of the largest, in log. Source: Boyd & Vandenberghe 2004, §8.4.2 and §11.6.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::{HPolyhedron, Hyperellipsoid, SetError};

/// Logarithm of the volume may miss the largest by this. Erring side: an ellipsoid that is a little small,
/// never one that leaves P.
const TOL_LOG_VOLUME: f64 = 1e-3;
const MAX_NEWTON_STEPS: usize = 400;

impl HPolyhedron {
    /// The ellipsoid of largest volume inside P; it lies inside P strictly. Works in units of P's bounding box.
    /// An error if P is empty, flat or unbounded.
    pub fn max_inscribed_ellipsoid(&self) -> Result<Hyperellipsoid, SetError> {
        let n = self.ambient_dimension();
        let bounds = self.bounding_box()?;
        let (mid, half) = (bounds.center(), bounds.half_widths());
        if half.iter().any(|&h| h <= 0.0) {
            return Err(SetError::NoInterior);
        }
        let mut A = self.A.clone();
        for j in 0..n {
            A.column_mut(j).scale_mut(half[j]);
        }
        let scaled = HPolyhedron { b: &self.b - &self.A * &mid, A }.with_unit_rows()?;
        let ball = scaled.chebyshev_center()?;
        if ball.radius <= 0.0 {
            return Err(SetError::NoInterior);
        }
        let (L, d) = maximize(&scaled, ball.center, ball.radius);
        // x = mid + half ∘ u, so u = (x - mid) / half and A_u (u - d) = (A_u / half) (x - mid - half ∘ d).
        let mut shape = L.try_inverse().ok_or(SetError::Undecided)?;
        for j in 0..n {
            shape.column_mut(j).unscale_mut(half[j]);
        }
        Ok(Hyperellipsoid { A: shape, center: mid + half.component_mul(&d) })
    }
}

/// Position of L_ik (i ≥ k) among the unknowns; d follows all of L.
fn position(i: usize, k: usize) -> usize {
    i * (i + 1) / 2 + k
}

/// (L, d) near the maximum, from the ball of `radius` at `center`, inside `P`.
fn maximize(P: &HPolyhedron, center: DVector<f64>, radius: f64) -> (DMatrix<f64>, DVector<f64>) {
    let (m, n) = (P.n_faces(), P.ambient_dimension());
    let n_shape = n * (n + 1) / 2;
    let mut v = DVector::zeros(n_shape + n);
    for k in 0..n {
        v[position(k, k)] = 0.5 * radius;
    }
    v.rows_mut(n_shape, n).copy_from(&center);
    let mut t = 1.0;
    let t_last = 2.0 * m as f64 / TOL_LOG_VOLUME;
    for _ in 0..MAX_NEWTON_STEPS {
        let Some((value, gradient, hessian)) = barrier(P, &v, t) else { break };
        let Some(cholesky) = Cholesky::new(hessian) else { break };
        let step = cholesky.solve(&-&gradient);
        let decrement = -gradient.dot(&step);
        if !decrement.is_finite() || decrement < 1e-2 {
            if t >= t_last {
                break;
            }
            t = (t * 8.0).min(t_last);
            continue;
        }
        let mut length = 1.0;
        let moved = loop {
            let next = &v + length * &step;
            if barrier_value(P, &next, t).is_some_and(|f| f <= value - 0.1 * length * decrement) {
                break Some(next);
            }
            length *= 0.5;
            if length < 1e-10 {
                break None;
            }
        };
        match moved {
            Some(next) => v = next,
            // Rounding limits the accuracy at this t.
            None if t >= t_last => break,
            None => t = (t * 8.0).min(t_last),
        }
    }
    let mut L = DMatrix::zeros(n, n);
    for i in 0..n {
        for k in 0..=i {
            L[(i, k)] = v[position(i, k)];
        }
    }
    (L, v.rows(n_shape, n).into_owned())
}

/// s_i, Lᵀa_i and s_i² - ‖Lᵀa_i‖² of face `i`.
fn cone(P: &HPolyhedron, v: &DVector<f64>, i: usize, w: &mut [f64]) -> (f64, f64) {
    let n = P.ambient_dimension();
    let n_shape = n * (n + 1) / 2;
    let mut s = P.b[i];
    for j in 0..n {
        s -= P.A[(i, j)] * v[n_shape + j];
    }
    let mut square = 0.0;
    for k in 0..n {
        w[k] = (k..n).map(|j| v[position(j, k)] * P.A[(i, j)]).sum();
        square += w[k] * w[k];
    }
    (s, s * s - square)
}

/// φ_t, `None` outside its domain.
fn barrier_value(P: &HPolyhedron, v: &DVector<f64>, t: f64) -> Option<f64> {
    let n = P.ambient_dimension();
    let mut w = vec![0.0; n];
    let mut value = 0.0;
    for k in 0..n {
        let diagonal = v[position(k, k)];
        if diagonal <= 0.0 {
            return None;
        }
        value -= t * diagonal.ln();
    }
    for i in 0..P.n_faces() {
        let (s, f) = cone(P, v, i, &mut w);
        if s <= 0.0 || f <= 0.0 {
            return None;
        }
        value -= f.ln();
    }
    value.is_finite().then_some(value)
}

/// φ_t with gradient and Hessian, `None` outside its domain.
fn barrier(P: &HPolyhedron, v: &DVector<f64>, t: f64) -> Option<(f64, DVector<f64>, DMatrix<f64>)> {
    let n = P.ambient_dimension();
    let n_shape = n * (n + 1) / 2;
    let value = barrier_value(P, v, t)?;
    let mut gradient = DVector::zeros(v.len());
    let mut hessian = DMatrix::zeros(v.len(), v.len());
    for k in 0..n {
        let p = position(k, k);
        gradient[p] -= t / v[p];
        hessian[(p, p)] += t / (v[p] * v[p]);
    }
    let mut w = vec![0.0; n];
    let mut df = DVector::zeros(v.len());
    for i in 0..P.n_faces() {
        let (s, f) = cone(P, v, i, &mut w);
        // f = s² - wᵀw with s, w linear in the unknowns: ds/dd_j = -a_j, dw_k/dL_jk = a_j.
        for j in 0..n {
            let a = P.A[(i, j)];
            df[n_shape + j] = -2.0 * s * a;
            for k in 0..=j {
                df[position(j, k)] = -2.0 * w[k] * a;
            }
        }
        gradient.axpy(-1.0 / f, &df, 1.0);
        hessian.ger(1.0 / (f * f), &df, &df, 1.0);
        for j in 0..n {
            for l in 0..n {
                let product = 2.0 * P.A[(i, j)] * P.A[(i, l)] / f;
                hessian[(n_shape + j, n_shape + l)] -= product;
                for k in 0..=j.min(l) {
                    hessian[(position(j, k), position(l, k))] += product;
                }
            }
        }
    }
    Some((value, gradient, hessian))
}
