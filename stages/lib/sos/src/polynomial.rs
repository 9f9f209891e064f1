//! Polynomials as coefficients by exponents.

use std::collections::BTreeMap;

/// Most variables: four bits of a word each.
pub const MAX_VARIABLES: usize = 16;

/// A product of powers s_0^e_0 s_1^e_1 …, exponents 0 to 15, four bits each.
///
/// The product of monomials adds the words. Callers keep exponents below 16: degrees here are 8 at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Monomial(u64);

impl Monomial {
    /// 1.
    pub const ONE: Monomial = Monomial(0);

    /// s_variable, for `variable` < [`MAX_VARIABLES`]; 1 beyond that.
    pub fn variable(variable: usize) -> Self {
        if variable < MAX_VARIABLES { Self(1 << (4 * variable)) } else { Self::ONE }
    }

    /// The monomial with these exponents.
    pub fn new(exponents: &[u8]) -> Self {
        let mut word = 0;
        for (variable, &exponent) in exponents.iter().enumerate().take(MAX_VARIABLES) {
            word |= u64::from(exponent.min(15)) << (4 * variable);
        }
        Self(word)
    }

    /// Exponent of s_variable.
    pub fn exponent(self, variable: usize) -> u8 {
        if variable < MAX_VARIABLES { ((self.0 >> (4 * variable)) & 15) as u8 } else { 0 }
    }

    /// The first `k` exponents.
    pub fn exponents(self, k: usize) -> Vec<u8> {
        (0..k).map(|variable| self.exponent(variable)).collect()
    }

    /// The product.
    pub fn times(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }

    /// Value at `s`; variables beyond `s` count as 1.
    pub fn value(self, s: &[f64]) -> f64 {
        s.iter().enumerate().map(|(variable, s)| s.powi(i32::from(self.exponent(variable)))).product()
    }
}

/// Σ_α c_α s^α.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polynomial {
    terms: BTreeMap<Monomial, f64>,
}

impl Polynomial {
    /// 0.
    pub fn zero() -> Self {
        Self::default()
    }

    /// A number.
    pub fn constant(c: f64) -> Self {
        Self::term(Monomial::ONE, c)
    }

    /// c s^α.
    pub fn term(monomial: Monomial, c: f64) -> Self {
        let mut p = Self::zero();
        p.add_term(monomial, c);
        p
    }

    /// c_0 + Σ_i c_i s_i.
    pub fn affine(constant: f64, slopes: &[f64]) -> Self {
        let mut p = Self::constant(constant);
        for (variable, &slope) in slopes.iter().enumerate() {
            p.add_term(Monomial::variable(variable), slope);
        }
        p
    }

    /// Adds c s^α; nothing for c = 0.
    pub fn add_term(&mut self, monomial: Monomial, c: f64) {
        if c != 0.0 {
            *self.terms.entry(monomial).or_insert(0.0) += c;
        }
    }

    /// Adds `factor` · `other`.
    pub fn add_scaled(&mut self, factor: f64, other: &Self) {
        for (&monomial, &c) in &other.terms {
            self.add_term(monomial, factor * c);
        }
    }

    /// The sum.
    pub fn plus(mut self, other: &Self) -> Self {
        self.add_scaled(1.0, other);
        self
    }

    /// The product.
    pub fn times(&self, other: &Self) -> Self {
        let mut product = Self::zero();
        for (&a, &c) in &self.terms {
            for (&b, &d) in &other.terms {
                product.add_term(a.times(b), c * d);
            }
        }
        product
    }

    /// The polynomial times a number.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut p = Self::zero();
        p.add_scaled(factor, self);
        p
    }

    /// Coefficient of s^α.
    pub fn coefficient(&self, monomial: Monomial) -> f64 {
        self.terms.get(&monomial).copied().unwrap_or(0.0)
    }

    /// Monomials and coefficients, sorted by monomial.
    pub fn terms(&self) -> impl Iterator<Item = (Monomial, f64)> + '_ {
        self.terms.iter().map(|(&monomial, &c)| (monomial, c))
    }

    /// Value at `s`.
    pub fn value(&self, s: &[f64]) -> f64 {
        self.terms().map(|(monomial, c)| c * monomial.value(s)).sum()
    }

    /// Greatest exponent of s_variable.
    pub fn degree_in(&self, variable: usize) -> u8 {
        self.terms.keys().map(|monomial| monomial.exponent(variable)).max().unwrap_or(0)
    }

    /// c_0 − Σ_{α ≠ 0} |c_α|: a lower bound on [−1, 1]^k, up to rounding.
    pub fn lower_bound_on_unit_box(&self) -> f64 {
        let others: f64 =
            self.terms().filter(|(monomial, _)| *monomial != Monomial::ONE).map(|(_, c)| c.abs()).sum();
        self.coefficient(Monomial::ONE) - others
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polynomial() -> impl Strategy<Value = Polynomial> {
        prop::collection::vec((prop::array::uniform3(0..4_u8), -2.0..2.0_f64), 0..12).prop_map(|terms| {
            let mut p = Polynomial::zero();
            for (exponents, c) in terms {
                p.add_term(Monomial::new(&exponents), c);
            }
            p
        })
    }

    proptest! {
        #[test]
        fn sums_and_products_evaluate_as_such(p in polynomial(), q in polynomial(),
                                              s in prop::array::uniform3(-1.0..1.0_f64)) {
            let (vp, vq) = (p.value(&s), q.value(&s));
            prop_assert!((p.times(&q).value(&s) - vp * vq).abs() < 1e-10);
            prop_assert!((p.clone().plus(&q.scaled(-2.0)).value(&s) - (vp - 2.0 * vq)).abs() < 1e-12);
            prop_assert!(p.lower_bound_on_unit_box() <= vp + 1e-12);
        }
    }

    #[test]
    fn exponents_are_kept_apart() {
        let m = Monomial::new(&[1, 0, 3]).times(Monomial::variable(1));
        assert_eq!(m.exponents(3), [1, 1, 3]);
        assert_eq!(m.value(&[2.0, 3.0, 1.0]), 6.0);
        let p = Polynomial::affine(1.0, &[0.0, 2.0]);
        assert_eq!((p.degree_in(0), p.degree_in(1)), (0, 1));
        assert_eq!(p.value(&[9.0, 3.0]), 7.0);
    }
}
