//! Dense linear algebra on column-major slices, as much as the semidefinite cone asks for.
//!
//! A matrix is a slice and a leading dimension: entry (i, j) at `i + j * ld`. Matrices here have a handful of rows, so
//! the loops are plain; eigenvalues and the LU factors are nalgebra's, singular values are found by one-sided Jacobi
//! rotations (Golub & Van Loan 2013, section 8.6.3), which end for any input.

// `!(x > 0.0)` refuses what is not a number as well.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

use nalgebra::{DMatrix, SymmetricEigen};

/// Whether a matrix is taken as it is or transposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A.
    Plain,
    /// Aᵀ.
    Transposed,
}

/// Which triangle of a symmetric matrix is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Triangle {
    /// i ≤ j.
    Upper,
    /// i ≥ j.
    Lower,
}

/// A matrix that is read: op(A) of the given shape.
#[derive(Debug, Clone, Copy)]
pub struct Factor<'a> {
    /// Entries.
    pub data: &'a [f64],
    /// Leading dimension.
    pub ld: usize,
    /// Plain or transposed.
    pub shape: Shape,
}

impl Factor<'_> {
    fn at(&self, i: usize, j: usize) -> f64 {
        match self.shape {
            Shape::Plain => self.data[i + j * self.ld],
            Shape::Transposed => self.data[j + i * self.ld],
        }
    }
}

/// β c, with 0 where β is 0 whatever c is.
fn scaled(beta: f64, c: f64) -> f64 {
    if beta == 0.0 { 0.0 } else { beta * c }
}

/// C ← α op(A) op(B) + β C, C [m × n], op(A) [m × k].
#[allow(clippy::too_many_arguments)]
pub fn multiply(
    (m, n, k): (usize, usize, usize),
    alpha: f64,
    A: Factor<'_>,
    B: Factor<'_>,
    beta: f64,
    C: &mut [f64],
    ldc: usize,
) {
    for j in 0..n {
        for i in 0..m {
            let sum: f64 = (0..k).map(|l| A.at(i, l) * B.at(l, j)).sum();
            let c = &mut C[i + j * ldc];
            *c = alpha * sum + scaled(beta, *c);
        }
    }
}

/// One triangle of C ← α (op(A) op(B)ᵀ + op(B) op(A)ᵀ) + β C, op(A) and op(B) [n × k].
pub fn symmetric_product(
    (n, k): (usize, usize),
    alpha: f64,
    A: Factor<'_>,
    B: Factor<'_>,
    beta: f64,
    C: &mut [f64],
    (ldc, triangle): (usize, Triangle),
) {
    for j in 0..n {
        let rows = match triangle {
            Triangle::Upper => 0..j + 1,
            Triangle::Lower => j..n,
        };
        for i in rows {
            let sum: f64 = (0..k).map(|l| A.at(i, l) * B.at(j, l) + B.at(i, l) * A.at(j, l)).sum();
            let c = &mut C[i + j * ldc];
            *c = alpha * sum + scaled(beta, *c);
        }
    }
}

/// Entry (i, j) of a symmetric matrix of which one triangle is stored.
pub fn symmetric_at(data: &[f64], ld: usize, triangle: Triangle, i: usize, j: usize) -> f64 {
    let (low, high) = (i.min(j), i.max(j));
    match triangle {
        Triangle::Upper => data[low + high * ld],
        Triangle::Lower => data[high + low * ld],
    }
}

/// A = L Lᵀ (lower) or Uᵀ U (upper) in place, the other triangle untouched. `Err(i)`: the leading minor of order i is
/// not positive.
pub fn cholesky(n: usize, A: &mut [f64], ld: usize, triangle: Triangle) -> Result<(), usize> {
    let at = |i: usize, j: usize| match triangle {
        Triangle::Lower => i + j * ld,
        Triangle::Upper => j + i * ld,
    };
    for j in 0..n {
        let pivot = A[at(j, j)] - (0..j).map(|k| A[at(j, k)] * A[at(j, k)]).sum::<f64>();
        // A NaN fails too.
        if !(pivot > 0.0) {
            return Err(j + 1);
        }
        let root = pivot.sqrt();
        A[at(j, j)] = root;
        for i in j + 1..n {
            let rest = A[at(i, j)] - (0..j).map(|k| A[at(i, k)] * A[at(j, k)]).sum::<f64>();
            A[at(i, j)] = rest / root;
        }
    }
    Ok(())
}

