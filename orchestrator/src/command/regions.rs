//! `regrasp regions`: the regions of a scene and their certificates, without a plan.

use super::new_run::{new_run, request};
use crate::cli::RegionsArgs;
use crate::failure::{ExitCode, Failure};
use crate::run_record::Asked;
use crate::stage::StageOptions;
use ipc_types::stage_name::StageName;

/// Decomposes, certifies, records, reports.
pub fn regions(args: &RegionsArgs) -> Result<ExitCode, Failure> {
    let mut options = StageOptions::default();
    if args.cover {
        options.insert(StageName::Decompose, "cover", true.to_string());
    }
    if !args.region_at.is_empty() {
        options.insert(StageName::Decompose, "region_at", args.region_at.join(";"));
    }
    if let Some(radius) = args.radius {
        options.insert(StageName::Decompose, "domain_radius", radius.to_string());
    }
    new_run(&args.run, &request(&args.run, Asked::Regions, options)?)
}
