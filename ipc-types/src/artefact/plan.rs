//! `plan.bin` / `plan.json`: grasp and release configurations.

use serde::{Deserialize, Serialize};

/// Whether the object rests or is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// The robot moves alone, the object rests.
    Transit,
    /// The robot moves the object it holds.
    Transfer,
}

/// What is known of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlanStatus {
    /// Fewest grasps, and least cost among these within the gap of the options: proven by bounds that hold in
    /// exact arithmetic.
    Optimal,
    /// A plan; fewer grasps or less cost may be possible.
    Feasible,
    /// No plan with at most K grasps over these regions: proven.
    Infeasible,
}

/// Outcome for one number of grasps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TriedStatus {
    /// Proven to have no plan.
    Infeasible,
    /// Solved, gap closed.
    Optimal,
    /// A plan was found, the gap is open.
    Feasible,
    /// A limit was hit without a plan and without a proof.
    Limit,
}

/// What was found for ℓ grasps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// ℓ.
    pub n_grasps: usize,
    /// Outcome.
    pub status: TriedStatus,
    /// Why, in words.
    pub reason: String,
    /// Least cost found; `None` (null) without a plan.
    pub cost: Option<f64>,
    /// Proven lower bound on the cost; `None` (null) if infeasible.
    pub lower_bound: Option<f64>,
    /// Branch-and-bound nodes.
    pub nodes: u64,
}

/// The grasp plan x_0 … x_{2ℓ+1} (thesis 2, eq. 5.8).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanFile {
    /// What is known.
    pub status: PlanStatus,
    /// ℓ; `None` (null) if infeasible.
    pub n_grasps: Option<usize>,
    /// x_0 … x_{2ℓ+1}; `None` (null) if infeasible.
    pub configurations: Option<Vec<Vec<f64>>>,
    /// Id of the region that holds each configuration; `None` (null) if infeasible.
    pub regions: Option<Vec<u64>>,
    /// Mode of each of the 2ℓ+1 segments; `None` (null) if infeasible.
    pub modes: Option<Vec<Mode>>,
    /// Sum of squared steps (eq. 5.7).
    pub cost: Option<f64>,
    /// Proven lower bound on the cost with `n_grasps` grasps.
    pub lower_bound: Option<f64>,
    /// One final entry for each ℓ from 1 on.
    pub tried: Vec<Tried>,
}
