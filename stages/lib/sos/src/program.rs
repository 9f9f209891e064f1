//! Programmes over identities between polynomials and sums of squares.
//!
//! ```text
//! find x, Q_t ⪰ 0    s.t.   p_0(s) + Σ_u x_u p_u(s) = Σ_t w_t(s) m_t(s)ᵀ Q_t m_t(s)    for each identity
//! ```
//!
//! and whatever else is said of x in the conic programme underneath. One equation for each monomial; the variables are
//! x and the svec of each Q (upper triangle by columns, off-diagonals times √2).

use crate::gram::{GramBasis, packed_index};
use crate::polynomial::{Monomial, Polynomial};
use conic::{Affine, ConicError, ConicProgram, Settings, SolveStatus};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// A summand w(s) m(s)ᵀ Q m(s) whose Q is sought.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// w: nonnegative where the identity is to prove something.
    pub weight: Polynomial,
    /// m.
    pub basis: GramBasis,
}

/// p_0 + Σ_u x_u p_u = Σ_t terms.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Identity {
    /// p_0.
    pub constant: Polynomial,
    /// (u, p_u); an unknown may occur more than once.
    pub slopes: Vec<(usize, Polynomial)>,
    /// The sum of squares.
    pub terms: Vec<Term>,
}

/// Names the Q of a term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TermId {
    first: usize,
    order: usize,
}

/// A programme; see the module's head.
#[derive(Debug, Clone, PartialEq)]
pub struct SosProgram {
    conic: ConicProgram,
}

/// What the solver found. Nothing of it is proof.
#[derive(Debug, Clone, PartialEq)]
pub struct SosSolution {
    /// What the solver says.
    pub status: SolveStatus,
    /// Interior point iterations.
    pub iterations: u32,
    x: Vec<f64>,
}

/// The programme could not be solved for reasons of its own.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SosError {
    /// Data that are no programme.
    #[error("sum-of-squares programme: {0}")]
    Conic(#[from] ConicError),
}

impl SosProgram {
    /// A programme in `n_unknowns` unknowns.
    pub fn new(n_unknowns: usize) -> Self {
        Self { conic: ConicProgram::new(n_unknowns) }
    }

    /// The conic programme, for the objective and further constraints on the unknowns, whose indices are its own.
    pub fn conic_mut(&mut self) -> &mut ConicProgram {
        &mut self.conic
    }

    /// Adds an identity; returns names for the Q of its terms, in their order.
    pub fn add_identity(&mut self, identity: &Identity) -> Vec<TermId> {
        let mut equations: BTreeMap<Monomial, (Vec<(usize, f64)>, f64)> = BTreeMap::new();
        for (monomial, c) in identity.constant.terms() {
            equations.entry(monomial).or_default().1 -= c;
        }
        for (unknown, p) in &identity.slopes {
            for (monomial, c) in p.terms() {
                equations.entry(monomial).or_default().0.push((*unknown, c));
            }
        }
        let mut ids = Vec::with_capacity(identity.terms.len());
        for Term { weight, basis } in &identity.terms {
            let first = self.conic.add_variables(basis.n_packed());
            ids.push(TermId { first, order: basis.order() });
            for j in 0..basis.order() {
                for i in 0..=j {
                    let index = first + packed_index(i, j);
                    let product = basis.monomials()[i].times(basis.monomials()[j]);
                    // Q_ij occurs twice, and is the entry of svec over √2.
                    let factor = if i == j { -1.0 } else { -SQRT_2 };
                    for (monomial, w) in weight.terms() {
                        equations.entry(monomial.times(product)).or_default().0.push((index, factor * w));
                    }
                }
            }
            self.conic.add_positive_semidefinite(
                (0..basis.n_packed()).map(|at| Affine::variable(first + at)).collect(),
            );
        }
        for (terms, rhs) in equations.into_values() {
            self.conic.add_equality(terms, rhs);
        }
        ids
    }

    /// Hands the programme to the solver.
    pub fn solve(&self, settings: &Settings) -> Result<SosSolution, SosError> {
        let solution = conic::solve(&self.conic, settings)?;
        Ok(SosSolution { status: solution.status, iterations: solution.iterations, x: solution.x })
    }
}

