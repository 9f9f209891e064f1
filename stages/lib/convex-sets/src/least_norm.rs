//! The point of a polyhedron nearest to the origin.
//!
//! min ½‖x‖²  s.t.  G x ≤ h. By duality it is a problem of nonnegative least squares: with E = -[Gᵀ; hᵀ] and
//! f = (0, …, 0, 1), let y ≥ 0 minimise ‖E y - f‖ and r = E y - f. Then x_j = -r_j / r_{n+1}, and the polyhedron is
//! empty exactly if r = 0. Source: Lawson & Hanson 1974, chapter 23 (least distance programming).

use nalgebra::{Cholesky, DMatrix, DVector};

/// A residual ‖r‖ below this says that the polyhedron is empty. Erring side: takes a polyhedron for empty whose nearest
/// point is further than 10^6 row norms away.
const TOL_EMPTY: f64 = 1e-12;
/// A column may enter if it lowers the residual by more than this.
const TOL_ENTER: f64 = 1e-11;
const MAX_STEPS: usize = 200;

/// The point of {x : G x ≤ h} nearest to the origin, up to rounding; `None` if there is none, or rounding hides it.
///
/// `G` [m × n], `h` [m]; rows are best scaled to norm 1.
pub fn least_norm_point(G: &DMatrix<f64>, h: &DVector<f64>) -> Option<DVector<f64>> {
    let (m, n) = (G.nrows(), G.ncols());
    if h.iter().all(|&h| h >= 0.0) {
        return Some(DVector::zeros(n));
    }
    // Column i of E is -(row i of G, h_i).
    let dot = |i: usize, r: &DVector<f64>| -((0..n).map(|j| G[(i, j)] * r[j]).sum::<f64>() + h[i] * r[n]);
    let mut y = DVector::zeros(m);
    let mut passive: Vec<usize> = Vec::new();
    let mut r = DVector::zeros(n + 1);
    r[n] = -1.0;
    for _ in 0..MAX_STEPS {
        // The column that lowers the residual most.
        let entering = (0..m)
            .filter(|i| !passive.contains(i))
            .map(|i| (-dot(i, &r) / (G.row(i).norm_squared() + h[i] * h[i]).sqrt().max(f64::MIN_POSITIVE), i))
            .fold((TOL_ENTER, None), |best, (gain, i)| if gain > best.0 { (gain, Some(i)) } else { best });
        let Some(entering) = entering.1 else { break };
        passive.push(entering);
        if !improve(G, h, &mut passive, &mut y) {
            passive.retain(|&i| i != entering);
            y[entering] = 0.0;
            break;
        }
        r.fill(0.0);
        for &i in &passive {
            (0..n).for_each(|j| r[j] -= G[(i, j)] * y[i]);
            r[n] -= h[i] * y[i];
        }
        r[n] -= 1.0;
        if r.norm() < TOL_EMPTY {
            return None;
        }
    }
    if r[n].is_nan() || r[n] >= -TOL_EMPTY {
        return None;
    }
    let x = DVector::from_fn(n, |j, _| -r[j] / r[n]);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Least squares over the passive columns, with those leaving that would turn negative; false if the columns are
/// dependent.
fn improve(G: &DMatrix<f64>, h: &DVector<f64>, passive: &mut Vec<usize>, y: &mut DVector<f64>) -> bool {
    let n = G.ncols();
    loop {
        let p = passive.len();
        let gram = DMatrix::from_fn(p, p, |s, t| {
            let (s, t) = (passive[s], passive[t]);
            (0..n).map(|j| G[(s, j)] * G[(t, j)]).sum::<f64>() + h[s] * h[t]
        });
        let rhs = DVector::from_fn(p, |s, _| -h[passive[s]]);
        let Some(cholesky) = Cholesky::new(gram) else { return false };
        let z = cholesky.solve(&rhs);
        if !z.iter().all(|v| v.is_finite()) {
            return false;
        }
        if z.iter().all(|&v| v > 0.0) {
            (0..p).for_each(|s| y[passive[s]] = z[s]);
            return true;
        }
        let mut step: f64 = 1.0;
        for s in 0..p {
            let now = y[passive[s]];
            if z[s] <= 0.0 && now > z[s] {
                step = step.min(now / (now - z[s]));
            }
        }
        for s in 0..p {
            let i = passive[s];
            y[i] += step * (z[s] - y[i]);
            if z[s] <= 0.0 && y[i] <= 1e-14 {
                y[i] = 0.0;
            }
        }
        let before = passive.len();
        passive.retain(|&i| y[i] > 0.0);
        if passive.len() == before || passive.is_empty() {
            return false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_half_plane_a_corner_and_nothing() {
        let G = DMatrix::from_row_slice(1, 2, &[-0.6, -0.8]);
        let x = least_norm_point(&G, &DVector::from_vec(vec![-2.0])).unwrap();
        assert!((x - DVector::from_vec(vec![1.2, 1.6])).norm() < 1e-12);
        let G = DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, 0.0, -1.0]);
        let x = least_norm_point(&G, &DVector::from_vec(vec![-1.0, -3.0])).unwrap();
        assert!((x - DVector::from_vec(vec![1.0, 3.0])).norm() < 1e-12);
        let G = DMatrix::from_row_slice(2, 1, &[1.0, -1.0]);
        assert_eq!(least_norm_point(&G, &DVector::from_vec(vec![1.0, -2.0])), None);
        let x = least_norm_point(&G, &DVector::from_vec(vec![2.0, 1.0])).unwrap();
        assert_eq!(x[0], 0.0);
    }

    proptest! {
        /// Feasible, and by the conditions of Kuhn and Tucker the nearest: no feasible point is nearer.
        #[test]
        fn no_feasible_point_is_nearer(
            rows in prop::collection::vec((prop::array::uniform3(-1.0..1.0_f64), -1.0..1.0_f64), 1..12),
            others in prop::collection::vec(prop::array::uniform3(-3.0..3.0_f64), 40),
        ) {
            let rows: Vec<_> = rows.into_iter().filter(|(a, _)| DVector::from_row_slice(a).norm() > 0.1).collect();
            let m = rows.len();
            let G = DMatrix::from_fn(m, 3, |i, j| rows[i].0[j] / DVector::from_row_slice(&rows[i].0).norm());
            let h = DVector::from_fn(m, |i, _| rows[i].1);
            let feasible = |x: &DVector<f64>, tol: f64| (&G * x - &h).iter().all(|&v| v <= tol);
            match least_norm_point(&G, &h) {
                Some(x) => {
                    prop_assert!(feasible(&x, 1e-6 * (1.0 + x.norm())), "{x}");
                    for other in &others {
                        // On the way from x to a feasible point the norm does not fall.
                        let other = DVector::from_row_slice(other);
                        if feasible(&other, 0.0) {
                            prop_assert!(x.norm() <= other.norm() + 1e-6);
                        }
                    }
                }
                None => {
                    for other in &others {
                        prop_assert!(!feasible(&DVector::from_row_slice(other), 0.0));
                    }
                }
            }
        }
    }
}
