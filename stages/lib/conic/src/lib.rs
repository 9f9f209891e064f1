//! Conic programmes over Clarabel, with bounds that hold in exact arithmetic.
//!
//! ```text
//! min ½ Σ_k w_k (d_k·x + e_k)² + c·x    s.t.  A x + s = b,  s ∈ K,  lower ≤ x ≤ upper
//! ```
//!
//! K is a product of zero, nonnegative, second-order and positive semidefinite cones. [`ConicProgram`] builds it, [`solve`] hands it to the
//! solver, whose word is never proof: [`safe_lower_bound`] and [`safe_farkas`] turn *any* vector of multipliers into
//! a bound, or a proof of infeasibility, that rests on outward-rounded arithmetic alone.

mod dense;
mod lapack_symbols;
mod program;
mod rounding;
mod safe_bound;
mod solve;
pub mod tolerances;

pub use program::{Affine, Cone, ConicProgram, Square};
pub use rounding::{RoundedSum, norm_above};
pub use safe_bound::{project_dual, safe_farkas, safe_lower_bound};
pub use solve::{ConicError, Settings, Solution, SolveStatus, solve};
