//! `regrasp report`: writes the report of a run again.

use crate::cli::RunArgs;
use crate::failure::{ExitCode, Failure};
use crate::report::write_report;
use crate::results::Results;
use crate::run_directory::RunDirectory;

/// Reads the run and writes its `report.html`.
pub fn report(args: &RunArgs) -> Result<ExitCode, Failure> {
    let run = RunDirectory::open(&args.run)?;
    write_report(&run, &Results::read(&run)?)?;
    super::print(format!("{}\n", run.report().display()).as_bytes())?;
    Ok(ExitCode::Done)
}
