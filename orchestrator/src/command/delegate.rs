//! `regrasp check` and `regrasp certify-path`: work that needs mathematics is done by an executable of its own.

use crate::cli::{CertifyPathArgs, CheckArgs};
use crate::executable::required;
use crate::failure::{ExitCode, Failure};
use crate::run_directory::RunDirectory;
use std::path::PathBuf;
use std::process::Command;

/// Runs `regrasp-check RUN`.
pub fn check(args: &CheckArgs) -> Result<ExitCode, Failure> {
    let run = RunDirectory::open(&args.run)?;
    let mut command = Command::new(required("regrasp-check")?);
    command.arg(run.path());
    if args.json {
        command.arg("--json");
    }
    wait("regrasp-check", command)
}

/// Runs `regrasp-certify path`.
pub fn certify_path(args: &CertifyPathArgs) -> Result<ExitCode, Failure> {
    let program = required("regrasp-certify")?;
    require_subcommand(&program, "path")?;
    let mut command = Command::new(program);
    command.arg("path").arg(&args.scene).arg(&args.path);
    if let Some(task) = &args.task {
        command.arg("--task").arg(task);
    }
    if let Some(clearance) = args.clearance {
        command.arg("--clearance").arg(clearance.to_string());
    }
    for attach in &args.attach {
        command.arg("--attach").arg(attach);
    }
    if let Some(distance) = args.tol_held {
        command.arg("--tol-held").arg(distance.to_string());
    }
    if let Some(folder) = &args.out {
        command.arg("--out").arg(folder);
    }
    if args.json {
        command.arg("--json");
    }
    wait("regrasp-certify path", command)
}

/// Fails if the program's own help does not list the subcommand.
fn require_subcommand(program: &PathBuf, name: &str) -> Result<(), Failure> {
    let help = Command::new(program)
        .arg("--help")
        .output()
        .map_err(|cause| Failure::stage_failed(format!("cannot start {}: {cause}", program.display())))?;
    let lists = String::from_utf8_lossy(&help.stdout)
        .lines()
        .any(|line| line.split_whitespace().next() == Some(name));
    if lists {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "{} has no subcommand '{name}': this version does not certify the paths of other planners; `regrasp plan` certifies its own",
        program.display()
    )))
}

/// Waits for a program that speaks for itself, and passes on how it ended.
fn wait(name: &str, mut command: Command) -> Result<ExitCode, Failure> {
    let status =
        command.status().map_err(|cause| Failure::stage_failed(format!("cannot start {name}: {cause}")))?;
    match status.code() {
        Some(code) => Ok(ExitCode::from_code(code)),
        None => Err(Failure::stage_failed(format!("{name} ended abnormally: {status}"))),
    }
}
