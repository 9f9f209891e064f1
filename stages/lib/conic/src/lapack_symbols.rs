//! The eleven BLAS and LAPACK symbols that Clarabel's semidefinite cone links against, so that no system library is
//! needed. Each builds slices from the pointers and leaves the work to [`crate::dense`].
//!
//! Every matrix is column-major with a leading dimension at least its number of rows; a call with a work length of -1
//! asks for the size of the workspace, of which none is needed here.
//!
//! The only caller is Clarabel, through the crates `blas` and `lapack`, which pass Rust references of the lengths that
//! the reference BLAS and LAPACK demand. A program that links another BLAS beside this crate would define the symbols
//! twice, which the linker refuses.

#![allow(clippy::too_many_arguments, clippy::missing_safety_doc)]

use crate::dense::{self, Factor, Shape, Svd, Triangle};
use nalgebra::DMatrix;
use std::ffi::{c_char, c_int};

/// A number that Fortran passes by reference.
///
/// SAFETY of the call: `value` points to a readable value.
unsafe fn read<T: Copy>(value: *const T) -> T {
    // SAFETY: by the caller's contract.
    unsafe { *value }
}

/// A size that Fortran passes by reference; a negative one counts as 0.
///
/// SAFETY of the call: `value` points to a readable integer.
unsafe fn size(value: *const c_int) -> usize {
    // SAFETY: by the caller's contract.
    usize::try_from(unsafe { *value }).unwrap_or(0)
}

/// Number of entries that a matrix of `rows` × `columns` with leading dimension `ld` spans.
fn span(rows: usize, columns: usize, ld: usize) -> usize {
    if rows == 0 || columns == 0 { 0 } else { ld * (columns - 1) + rows }
}

/// SAFETY of the call: `data` points to `len` readable numbers that nobody writes meanwhile.
unsafe fn view<'a>(data: *const f64, len: usize) -> &'a [f64] {
    // SAFETY: by the caller's contract; an empty slice needs no memory.
    if len == 0 { &[] } else { unsafe { std::slice::from_raw_parts(data, len) } }
}

/// SAFETY of the call: `data` points to `len` numbers that only the caller reads and writes meanwhile.
unsafe fn view_mut<'a>(data: *mut f64, len: usize) -> &'a mut [f64] {
    // SAFETY: by the caller's contract; an empty slice needs no memory.
    if len == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(data, len) } }
}

fn shape(flag: c_char) -> Shape {
    match flag as u8 {
        b'N' | b'n' => Shape::Plain,
        _ => Shape::Transposed,
    }
}

fn triangle(flag: c_char) -> Triangle {
    match flag as u8 {
        b'U' | b'u' => Triangle::Upper,
        _ => Triangle::Lower,
    }
}

/// op(A) [rows × columns], from its pointer.
///
/// SAFETY of the call: `data` points to the matrix that shape and leading dimension say.
unsafe fn factor<'a>(data: *const f64, rows: usize, columns: usize, ld: usize, shape: Shape) -> Factor<'a> {
    let (stored_rows, stored_columns) = match shape {
        Shape::Plain => (rows, columns),
        Shape::Transposed => (columns, rows),
    };
    // SAFETY: by the caller's contract.
    Factor { data: unsafe { view(data, span(stored_rows, stored_columns, ld)) }, ld, shape }
}

/// C ← α op(A) op(B) + β C.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgemm_(
    transa: *const c_char,
    transb: *const c_char,
    m: *const c_int,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: BLAS's contract: the scalars are readable, A, B, C are matrices of the shapes said, C overlaps neither.
    unsafe {
        let (m, n, k, ldc) = (size(m), size(n), size(k), size(ldc));
        let A = factor(a, m, k, size(lda), shape(read(transa)));
        let B = factor(b, k, n, size(ldb), shape(read(transb)));
        dense::multiply((m, n, k), read(alpha), A, B, read(beta), view_mut(c, span(m, n, ldc)), ldc);
    }
}

