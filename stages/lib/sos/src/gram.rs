//! Gram forms m(s)ᵀ Q m(s).

use crate::polynomial::{MAX_VARIABLES, Monomial, Polynomial};
use nalgebra::DMatrix;

/// The monomials m of a Gram form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GramBasis(Vec<Monomial>);

impl GramBasis {
    /// All products of the given variables, each to the power 0 or 1: 2^(number of variables) monomials, 1 first.
    pub fn multilinear(variables: &[usize]) -> Self {
        let mut monomials = vec![Monomial::ONE];
        for &variable in variables.iter().take(MAX_VARIABLES) {
            for at in 0..monomials.len() {
                monomials.push(monomials[at].times(Monomial::variable(variable)));
            }
        }
        Self(monomials)
    }

    /// These monomials.
    pub fn new(monomials: Vec<Monomial>) -> Self {
        Self(monomials)
    }

    /// The monomials.
    pub fn monomials(&self) -> &[Monomial] {
        &self.0
    }

    /// Order of Q.
    pub fn order(&self) -> usize {
        self.0.len()
    }

    /// Number of entries of a triangle of Q.
    pub fn n_packed(&self) -> usize {
        self.0.len() * (self.0.len() + 1) / 2
    }
}

/// Position of entry (i, j) in the upper triangle by columns.
pub fn packed_index(i: usize, j: usize) -> usize {
    i.min(j) + i.max(j) * (i.max(j) + 1) / 2
}

/// m(s)ᵀ Q m(s), Q as its upper triangle by columns (entries as they are). Entries that are missing count as 0.
pub fn gram_polynomial(basis: &GramBasis, packed: &[f64]) -> Polynomial {
    let mut p = Polynomial::zero();
    for j in 0..basis.order() {
        for i in 0..=j {
            let q = packed.get(packed_index(i, j)).copied().unwrap_or(0.0);
            p.add_term(basis.0[i].times(basis.0[j]), if i == j { q } else { 2.0 * q });
        }
    }
    p
}

fn matrix(order: usize, packed: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(order, order, |i, j| packed.get(packed_index(i, j)).copied().unwrap_or(0.0))
}

/// Least eigenvalue of the symmetric matrix of this order; NaN if it has entries that are not finite.
pub fn least_eigenvalue(order: usize, packed: &[f64]) -> f64 {
    if !packed.iter().all(|q| q.is_finite()) {
        return f64::NAN;
    }
    match order {
        0 => f64::INFINITY,
        1 => packed.first().copied().unwrap_or(0.0),
        _ => matrix(order, packed).symmetric_eigenvalues().min(),
    }
}

/// Whether the matrix less `margin` times its greatest diagonal entry has a Cholesky factor, in ordinary arithmetic.
pub fn is_positive_definite(order: usize, packed: &[f64], margin: f64) -> bool {
    let mut M = matrix(order, packed);
    let shift = margin * M.diagonal().iter().fold(0.0, |most: f64, d| most.max(d.abs()));
    for i in 0..order {
        M[(i, i)] -= shift;
    }
    M.iter().all(|q| q.is_finite()) && M.cholesky().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gram_form_is_the_quadratic_form_of_its_monomials() {
        let basis = GramBasis::multilinear(&[0, 2]);
        assert_eq!(basis.order(), 4);
        assert_eq!(basis.monomials()[3], Monomial::new(&[1, 0, 1]));
        let packed: Vec<f64> = (0..basis.n_packed()).map(|at| 1.0 + at as f64).collect();
        let s = [0.3, 5.0, -0.7];
        let m: Vec<f64> = basis.monomials().iter().map(|monomial| monomial.value(&s)).collect();
        let expected: f64 = (0..4)
            .flat_map(|i| (0..4).map(move |j| (i, j)))
            .map(|(i, j)| m[i] * m[j] * packed[packed_index(i, j)])
            .sum();
        assert!((gram_polynomial(&basis, &packed).value(&s) - expected).abs() < 1e-12);
    }

    #[test]
    fn definiteness_of_both_kinds() {
        assert!(is_positive_definite(2, &[2.0, 1.0, 2.0], 0.4));
        assert!(!is_positive_definite(2, &[2.0, 1.0, 2.0], 0.6), "eigenvalues 1 and 3");
        assert!(!is_positive_definite(2, &[1.0, 2.0, 1.0], 0.0));
        assert!(!is_positive_definite(1, &[f64::NAN], 0.0));
        assert!((least_eigenvalue(2, &[2.0, 1.0, 2.0]) - 1.0).abs() < 1e-14);
        assert!(least_eigenvalue(2, &[f64::NAN, 0.0, 0.0]).is_nan());
        assert_eq!(least_eigenvalue(1, &[-3.0]), -3.0);
    }
}
