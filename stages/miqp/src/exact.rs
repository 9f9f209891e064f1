//! Exact arithmetic on configurations: doubles are dyadic rationals, so membership and equality can be decided.

use convex_sets::HPolyhedron;
use manipulation::contains_exactly;
use nalgebra::{DMatrix, DVector};
use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};

/// The value of a double; a number that is not finite, which no scene and no region holds, counts as zero.
pub fn rational(x: f64) -> BigRational {
    BigRational::from_float(x).unwrap_or_else(BigRational::zero)
}

/// The nearest double.
pub fn nearest(x: &BigRational) -> f64 {
    x.to_f64().unwrap_or(f64::NAN)
}

/// `a · x`.
fn dot<'a>(a: impl Iterator<Item = &'a f64>, x: impl Iterator<Item = &'a f64>) -> BigRational {
    a.zip(x)
        .filter(|(a, _)| **a != 0.0)
        .fold(BigRational::zero(), |sum, (&a, &x)| sum + rational(a) * rational(x))
}

/// Whether `A x ≤ b` in exact arithmetic.
pub fn contains(P: &HPolyhedron, x: &DVector<f64>) -> bool {
    x.iter().all(|x| x.is_finite())
        && (contains_exactly(P, x)
            || (0..P.n_faces())
                .all(|row_idx| dot(P.A.row(row_idx).iter(), x.iter()) <= rational(P.b[row_idx])))
}

/// Whether `F x = F y` in exact arithmetic.
pub fn same_leaf(F: &DMatrix<f64>, x: &DVector<f64>, y: &DVector<f64>) -> bool {
    F.row_iter().all(|form| dot(form.iter(), x.iter()) == dot(form.iter(), y.iter()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn membership_is_decided_on_a_face() {
        // 0.1 + 0.2 is less than the double 0.30000000000000004 and more than the double 0.3.
        let x = DVector::from_vec(vec![0.1, 0.2]);
        let face = |b: f64| HPolyhedron {
            A: DMatrix::from_row_slice(1, 2, &[1.0, 1.0]),
            b: DVector::from_vec(vec![b]),
        };
        assert!(contains(&face(0.30000000000000004), &x));
        assert!(!contains(&face(0.3), &x));
    }

    #[test]
    fn leaves_are_compared_exactly() {
        let F = DMatrix::from_row_slice(1, 2, &[1.0, -1.0]);
        let x = DVector::from_vec(vec![0.3, 0.1]);
        assert!(same_leaf(&F, &x, &x));
        assert!(!same_leaf(&F, &x, &DVector::from_vec(vec![0.2, 0.0])));
        assert!(same_leaf(&F, &DVector::from_vec(vec![0.75, 0.5]), &DVector::from_vec(vec![0.5, 0.25])));
    }
}