/// y ← α op(A) x + β y, with strides.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgemv_(
    trans: *const c_char,
    m: *const c_int,
    n: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    x: *const f64,
    incx: *const c_int,
    beta: *const f64,
    y: *mut f64,
    incy: *const c_int,
) {
    // SAFETY: BLAS's contract; a vector with stride is a matrix of one row with that leading dimension.
    unsafe {
        let shape = shape(read(trans));
        let (rows, columns) = match shape {
            Shape::Plain => (size(m), size(n)),
            Shape::Transposed => (size(n), size(m)),
        };
        let (incx, incy) = (size(incx), size(incy));
        let A = factor(a, rows, columns, size(lda), shape);
        // xᵀ [1 × columns] and yᵀ [1 × rows]: yᵀ ← α xᵀ op(A)ᵀ + β yᵀ.
        let At = Factor { shape: if shape == Shape::Plain { Shape::Transposed } else { Shape::Plain }, ..A };
        let X = factor(x, 1, columns, incx, Shape::Plain);
        let y = view_mut(y, span(1, rows, incy));
        dense::multiply((1, rows, columns), read(alpha), X, At, read(beta), y, incy);
    }
}

/// y ← α A x + β y, A symmetric.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsymv_(
    uplo: *const c_char,
    n: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    x: *const f64,
    incx: *const c_int,
    beta: *const f64,
    y: *mut f64,
    incy: *const c_int,
) {
    // SAFETY: BLAS's contract.
    unsafe {
        let (n, lda, incx, incy) = (size(n), size(lda), size(incx), size(incy));
        let (a, x, triangle) = (view(a, span(n, n, lda)), view(x, span(1, n, incx)), triangle(read(uplo)));
        let A: Vec<f64> =
            (0..n * n).map(|at| dense::symmetric_at(a, lda, triangle, at % n, at / n)).collect();
        let A = Factor { data: &A, ld: n, shape: Shape::Plain };
        let X = Factor { data: x, ld: incx, shape: Shape::Plain };
        let y = view_mut(y, span(1, n, incy));
        dense::multiply((1, n, n), read(alpha), X, A, read(beta), y, incy);
    }
}

/// One triangle of C ← α op(A) op(A)ᵀ + β C.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyrk_(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: BLAS's contract.
    unsafe {
        let (n, k, ldc) = (size(n), size(k), size(ldc));
        let A = factor(a, n, k, size(lda), shape(read(trans)));
        let c = view_mut(c, span(n, n, ldc));
        let target = (ldc, triangle(read(uplo)));
        dense::symmetric_product((n, k), 0.5 * read(alpha), A, A, read(beta), c, target);
    }
}

/// One triangle of C ← α (op(A) op(B)ᵀ + op(B) op(A)ᵀ) + β C.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyr2k_(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: BLAS's contract.
    unsafe {
        let (n, k, ldc, shape) = (size(n), size(k), size(ldc), shape(read(trans)));
        let A = factor(a, n, k, size(lda), shape);
        let B = factor(b, n, k, size(ldb), shape);
        let c = view_mut(c, span(n, n, ldc));
        dense::symmetric_product((n, k), read(alpha), A, B, read(beta), c, (ldc, triangle(read(uplo))));
    }
}

/// Cholesky factor in place; `info` > 0: the leading minor of that order is not positive.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpotrf_(
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: LAPACK's contract.
    unsafe {
        let (n, lda) = (size(n), size(lda));
        let result = dense::cholesky(n, view_mut(a, span(n, n, lda)), lda, triangle(read(uplo)));
        *info = result.err().map_or(0, |minor| c_int::try_from(minor).unwrap_or(c_int::MAX));
    }
}

/// Solves A X = B from the factor of [`dpotrf_`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dpotrs_(
    uplo: *const c_char,
    n: *const c_int,
    nrhs: *const c_int,
    a: *const f64,
    lda: *const c_int,
    b: *mut f64,
    ldb: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: LAPACK's contract.
    unsafe {
        let (n, lda, ldb) = (size(n), size(lda), size(ldb));
        let a = view(a, span(n, n, lda));
        for column in 0..size(nrhs) {
            let x = view_mut(b.add(column * ldb), n);
            dense::cholesky_solve(n, a, lda, triangle(read(uplo)), x);
        }
        *info = 0;
    }
}

