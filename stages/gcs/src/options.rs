//! Options of the stage.

use clap::Args;
use serde::{Deserialize, Serialize};

/// Options of the search for paths. The seed is that of the run.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Order of the Bézier pieces: control points less one, at least 1. Larger: more control points on the same path
    #[arg(long, default_value_t = Options::default().order)]
    pub order: usize,

    /// Paths drawn from the flows of each relaxation, besides the greedy one. Larger: better paths in hard graphs,
    /// more time
    #[arg(long, default_value_t = Options::default().n_roundings)]
    pub n_roundings: usize,

    /// Relative gap between length and lower bound at which a segment is done. Smaller: shorter paths, more time
    #[arg(long, default_value_t = Options::default().tol_gap)]
    pub tol_gap: f64,

    /// Most relaxations solved for a segment; the gap that is left is reported. Larger: smaller gaps, more time
    #[arg(long, default_value_t = Options::default().max_nodes)]
    pub max_nodes: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { order: 1, n_roundings: 8, tol_gap: 1e-4, max_nodes: 1 }
    }
}
