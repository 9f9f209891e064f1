//! `regrasp plan`: from scene to certified plan.

use super::new_run::{new_run, request};
use crate::cli::PlanArgs;
use crate::failure::{ExitCode, Failure};
use crate::run_record::Asked;
use crate::stage::StageOptions;
use ipc_types::stage_name::StageName;

/// Plans, records, reports.
pub fn plan(args: &PlanArgs) -> Result<ExitCode, Failure> {
    let mut options = StageOptions::default();
    if let Some(max_grasps) = args.max_grasps {
        options.insert(StageName::Miqp, "max_grasps", max_grasps.to_string());
    }
    new_run(&args.run, &request(&args.run, Asked::Plan, options)?)
}
