//! Each symbol against nalgebra, with leading dimensions above the number of rows.

use super::*;
use nalgebra::{DMatrix, DVector};

/// Deterministic numbers in (-1, 1).
fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

/// A random matrix, and its entries with two more rows of padding.
fn padded(rows: usize, columns: usize, seed: u64) -> (DMatrix<f64>, Vec<f64>) {
    let data = numbers((rows + 2) * columns, seed);
    (copy(&data, rows, columns, rows + 2), data)
}

fn close(A: &DMatrix<f64>, B: &DMatrix<f64>) {
    assert!((A - B).norm() < 1e-12, "{A} is not {B}");
}

fn int(value: usize) -> c_int {
    value as c_int
}

fn flag(value: u8) -> c_char {
    value as c_char
}

#[test]
fn dgemm_of_all_shapes() {
    let (m, n, k) = (3, 4, 5);
    for (ta, tb) in [(b'N', b'N'), (b'T', b'N'), (b'N', b'T'), (b'T', b'T')] {
        let (A, a) = if ta == b'N' { padded(m, k, 1) } else { padded(k, m, 1) };
        let (B, b) = if tb == b'N' { padded(k, n, 2) } else { padded(n, k, 2) };
        let (C, mut c) = padded(m, n, 3);
        let (lda, ldb, ldc) = (int(A.nrows() + 2), int(B.nrows() + 2), int(m + 2));
        // SAFETY: the slices hold the matrices of the shapes said.
        unsafe {
            let (ta, tb) = (flag(ta), flag(tb));
            let (a, b, c) = (a.as_ptr(), b.as_ptr(), c.as_mut_ptr());
            dgemm_(&ta, &tb, &int(m), &int(n), &int(k), &2.0, a, &lda, b, &ldb, &0.5, c, &ldc);
        }
        let A = if ta == b'N' { A } else { A.transpose() };
        let B = if tb == b'N' { B } else { B.transpose() };
        close(&copy(&c, m, n, m + 2), &(A * B * 2.0 + C * 0.5));
    }
}

#[test]
fn dgemv_and_dsymv_with_strides() {
    let (A, a) = padded(3, 4, 1);
    for transpose in [false, true] {
        let (rows, columns) = if transpose { (4, 3) } else { (3, 4) };
        let (x, mut y) = (numbers(2 * columns, 2), numbers(3 * rows, 3));
        let X = DVector::from_fn(columns, |i, _| x[2 * i]);
        let Y = DVector::from_fn(rows, |i, _| y[3 * i]);
        let op = if transpose { A.transpose() } else { A.clone() };
        // SAFETY: the slices hold what the sizes and strides say.
        unsafe {
            let trans = flag(if transpose { b'T' } else { b'N' });
            let (a, x, y) = (a.as_ptr(), x.as_ptr(), y.as_mut_ptr());
            dgemv_(&trans, &3, &4, &2.0, a, &5, x, &2, &0.5, y, &3);
        }
        let expected = op * X * 2.0 + Y * 0.5;
        assert!((0..rows).all(|i| (y[3 * i] - expected[i]).abs() < 1e-13));
    }
    let (S, s) = padded(4, 4, 4);
    for (uplo, part) in [(b'U', S.upper_triangle()), (b'L', S.lower_triangle())] {
        let full = &part + part.transpose() - DMatrix::from_diagonal(&part.diagonal());
        let (x, mut y) = (numbers(4, 5), numbers(4, 6));
        let expected = full * DVector::from_vec(x.clone()) * 2.0 + DVector::from_vec(y.clone()) * 0.5;
        // SAFETY: as above.
        unsafe { dsymv_(&flag(uplo), &4, &2.0, s.as_ptr(), &6, x.as_ptr(), &1, &0.5, y.as_mut_ptr(), &1) };
        assert!((0..4).all(|i| (y[i] - expected[i]).abs() < 1e-13));
    }
}

