//! `regrasp-check RUN`: verifies the proof that a run directory carries.

use check::run::{self, Rejection};
use clap::Parser;
use ipc_types::exit_code::ExitCode;
use std::path::PathBuf;

/// Verifies a run: that its files are whole and of one scene, that its certificates prove its regions free of
/// collision, and that plan and trajectory stay inside them, keep what their modes keep, and reach the goal.
///
/// Exit codes: 0 accepted; 1 rejected, and why; 2 not a run directory.
#[derive(Debug, Parser)]
#[command(name = "regrasp-check", version)]
struct Arguments {
    /// Run directory, as `regrasp plan` writes it.
    run: PathBuf,
    /// Print the verdict as JSON on standard output.
    #[arg(long)]
    json: bool,
}

fn main() {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Neither help nor a complaint about arguments can be printed where the streams are closed.
            let _ = error.print();
            let code = if error.use_stderr() { ExitCode::BadInput } else { ExitCode::Done };
            std::process::exit(code.code());
        }
    };
    std::process::exit(check(&arguments).code());
}

fn check(arguments: &Arguments) -> ExitCode {
    match run::verify(&arguments.run) {
        Ok(verdict) => {
            if arguments.json {
                println!("{}", serde_json::json!({ "accepted": true, "verdict": verdict }));
            } else {
                eprintln!(
                    "accepted: {} regions proven free by {} cells; {} control points inside them",
                    verdict.n_regions, verdict.n_cells, verdict.n_control_points
                );
                for claim in &verdict.not_verified {
                    eprintln!("not verified: {claim}");
                }
            }
            ExitCode::Done
        }
        Err(rejection) => {
            if arguments.json {
                println!("{}", serde_json::json!({ "accepted": false, "reason": rejection.to_string() }));
            } else {
                eprintln!("rejected: {rejection}");
            }
            match rejection {
                Rejection::Record { .. } if !arguments.run.join("run.json").exists() => ExitCode::BadInput,
                _ => ExitCode::Negative,
            }
        }
    }
}
