//! The commands of `regrasp`, one file each. A command ends with an exit code or with a failure for people.

mod clean;
mod delegate;
mod list_stages;
mod new_run;
mod plan;
mod profile;
mod regions;
mod report;
mod rerun;
mod show;

use crate::cli::Command;
use crate::failure::{ExitCode, Failure};

/// Does what the command line asks.
pub fn run(command: &Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Plan(args) => plan::plan(args),
        Command::Regions(args) => regions::regions(args),
        Command::Rerun(args) => rerun::rerun(args),
        Command::Check(args) => delegate::check(args),
        Command::CertifyPath(args) => delegate::certify_path(args),
        Command::Show(args) => show::show(args),
        Command::Report(args) => report::report(args),
        Command::Profile(args) => profile::profile(args),
        Command::Stages(args) => list_stages::list_stages(args),
        Command::Clean(args) => clean::clean(args),
    }
}

/// Prints machine output on standard output. A reader that went away is no error: it has what it wanted.
fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    let text = ipc_types::json::to_text(value)
        .map_err(|cause| Failure::stage_failed(format!("cannot write JSON on standard output: {cause}")))?;
    print(&text)
}

/// Prints on standard output.
fn print(text: &[u8]) -> Result<(), Failure> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(cause) if cause.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::stage_failed(format!("cannot write on standard output: {cause}")))
        }
        _ => Ok(()),
    }
}
