//! `report.html`: a run on one page, without anything from elsewhere.

mod bars;
mod page;
mod slices;
mod statement;
mod svg;
mod tables;
mod timeline;

use crate::failure::Failure;
use crate::results::Results;
use crate::run_directory::RunDirectory;

/// Writes the report of a run.
pub fn write_report(run: &RunDirectory, results: &Results) -> Result<(), Failure> {
    let page = page::page(&run.path().display().to_string(), results);
    Ok(ipc_types::store::write_at_once(&run.report(), page.as_bytes())?)
}
