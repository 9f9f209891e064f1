//! Certificates of freedom from collision, and the acceptance check of a motion.

use certify::acceptance::{AcceptArgs, accept_run};
use stage_kit::{Outcome, StageError};

/// Commands besides `run` and `serve`.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Check the motion of a run against scene, task, regions and a dense collision check.
    Accept(AcceptArgs),
}

fn main() -> std::process::ExitCode {
    stage_kit::main_with::<certify::CertifyStage, Command>(|Command::Accept(args)| accept(&args))
}

/// One line a failure; the outcome counts them.
fn accept(args: &AcceptArgs) -> Result<Outcome, StageError> {
    let acceptance = accept_run(args)?;
    for failure in &acceptance.failures {
        println!("{failure}");
    }
    Ok(match acceptance.failures.len() {
        0 => Outcome::Done(acceptance.words()),
        n => Outcome::Negative(format!("the motion is not accepted: {n} failures")),
    })
}
