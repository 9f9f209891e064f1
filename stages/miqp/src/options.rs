//! Options of the grasp plan.

use serde::{Deserialize, Serialize};

/// Options; `--key value` on the command line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, clap::Args)]
#[serde(default, deny_unknown_fields)]
pub struct MiqpOptions {
    /// Most grasps K; 0 takes the task's. Larger: longer plans are tried before giving up
    #[arg(long, default_value_t = MiqpOptions::default().max_grasps)]
    pub max_grasps: usize,
    /// Relative gap between cost and proven bound at which a plan counts as optimal. Larger: sooner, less exact
    #[arg(long, default_value_t = MiqpOptions::default().gap)]
    pub gap: f64,
    /// Most branch-and-bound nodes for one number of grasps. Larger: longer before `limit`
    #[arg(long, default_value_t = MiqpOptions::default().max_nodes)]
    pub max_nodes: u64,
}

impl Default for MiqpOptions {
    fn default() -> Self {
        Self { max_grasps: 0, gap: 1e-4, max_nodes: 20_000 }
    }
}
