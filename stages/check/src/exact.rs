//! Exact arithmetic on the `f64` of files: each is a rational number, so sums of products have one true sign.

use num_rational::BigRational;
use num_traits::Zero;
use std::cmp::Ordering;

/// A finite `f64` as a rational; `None` for NaN and infinities.
pub fn rational(x: f64) -> Option<BigRational> {
    BigRational::from_float(x)
}

/// Σ a_i x_i, exactly; `None` if a number is not finite or the lengths differ.
pub fn dot(a: &[f64], x: &[f64]) -> Option<BigRational> {
    if a.len() != x.len() {
        return None;
    }
    let mut sum = BigRational::zero();
    for (&a, &x) in a.iter().zip(x) {
        if a != 0.0 {
            sum += rational(a)? * rational(x)?;
        } else {
            rational(x)?;
        }
    }
    Some(sum)
}

/// Order of Σ a_i x_i against b, exactly; `None` if a number is not finite or the lengths differ.
///
/// A first attempt in `f64` with an error bound decides all but the closest cases.
pub fn compare_dot(a: &[f64], x: &[f64], b: f64) -> Option<Ordering> {
    if a.len() != x.len() || !b.is_finite() {
        return None;
    }
    let (mut sum, mut size) = (-b, b.abs());
    for (a, x) in a.iter().zip(x) {
        sum += a * x;
        size += (a * x).abs();
    }
    if !size.is_finite() {
        return None;
    }
    // n products and n + 1 sums, each with relative error 2^-53 of a partial sum that is at most `size`; doubled, and
    // a tiny absolute term for products that underflow.
    let error = (a.len() + 2) as f64 * 2.0 * f64::EPSILON * size + 1e-300;
    if sum > error {
        return Some(Ordering::Greater);
    }
    if sum < -error {
        return Some(Ordering::Less);
    }
    Some(dot(a, x)?.cmp(&rational(b)?))
}

/// Whether `a·x ≤ b`, exactly; false if a number is not finite.
pub fn satisfies(a: &[f64], x: &[f64], b: f64) -> bool {
    matches!(compare_dot(a, x, b), Some(Ordering::Less | Ordering::Equal))
}

/// Upper bound of |a·x − a·y|, rounded up; infinite if a number is not finite.
pub fn difference(a: &[f64], x: &[f64], y: &[f64]) -> f64 {
    use num_traits::{Signed, ToPrimitive};
    let (Some(x), Some(y)) = (dot(a, x), dot(a, y)) else { return f64::INFINITY };
    let difference = (x - y).abs();
    if difference.is_zero() { 0.0 } else { difference.to_f64().map_or(f64::INFINITY, f64::next_up) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_that_rounds_to_the_bound_is_still_told_apart() {
        // 0.1 + 0.2 rounds to a double above 0.3, and exactly is above it too.
        assert!(!satisfies(&[1.0, 1.0], &[0.1, 0.2], 0.3));
        assert!(satisfies(&[1.0, 1.0], &[0.1, 0.2], 0.1 + 0.2));
        // 1 + 2^-60 > 1 although the doubles' sum is 1.
        assert!(!satisfies(&[1.0, 1.0], &[1.0, 2f64.powi(-60)], 1.0));
        assert!(satisfies(&[1.0, 1.0], &[1.0, -(2f64.powi(-60))], 1.0));
    }

    #[test]
    fn not_a_number_satisfies_nothing() {
        assert!(!satisfies(&[1.0], &[f64::NAN], 1.0));
        assert!(!satisfies(&[f64::NAN], &[0.0], 1.0));
        assert!(!satisfies(&[1.0], &[0.0], f64::INFINITY));
        assert!(!satisfies(&[1.0], &[0.0, 0.0], 1.0));
    }

    #[test]
    fn difference_of_equal_forms_is_zero() {
        assert_eq!(difference(&[1.0, -1.0], &[0.5, 0.25], &[1.5, 1.25]), 0.0);
        assert!(difference(&[1.0, -1.0], &[0.1, 0.2], &[0.3, 0.4]) > 0.0);
    }
}
