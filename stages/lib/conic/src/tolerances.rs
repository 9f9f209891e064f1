//! Tolerances handed to the solver. None of them decides a claim: they only steer how good the multipliers are that
//! the safe bounds are made of. Smaller values err towards more iterations, larger ones towards looser bounds.

/// Residual of the rows and of the reduced gradient, after the solver's scaling.
pub const TOL_FEASIBILITY: f64 = 1e-9;

/// Absolute gap between primal and dual value.
pub const TOL_GAP_ABSOLUTE: f64 = 1e-9;

/// Gap relative to the smaller of the two values.
pub const TOL_GAP_RELATIVE: f64 = 1e-9;

/// Residual of a certificate of infeasibility.
pub const TOL_INFEASIBLE: f64 = 1e-9;

/// Most interior point iterations.
pub const MAX_ITERATIONS: u32 = 100;