impl SosSolution {
    /// Value of an unknown.
    pub fn unknown(&self, index: usize) -> f64 {
        self.x[index]
    }

    /// Q of a term, upper triangle by columns, entries as they are.
    pub fn gram(&self, id: TermId) -> Vec<f64> {
        let mut packed = self.x[id.first..id.first + id.order * (id.order + 1) / 2].to_vec();
        for j in 0..id.order {
            for i in 0..j {
                packed[packed_index(i, j)] *= FRAC_1_SQRT_2;
            }
        }
        packed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gram::{gram_polynomial, least_eigenvalue};

    fn polynomial(terms: &[(&[u8], f64)]) -> Polynomial {
        let mut p = Polynomial::zero();
        for (exponents, c) in terms {
            p.add_term(Monomial::new(exponents), *c);
        }
        p
    }

    /// Greatest γ with p − γ = σ_0 + σ_1 (1 − s) + σ_2 (1 + s) on [−1, 1].
    fn least_value_on_interval(p: &Polynomial) -> (SosSolution, Vec<TermId>, Vec<Term>) {
        let basis = GramBasis::multilinear(&[0]);
        let term = |weight| Term { weight, basis: basis.clone() };
        let terms = vec![
            term(Polynomial::constant(1.0)),
            term(Polynomial::affine(1.0, &[-1.0])),
            term(Polynomial::affine(1.0, &[1.0])),
        ];
        let mut program = SosProgram::new(1);
        program.conic_mut().add_linear_cost(0, -1.0);
        let ids = program.add_identity(&Identity {
            constant: p.clone(),
            slopes: vec![(0, Polynomial::constant(-1.0))],
            terms: terms.clone(),
        });
        (program.solve(&Settings::default()).expect("a programme"), ids, terms)
    }

    /// A cubic on an interval is nonnegative exactly if it is such a sum: the bound is the minimum.
    #[test]
    fn cubics_on_an_interval_are_minimised_exactly() {
        // 4 s³ − 3 s has its minimum −1 at 1/2 and at −1; s³ has −1; s² − s/2 has −1/16.
        type Terms = [(&'static [u8], f64)];
        let cases: [(&Terms, f64); 3] = [
            (&[(&[3], 4.0), (&[1], -3.0)], -1.0),
            (&[(&[3], 1.0)], -1.0),
            (&[(&[2], 1.0), (&[1], -0.5)], -0.0625),
        ];
        for (terms, minimum) in cases {
            let p = polynomial(terms);
            let (solution, ids, sum) = least_value_on_interval(&p);
            assert_eq!(solution.status, SolveStatus::Solved);
            assert!((solution.unknown(0) - minimum).abs() < 1e-7, "{minimum}: {}", solution.unknown(0));
            // The identity holds, and the Gram matrices are semidefinite.
            let mut rest = p.plus(&Polynomial::constant(-solution.unknown(0)));
            for (id, term) in ids.iter().zip(&sum) {
                let gram = solution.gram(*id);
                assert!(least_eigenvalue(2, &gram) > -1e-8);
                rest.add_scaled(-1.0, &term.weight.times(&gram_polynomial(&term.basis, &gram)));
            }
            assert!(rest.terms().all(|(_, c)| c.abs() < 1e-7), "{rest:?}");
        }
    }

    /// −s² is no sum of squares: the infeasible twin.
    #[test]
    fn what_is_no_sum_of_squares_is_infeasible() {
        let identity = |c: f64| Identity {
            constant: polynomial(&[(&[2], c), (&[0], 1.0)]),
            slopes: Vec::new(),
            terms: vec![Term { weight: Polynomial::constant(1.0), basis: GramBasis::multilinear(&[0]) }],
        };
        let status = |c| {
            let mut program = SosProgram::new(0);
            program.add_identity(&identity(c));
            program.solve(&Settings::default()).expect("a programme").status
        };
        assert_eq!(status(1.0), SolveStatus::Solved);
        assert_eq!(status(-1.0), SolveStatus::PrimalInfeasible);
    }
}
