//! Whether a symmetric matrix is positive definite, by an interval Cholesky factorisation.
//!
//! In exact arithmetic Q is positive definite if and only if all pivots of its elimination are positive. Each pivot
//! here is an interval around the exact one; so if all of them are proven positive, Q is positive definite.

use crate::interval::Interval;

/// Whether the matrix whose upper triangle by columns is `gram` [size (size + 1) / 2] is proven positive definite.
/// A matrix that is exactly zero passes too: it is positive semidefinite.
pub fn is_positive_semidefinite(gram: &[f64], size: usize) -> bool {
    if gram.len() != size * (size + 1) / 2 || !gram.iter().all(|entry| entry.is_finite()) {
        return false;
    }
    if gram.iter().all(|&entry| entry == 0.0) {
        return true;
    }
    // Lower triangle by rows has the entries in the same order as the upper one by columns.
    let at = |row: usize, column: usize| row * (row + 1) / 2 + column;
    let mut Q: Vec<Interval> = gram.iter().map(|&entry| Interval::point(entry)).collect();
    for pivot in 0..size {
        let diagonal = Q[at(pivot, pivot)];
        if !(diagonal.lo() > 0.0) {
            return false;
        }
        let inverse = diagonal.recip();
        for row in pivot + 1..size {
            let factor = Q[at(row, pivot)] * inverse;
            for column in pivot + 1..=row {
                Q[at(row, column)] = Q[at(row, column)] - factor * Q[at(column, pivot)];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn small_matrices() {
        assert!(is_positive_semidefinite(&[2.0], 1));
        assert!(is_positive_semidefinite(&[0.0, 0.0, 0.0], 2));
        assert!(is_positive_semidefinite(&[2.0, -1.0, 2.0], 2));
        assert!(!is_positive_semidefinite(&[1.0, 2.0, 1.0], 2));
        assert!(!is_positive_semidefinite(&[-1.0], 1));
        // Singular: it can not be told from an indefinite one.
        assert!(!is_positive_semidefinite(&[1.0, 1.0, 1.0], 2));
        assert!(!is_positive_semidefinite(&[1.0, f64::NAN, 1.0], 2));
        assert!(!is_positive_semidefinite(&[1.0], 2));
    }

    proptest! {
        /// L Lᵀ + ε I passes; less its share along some direction, so that it is indefinite there, it does not.
        #[test]
        fn twins(entries in prop::collection::vec(-1.0f64..1.0, 16), v in prop::collection::vec(-1.0f64..1.0, 4)) {
            let L = nalgebra::DMatrix::from_vec(4, 4, entries);
            let v = nalgebra::DVector::from_vec(v);
            prop_assume!(v.norm() > 0.1);
            let Q = &L * L.transpose() + nalgebra::DMatrix::identity(4, 4) * 1e-6;
            let pack = |Q: &nalgebra::DMatrix<f64>| -> Vec<f64> {
                (0..4).flat_map(|c| (0..=c).map(move |r| (r, c))).map(|(r, c)| Q[(r, c)]).collect()
            };
            prop_assert!(is_positive_semidefinite(&pack(&Q), 4));
            let along = (v.transpose() * &Q * &v)[(0, 0)] / v.norm_squared();
            let u = v.normalize();
            let bad = &Q - (&u * u.transpose()) * (along * 1.001);
            prop_assert!(!is_positive_semidefinite(&pack(&bad), 4));
        }
    }
}
