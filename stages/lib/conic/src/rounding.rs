//! Sums of products with a rigorous error bound.
//!
//! Source: Higham 2002, section 3.1: |fl(Σ a_i b_i) − Σ a_i b_i| ≤ γ_n Σ |a_i b_i|, γ_n = n u / (1 − n u), u = 2⁻⁵³,
//! in any order of summation, apart from underflow, which adds less than the smallest normal number a product.

/// A running sum of products and numbers, and what is needed to bound its rounding error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RoundedSum {
    value: f64,
    magnitude: f64,
    n_terms: u64,
}

impl RoundedSum {
    /// Adds `a · b`.
    pub fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.value += product;
        self.magnitude += product.abs();
        self.n_terms += 1;
    }

    /// Adds `a`.
    pub fn add(&mut self, a: f64) {
        self.add_product(a, 1.0);
    }

    /// The sum as computed.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// A number not above the exact sum; -∞ if the sum overflowed.
    pub fn lower(&self) -> f64 {
        let lower = (self.value - self.error()).next_down();
        if lower.is_nan() { f64::NEG_INFINITY } else { lower }
    }

    /// A number not below the exact sum; +∞ if the sum overflowed.
    pub fn upper(&self) -> f64 {
        let upper = (self.value + self.error()).next_up();
        if upper.is_nan() { f64::INFINITY } else { upper }
    }

    /// Bound on |value − exact sum|. The true magnitude is at most the computed one over 1 − γ_n, so twice n u times
    /// the computed one suffices for every n below 2⁵⁰; ε is 2 u, and the two steps to spare cover the roundings here.
    fn error(&self) -> f64 {
        let n = self.n_terms as f64;
        (n + 2.0) * f64::EPSILON * self.magnitude + n * f64::MIN_POSITIVE
    }
}

/// A number not below ‖v‖₂.
pub fn norm_above(v: &[f64]) -> f64 {
    let mut squares = RoundedSum::default();
    for &component in v {
        squares.add_product(component, component);
    }
    // The square root is correctly rounded: one step up is above it.
    squares.upper().max(0.0).sqrt().next_up()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exact value is 1, ordinary summation gives 0: the enclosure must hold both.
    #[test]
    fn cancellation_stays_enclosed() {
        let mut sum = RoundedSum::default();
        sum.add(1e17);
        sum.add(1.0);
        sum.add(-1e17);
        assert!(sum.lower() <= 1.0 && 1.0 <= sum.upper());
        assert!(sum.upper() - sum.lower() < 1e3);
    }

    #[test]
    fn overflow_bounds_nothing() {
        let mut sum = RoundedSum::default();
        sum.add_product(1e300, 1e300);
        sum.add_product(-1e300, 1e300);
        assert_eq!(sum.lower(), f64::NEG_INFINITY);
        assert_eq!(sum.upper(), f64::INFINITY);
    }

    #[test]
    fn norm_is_above_and_near() {
        assert!(norm_above(&[3.0, 4.0]) >= 5.0);
        assert!(norm_above(&[3.0, 4.0]) < 5.0 + 1e-13);
        assert!(norm_above(&[]) >= 0.0);
        assert_eq!(norm_above(&[f64::NAN]), f64::INFINITY);
    }

    proptest::proptest! {
        /// Multiples of 2⁻¹⁰ sum exactly in i64.
        #[test]
        fn the_exact_sum_is_enclosed(terms in proptest::collection::vec((-4096..4096_i64, -4096..4096_i64), 0..200)) {
            let mut sum = RoundedSum::default();
            let mut exact = 0_i64;
            for &(a, b) in &terms {
                sum.add_product(a as f64 / 1024.0, b as f64 / 1024.0);
                exact += a * b;
            }
            let exact = exact as f64 / (1024.0 * 1024.0);
            proptest::prop_assert!(sum.lower() <= exact && exact <= sum.upper());
        }
    }
}
