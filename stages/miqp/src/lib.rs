//! Fewest grasps: the mixed-integer quadratic programme of thesis 2, Eq. 5.8, by branch and bound.
//!
//! ```text
//! min Σ_i ‖x_{i+1} - x_i‖²                                   x_0 = q_init, x_{2ℓ+1} = q_goal          (5.7)
//! s.t. F_transit  x_{2i}   = F_transit  x_{2i+1}             i = 0 … ℓ                                (5.5c)
//!      F_transfer x_{2i+1} = F_transfer x_{2i+2}             i = 0 … ℓ-1                              (5.5a, 5.5b)
//!      x_i ∈ ∪_j CG ∩ CP ∩ P_j                               i = 1 … 2ℓ                               (5.4, 5.6a, 5.6b)
//!      x_{2i},   x_{2i+1} in one connected region of CP_free                                          (5.6c to 5.6e)
//!      x_{2i+1}, x_{2i+2} in one connected region of CG_free                                          (the same for transfers)
//!      leaf cuts                                             for segments known to have no path
//! ```
//!
//! The smallest ℓ with a solution is taken. *Infeasible* and *optimal* are proofs: they rest on multipliers evaluated
//! with outward rounding ([`conic::safe_lower_bound`], [`conic::safe_farkas`]), and connected regions join polytopes
//! whose closed intersection is not proven empty. *Optimal* means that cost and proven bound differ by at most the
//! option `gap`, relative to the cost. Every configuration lies in its region in exact arithmetic.

pub mod assignment;
pub mod branch_and_bound;
pub mod cut;
mod error;
pub mod exact;
pub mod fixed_regions;
pub mod grasp_bound;
mod grasp_plan;
pub mod hull;
pub mod instance;
pub mod kept_system;
pub mod node;
mod options;
pub mod proof;
pub mod relaxation;
mod stage;

pub use error::MiqpError;
pub use grasp_plan::{NoSink, PlanOutcome, PlanSink, Question, plan};
pub use options::MiqpOptions;
pub use stage::MiqpStage;