/// X ← A⁻¹ X for one column, from the factor that [`cholesky`] left.
pub fn cholesky_solve(n: usize, A: &[f64], ld: usize, triangle: Triangle, x: &mut [f64]) {
    let at = |i: usize, j: usize| match triangle {
        Triangle::Lower => A[i + j * ld],
        Triangle::Upper => A[j + i * ld],
    };
    for i in 0..n {
        x[i] = (x[i] - (0..i).map(|k| at(i, k) * x[k]).sum::<f64>()) / at(i, i);
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| at(k, i) * x[k]).sum::<f64>()) / at(i, i);
    }
}

/// Entries beyond this count as overflow: products of two must be finite.
const MAX_ENTRY: f64 = 1e140;

/// Eigenvalues in ascending order and, in the same order, eigenvectors as columns. All NaN if an entry is not finite or
/// too large: solvers take that for numerical failure.
pub fn symmetric_eigen(A: DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let n = A.nrows();
    if !A.iter().all(|x| x.abs() <= MAX_ENTRY) {
        return (vec![f64::NAN; n], DMatrix::from_element(n, n, f64::NAN));
    }
    let eigen = SymmetricEigen::new(A);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let values = order.iter().map(|&i| eigen.eigenvalues[i]).collect();
    (values, DMatrix::from_fn(n, n, |i, j| eigen.eigenvectors[(i, order[j])]))
}

