//! Smallest ellipsoid around points.
//!
//! Symbols: points p_i, weights λ ≥ 0 with Σ λ_i = 1, lifted points (p_i, 1), X(λ) = Σ λ_i (p_i, 1)(p_i, 1)ᵀ.
//! Khachiyan's method raises the weight of the point with the largest (p, 1)ᵀ X⁻¹ (p, 1) until none exceeds
//! (1 + tol)(n + 1). Source: Khachiyan 1996; Todd & Yıldırım 2007.

use nalgebra::{DMatrix, DVector};

use crate::Hyperellipsoid;
use crate::hyperellipsoid::square_root;

const MAX_STEPS: usize = 2000;
/// Relative excess of the worst point at which the method stops.
const TOL_EXCESS: f64 = 1e-2;

/// An ellipsoid around `points` that is within a few per cent of the smallest one. Its axes are at least
/// `least_half_axis` > 0 long, so that fewer than n + 1 points, or points in a plane, are no special case.
/// `None` without points or with values that are not finite.
pub fn min_enclosing_ellipsoid(points: &[DVector<f64>], least_half_axis: f64) -> Option<Hyperellipsoid> {
    let n = points.first()?.len();
    let mean = points.iter().fold(DVector::zeros(n), |sum, p| sum + p) / points.len() as f64;
    let mut lifted: Vec<DVector<f64>> = points.iter().map(|p| p.push(1.0)).collect();
    for j in 0..n {
        for sign in [-1.0, 1.0] {
            let mut p = mean.clone();
            p[j] += sign * least_half_axis;
            lifted.push(p.push(1.0));
        }
    }
    let n_lifted = (n + 1) as f64;
    let mut lambda = vec![1.0 / lifted.len() as f64; lifted.len()];
    for _ in 0..MAX_STEPS {
        let mut X = DMatrix::zeros(n + 1, n + 1);
        for (p, &weight) in lifted.iter().zip(&lambda) {
            X.ger(weight, p, p, 1.0);
        }
        let inverse = X.cholesky()?.inverse();
        let mut worst = (0, f64::NEG_INFINITY);
        for (i, p) in lifted.iter().enumerate() {
            let kappa = p.dot(&(&inverse * p));
            if kappa > worst.1 {
                worst = (i, kappa);
            }
        }
        if !worst.1.is_finite() {
            return None;
        }
        if worst.1 <= (1.0 + TOL_EXCESS) * n_lifted {
            break;
        }
        let step = (worst.1 - n_lifted) / (n_lifted * (worst.1 - 1.0));
        lambda.iter_mut().for_each(|weight| *weight *= 1.0 - step);
        lambda[worst.0] += step;
    }
    let center = lifted
        .iter()
        .zip(&lambda)
        .fold(DVector::zeros(n), |sum: DVector<f64>, (p, &weight)| sum + weight * p.rows(0, n));
    let mut covariance = DMatrix::zeros(n, n);
    for (p, &weight) in lifted.iter().zip(&lambda) {
        let r: DVector<f64> = p.rows(0, n) - &center;
        covariance.ger(weight, &r, &r, 1.0);
    }
    let metric = (covariance * n as f64).cholesky()?.inverse();
    let shape = square_root(0.5 * (&metric + metric.transpose()))?;
    let mut ellipsoid = Hyperellipsoid { A: shape, center };
    // The stopping rule leaves points a little outside: scale so that all are inside.
    let reach = lifted
        .iter()
        .map(|p| ellipsoid.distance(&p.rows(0, n).into_owned()))
        .fold(0.0_f64, f64::max)
        .max(f64::MIN_POSITIVE);
    ellipsoid.A /= reach;
    Some(ellipsoid)
}