#[test]
fn dsyrk_and_dsyr2k_touch_one_triangle() {
    let (n, k) = (4, 3);
    for (uplo, trans) in [(b'U', b'N'), (b'L', b'T')] {
        let (A, a) = if trans == b'N' { padded(n, k, 1) } else { padded(k, n, 1) };
        let (B, b) = if trans == b'N' { padded(n, k, 2) } else { padded(k, n, 2) };
        let (C, mut c) = padded(n, n, 3);
        let mut c2 = c.clone();
        let (ld, ldc) = (int(A.nrows() + 2), int(n + 2));
        // SAFETY: the slices hold the matrices of the shapes said.
        unsafe {
            let (uplo, trans) = (flag(uplo), flag(trans));
            let (a, b) = (a.as_ptr(), b.as_ptr());
            dsyrk_(&uplo, &trans, &int(n), &int(k), &2.0, a, &ld, &0.5, c.as_mut_ptr(), &ldc);
            dsyr2k_(&uplo, &trans, &int(n), &int(k), &2.0, a, &ld, b, &ld, &0.0, c2.as_mut_ptr(), &ldc);
        }
        let op = |M: &DMatrix<f64>| if trans == b'N' { M.clone() } else { M.transpose() };
        let (A, B) = (op(&A), op(&B));
        let rank_k = &A * A.transpose() * 2.0 + &C * 0.5;
        let rank_2k = (&A * B.transpose() + &B * A.transpose()) * 2.0;
        let (c, c2) = (copy(&c, n, n, n + 2), copy(&c2, n, n, n + 2));
        for j in 0..n {
            for i in 0..n {
                let written = if uplo == b'U' { i <= j } else { i >= j };
                let expected = if written { rank_k[(i, j)] } else { C[(i, j)] };
                assert!((c[(i, j)] - expected).abs() < 1e-13);
                let expected = if written { rank_2k[(i, j)] } else { C[(i, j)] };
                assert!((c2[(i, j)] - expected).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn dpotrf_dpotrs_and_dgesv_solve() {
    let (A, _) = padded(4, 4, 1);
    let S = &A * A.transpose() + DMatrix::identity(4, 4);
    let (B, b) = padded(4, 2, 2);
    let expected = S.clone().lu().solve(&B).unwrap();
    for uplo in [b'U', b'L'] {
        let (mut factor, mut x, mut info) = (S.as_slice().to_vec(), b.clone(), -7);
        // SAFETY: the slices hold the matrices of the shapes said.
        unsafe {
            dpotrf_(&flag(uplo), &4, factor.as_mut_ptr(), &4, &mut info);
            assert_eq!(info, 0);
            dpotrs_(&flag(uplo), &4, &2, factor.as_ptr(), &4, x.as_mut_ptr(), &6, &mut info);
        }
        assert_eq!(info, 0);
        close(&copy(&x, 4, 2, 6), &expected);
    }
    let (mut a, mut x, mut pivots, mut info) = (S.as_slice().to_vec(), b.clone(), [0; 4], -7);
    // SAFETY: as above.
    unsafe { dgesv_(&4, &2, a.as_mut_ptr(), &4, pivots.as_mut_ptr(), x.as_mut_ptr(), &6, &mut info) };
    assert_eq!(info, 0);
    close(&copy(&x, 4, 2, 6), &expected);
    let mut singular = vec![0.0; 16];
    // SAFETY: as above.
    unsafe {
        dgesv_(&4, &2, singular.as_mut_ptr(), &4, pivots.as_mut_ptr(), x.as_mut_ptr(), &6, &mut info);
        assert!(info > 0);
        dpotrf_(&flag(b'L'), &4, singular.as_mut_ptr(), &4, &mut info);
    }
    assert_eq!(info, 1);
}

#[test]
fn dsyevr_asks_then_gives_values_and_vectors() {
    let (A, _) = padded(5, 5, 1);
    let S = &A + A.transpose();
    let (mut w, mut z, mut support) = ([0.0; 5], [0.0; 25], [0; 10]);
    let (mut m, mut info, mut work, mut iwork) = (0, -7, [0.0], [0]);
    let mut call = |job: u8, lwork: c_int| {
        let mut a = S.as_slice().to_vec();
        // SAFETY: the slices hold the matrices of the shapes said.
        unsafe {
            dsyevr_(
                &flag(job),
                &flag(b'A'),
                &flag(b'U'),
                &5,
                a.as_mut_ptr(),
                &5,
                &0.0,
                &0.0,
                &0,
                &0,
                &-1.0,
                &mut m,
                w.as_mut_ptr(),
                z.as_mut_ptr(),
                &5,
                support.as_mut_ptr(),
                work.as_mut_ptr(),
                &lwork,
                iwork.as_mut_ptr(),
                &lwork,
                &mut info,
            );
        }
        (w, work[0], info)
    };
    assert_eq!((call(b'N', -1).1, call(b'N', -1).2), (1.0, 0));
    let (values, ..) = call(b'N', 1);
    assert_eq!(call(b'V', 1).2, 0);
    assert!(values.is_sorted());
    assert_eq!(m, 5);
    let V = DMatrix::from_column_slice(5, 5, &z);
    close(&(S * &V), &(&V * DMatrix::from_diagonal(&DVector::from_column_slice(&values))));
}

#[test]
fn dgesdd_and_dgesvd_agree_with_nalgebra() {
    for (m, n) in [(4, 4), (5, 3), (3, 5)] {
        let r = m.min(n);
        let (A, a) = padded(m, n, 9);
        for by_division in [true, false] {
            let (mut a, mut s, mut u, mut vt) = (a.clone(), vec![0.0; r], vec![0.0; m * r], vec![0.0; r * n]);
            let (mut work, mut iwork, mut info) = ([0.0], [0], -7);
            let job = flag(b'S');
            let (mi, ni, lda, ldvt) = (int(m), int(n), int(m + 2), int(r));
            // SAFETY: the slices hold the matrices of the shapes said.
            unsafe {
                let (a, s, u, vt) = (a.as_mut_ptr(), s.as_mut_ptr(), u.as_mut_ptr(), vt.as_mut_ptr());
                let (work, iwork, info) = (work.as_mut_ptr(), iwork.as_mut_ptr(), &mut info);
                for lwork in [-1, 1] {
                    if by_division {
                        dgesdd_(&job, &mi, &ni, a, &lda, s, u, &mi, vt, &ldvt, work, &lwork, iwork, info);
                    } else {
                        dgesvd_(&job, &job, &mi, &ni, a, &lda, s, u, &mi, vt, &ldvt, work, &lwork, info);
                    }
                }
            }
            assert_eq!((info, work[0]), (0, 1.0));
            let S = DMatrix::from_diagonal(&DVector::from_vec(s.clone()));
            close(&(copy(&u, m, r, m) * S * copy(&vt, r, n, r)), &A);
            for (found, expected) in s.iter().zip(&A.singular_values()) {
                assert!((found - expected).abs() < 1e-12);
            }
        }
    }
}
