//! Polynomials in s ∈ [−1, 1]^k whose coefficients are known to intervals.

use crate::interval::Interval;
use std::collections::BTreeMap;

/// Exponents of a monomial, eight bits a variable: the product of monomials is the sum of their keys.
pub type Monomial = u128;

/// Most variables.
pub const MAX_VARIABLES: usize = 16;

/// The monomial `s_i^exponent`; `None` beyond [`MAX_VARIABLES`].
pub fn power(i: usize, exponent: u8) -> Option<Monomial> {
    (i < MAX_VARIABLES).then(|| Monomial::from(exponent) << (8 * i))
}

/// A polynomial; degrees in each variable stay below 256, which callers see to.
#[derive(Debug, Clone, Default)]
pub struct Polynomial {
    coefficients: BTreeMap<Monomial, Interval>,
}

impl Polynomial {
    /// A number.
    pub fn constant(value: Interval) -> Self {
        let mut p = Self::default();
        p.add_term(0, value);
        p
    }

    /// c_0 + Σ c_i s_i.
    pub fn affine(constant: Interval, linear: impl IntoIterator<Item = Interval>) -> Self {
        let mut p = Self::constant(constant);
        for (i, c) in linear.into_iter().enumerate().take(MAX_VARIABLES) {
            p.add_term(1 << (8 * i), c);
        }
        p
    }

    /// Adds `coefficient · monomial`.
    pub fn add_term(&mut self, monomial: Monomial, coefficient: Interval) {
        if coefficient == Interval::ZERO {
            return;
        }
        self.coefficients.entry(monomial).and_modify(|sum| *sum = *sum + coefficient).or_insert(coefficient);
    }

    /// The sum.
    pub fn plus(mut self, other: &Self) -> Self {
        for (&monomial, &coefficient) in &other.coefficients {
            self.add_term(monomial, coefficient);
        }
        self
    }

    /// The difference.
    pub fn minus(mut self, other: &Self) -> Self {
        for (&monomial, &coefficient) in &other.coefficients {
            self.add_term(monomial, -coefficient);
        }
        self
    }

    /// The product with a number.
    pub fn scaled(&self, factor: Interval) -> Self {
        let mut p = Self::default();
        for (&monomial, &coefficient) in &self.coefficients {
            p.add_term(monomial, factor * coefficient);
        }
        p
    }

    /// The product.
    pub fn times(&self, other: &Self) -> Self {
        let mut p = Self::default();
        for (&m1, &c1) in &self.coefficients {
            for (&m2, &c2) in &other.coefficients {
                p.add_term(m1 + m2, c1 * c2);
            }
        }
        p
    }

    /// Lower bound on [−1, 1]^k: the constant term less the magnitudes of all others, since |s^α| ≤ 1.
    pub fn lower_bound(&self) -> f64 {
        let mut bound = Interval::ZERO;
        for (&monomial, &coefficient) in &self.coefficients {
            bound = if monomial == 0 {
                bound + coefficient
            } else {
                bound - Interval::point(coefficient.magnitude())
            };
        }
        bound.lo()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(p: &Polynomial, s: [f64; 2]) -> f64 {
        let monomial = |m: Monomial| s[0].powi((m & 255) as i32) * s[1].powi((m >> 8) as i32);
        p.coefficients.iter().map(|(&m, c)| monomial(m) * 0.5 * (c.lo() + c.hi())).sum()
    }

    fn polynomial(c: [f64; 4]) -> Polynomial {
        let mut p = Polynomial::affine(Interval::point(c[0]), [c[1], c[2]].map(Interval::point));
        p.add_term(power(0, 2).unwrap() + power(1, 1).unwrap(), Interval::point(c[3]));
        p
    }

    proptest! {
        /// Sums, products and the bound agree with values at points.
        #[test]
        fn arithmetic_is_that_of_values(a in prop::array::uniform4(-2.0f64..2.0), b in prop::array::uniform4(-2.0f64..2.0),
                                        s in prop::array::uniform2(-1.0f64..1.0)) {
            let (p, r) = (polynomial(a), polynomial(b));
            let (vp, vr) = (value(&p, s), value(&r, s));
            prop_assert!((value(&p.times(&r), s) - vp * vr).abs() < 1e-12);
            prop_assert!((value(&p.clone().plus(&r), s) - (vp + vr)).abs() < 1e-12);
            prop_assert!((value(&p.clone().minus(&r), s) - (vp - vr)).abs() < 1e-12);
            prop_assert!((value(&p.scaled(Interval::point(3.0)), s) - 3.0 * vp).abs() < 1e-12);
            prop_assert!(p.lower_bound() <= vp);
        }
    }

    #[test]
    fn terms_that_cancel_leave_next_to_nothing() {
        let p = polynomial([1.0, 2.0, 3.0, 4.0]);
        let rest = p.clone().minus(&p);
        assert!(rest.lower_bound() > -1e-14);
    }
}