/// Solves A X = B by LU; `info` > 0: A is singular. The factors and pivots are not returned: nobody asks for them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesv_(
    n: *const c_int,
    nrhs: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    _ipiv: *mut c_int,
    b: *mut f64,
    ldb: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: LAPACK's contract.
    unsafe {
        let (n, nrhs, lda, ldb) = (size(n), size(nrhs), size(lda), size(ldb));
        let A = copy(view(a, span(n, n, lda)), n, n, lda);
        let b = view_mut(b, span(n, nrhs, ldb));
        *info = match A.lu().solve(&copy(b, n, nrhs, ldb)) {
            Some(X) => {
                store(&X, b, ldb);
                0
            }
            None => 1,
        };
    }
}

/// Eigenvalues, and eigenvectors if asked for, of a symmetric matrix; always all of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dsyevr_(
    jobz: *const c_char,
    _range: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    _vl: *const f64,
    _vu: *const f64,
    _il: *const c_int,
    _iu: *const c_int,
    _abstol: *const f64,
    m: *mut c_int,
    w: *mut f64,
    z: *mut f64,
    ldz: *const c_int,
    _isuppz: *mut c_int,
    work: *mut f64,
    lwork: *const c_int,
    iwork: *mut c_int,
    liwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: LAPACK's contract; `work` and `iwork` have at least one entry.
    unsafe {
        *info = 0;
        if read(lwork) == -1 || read(liwork) == -1 {
            (*work, *iwork) = (1.0, 1);
            return;
        }
        *m = read(n);
        let (n, lda, ldz, triangle) = (size(n), size(lda), size(ldz), triangle(read(uplo)));
        let a = view(a, span(n, n, lda));
        let A = DMatrix::from_fn(n, n, |i, j| dense::symmetric_at(a, lda, triangle, i, j));
        let w = view_mut(w, n);
        if read(jobz) as u8 == b'V' {
            let (values, V) = dense::symmetric_eigen(A);
            w.copy_from_slice(&values);
            store(&V, view_mut(z, span(n, n, ldz)), ldz);
        } else {
            w.copy_from_slice(&dense::symmetric_eigenvalues(&A));
        }
    }
}

/// Thin singular value decomposition; the job must be 'S'.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesdd_(
    _jobz: *const c_char,
    m: *const c_int,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: *const c_int,
    vt: *mut f64,
    ldvt: *const c_int,
    work: *mut f64,
    lwork: *const c_int,
    _iwork: *mut c_int,
    info: *mut c_int,
) {
    // SAFETY: LAPACK's contract; `work` has at least one entry.
    unsafe {
        *info = 0;
        if read(lwork) == -1 {
            *work = 1.0;
            return;
        }
        let (m, n, ldu, ldvt) = (size(m), size(n), size(ldu), size(ldvt));
        let lda = size(lda);
        let r = m.min(n);
        let Svd { U, s: values, V } = dense::svd(&copy(view(a, span(m, n, lda)), m, n, lda));
        view_mut(s, r).copy_from_slice(&values);
        store(&U, view_mut(u, span(m, r, ldu)), ldu);
        store(&V.transpose(), view_mut(vt, span(r, n, ldvt)), ldvt);
    }
}

/// As [`dgesdd_`]; both jobs must be 'S'.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dgesvd_(
    jobu: *const c_char,
    _jobvt: *const c_char,
    m: *const c_int,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: *const c_int,
    vt: *mut f64,
    ldvt: *const c_int,
    work: *mut f64,
    lwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the same contract, less the integer workspace, which is not used.
    unsafe {
        dgesdd_(jobu, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, std::ptr::null_mut(), info);
    }
}

fn copy(data: &[f64], rows: usize, columns: usize, ld: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |i, j| data[i + j * ld])
}

fn store(M: &DMatrix<f64>, data: &mut [f64], ld: usize) {
    for j in 0..M.ncols() {
        for i in 0..M.nrows() {
            data[i + j * ld] = M[(i, j)];
        }
    }
}

#[cfg(test)]
mod tests;