/// Eigenvalues in ascending order; see [`symmetric_eigen`].
pub fn symmetric_eigenvalues(A: &DMatrix<f64>) -> Vec<f64> {
    if !A.iter().all(|x| x.abs() <= MAX_ENTRY) {
        return vec![f64::NAN; A.nrows()];
    }
    let mut values: Vec<f64> = A.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// A thin singular value decomposition A = U diag(s) Vᵀ, s descending.
#[derive(Debug, Clone)]
pub struct Svd {
    /// [m × r].
    pub U: DMatrix<f64>,
    /// [r].
    pub s: Vec<f64>,
    /// [n × r].
    pub V: DMatrix<f64>,
}

/// Sweeps after which the rotations end; convergence is quadratic, and a handful is enough.
const MAX_SWEEPS: usize = 40;

/// Thin SVD of A [m × n], r = min(m, n). Columns of U that belong to a zero singular value are zero.
pub fn svd(A: &DMatrix<f64>) -> Svd {
    if A.nrows() < A.ncols() {
        let Svd { U, s, V } = svd(&A.transpose());
        return Svd { U: V, s, V: U };
    }
    let n = A.ncols();
    let mut W = A.clone();
    let mut V = DMatrix::identity(n, n);
    for _ in 0..MAX_SWEEPS {
        let mut is_done = true;
        for p in 0..n {
            for q in p + 1..n {
                let (a, b, g) =
                    (W.column(p).norm_squared(), W.column(q).norm_squared(), W.column(p).dot(&W.column(q)));
                if !(g.abs() > f64::EPSILON * (a * b).sqrt()) {
                    continue;
                }
                is_done = false;
                let zeta = (b - a) / (2.0 * g);
                let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                rotate(&mut W, p, q, c, c * t);
                rotate(&mut V, p, q, c, c * t);
            }
        }
        if is_done {
            break;
        }
    }
    let norms: Vec<f64> = W.column_iter().map(|column| column.norm()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let s: Vec<f64> = order.iter().map(|&j| norms[j]).collect();
    let unit = |w: f64, norm: f64| if norm == 0.0 { 0.0 } else { w / norm };
    Svd {
        U: DMatrix::from_fn(W.nrows(), n, |i, j| unit(W[(i, order[j])], s[j])),
        V: DMatrix::from_fn(n, n, |i, j| V[(i, order[j])]),
        s,
    }
}

/// Columns (p, q) ← (c p − s q, s p + c q).
fn rotate(M: &mut DMatrix<f64>, p: usize, q: usize, c: f64, s: f64) {
    for i in 0..M.nrows() {
        let (x, y) = (M[(i, p)], M[(i, q)]);
        M[(i, p)] = c * x - s * y;
        M[(i, q)] = s * x + c * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn matrix(m: usize, n: usize) -> impl Strategy<Value = DMatrix<f64>> {
        prop::collection::vec(-2.0..2.0_f64, m * n).prop_map(move |v| DMatrix::from_vec(m, n, v))
    }

    proptest! {
        #[test]
        fn svd_is_one(A in (1..7_usize, 1..7_usize).prop_flat_map(|(m, n)| matrix(m, n))) {
            let Svd { U, s, V } = svd(&A);
            let S = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(s.clone()));
            prop_assert!((&U * S * V.transpose() - &A).norm() < 1e-12);
            let r = s.len();
            prop_assert!((V.transpose() * &V - DMatrix::identity(r, r)).norm() < 1e-12);
            prop_assert!((U.transpose() * &U - DMatrix::identity(r, r)).norm() < 1e-12 || s[r - 1] < 1e-9);
            let expected = A.singular_values();
            for (i, s) in s.iter().enumerate() {
                prop_assert!((s - expected[i]).abs() < 1e-11, "descending, as nalgebra says");
            }
        }

        #[test]
        fn eigenvalues_ascend_and_fit_their_vectors(A in (1..8_usize).prop_flat_map(|n| matrix(n, n))) {
            let S = &A + A.transpose();
            let (values, V) = symmetric_eigen(S.clone());
            prop_assert!(values.is_sorted());
            for (j, value) in values.iter().enumerate() {
                prop_assert!((&S * V.column(j) - V.column(j) * *value).norm() < 1e-11);
            }
            for (x, y) in values.iter().zip(symmetric_eigenvalues(&S)) {
                prop_assert!((x - y).abs() < 1e-11);
            }
        }

        #[test]
        fn cholesky_of_both_triangles(A in (1..7_usize).prop_flat_map(|n| matrix(n, n))) {
            let n = A.nrows();
            let S = &A * A.transpose() + DMatrix::identity(n, n) * 0.1;
            for triangle in [Triangle::Lower, Triangle::Upper] {
                // A leading dimension above n, and a mark in the other triangle.
                let ld = n + 2;
                let mut data = vec![7.0; ld * n];
                for j in 0..n {
                    for i in 0..n {
                        let stored = match triangle { Triangle::Lower => i >= j, Triangle::Upper => i <= j };
                        if stored { data[i + j * ld] = S[(i, j)] }
                    }
                }
                cholesky(n, &mut data, ld, triangle).unwrap();
                let L = S.clone().cholesky().unwrap().l();
                for j in 0..n {
                    for i in j..n {
                        let at = match triangle { Triangle::Lower => i + j * ld, Triangle::Upper => j + i * ld };
                        prop_assert!((data[at] - L[(i, j)]).abs() < 1e-9);
                    }
                }
                let marks = data.iter().filter(|&&x| x == 7.0).count();
                prop_assert!(marks >= 2 * n + n * (n - 1) / 2);
                let x = nalgebra::DVector::from_fn(n, |i, _| 1.0 + i as f64);
                let mut b: Vec<f64> = (&S * &x).iter().copied().collect();
                cholesky_solve(n, &data, ld, triangle, &mut b);
                for i in 0..n {
                    prop_assert!((b[i] - x[i]).abs() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn what_has_no_factor_ends_all_the_same() {
        assert_eq!(cholesky(2, &mut [1.0, 2.0, 2.0, 1.0], 2, Triangle::Lower), Err(2));
        assert_eq!(cholesky(1, &mut [f64::NAN], 1, Triangle::Upper), Err(1));
        assert!(symmetric_eigenvalues(&DMatrix::from_element(4, 4, f64::NAN)).iter().all(|x| x.is_nan()));
        assert!(symmetric_eigen(DMatrix::from_element(4, 4, f64::INFINITY)).0[0].is_nan());
        assert_eq!(svd(&DMatrix::from_element(3, 3, f64::NAN)).s.len(), 3);
        assert_eq!(svd(&DMatrix::zeros(4, 4)).s, [0.0; 4]);
    }
}
