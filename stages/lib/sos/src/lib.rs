//! Polynomials of several variables and programmes over sums of squares.
//!
//! - [`Polynomial`], [`Monomial`]: coefficients by exponents; the degree counts in each variable by itself.
//! - [`GramBasis`]: the monomials m of a Gram form m(s)ᵀ Q m(s).
//! - [`SosProgram`]: find multipliers so that polynomials that are affine in unknowns equal Σ w(s) m(s)ᵀ Q m(s).
//!
//! Source: Parrilo 2003; Blekherman, Parrilo & Thomas 2012, chapter 3.

mod gram;
mod polynomial;
mod program;

pub use gram::{GramBasis, gram_polynomial, is_positive_definite, least_eigenvalue, packed_index};
pub use polynomial::{MAX_VARIABLES, Monomial, Polynomial};
pub use program::{Identity, SosError, SosProgram, SosSolution, Term, TermId};
