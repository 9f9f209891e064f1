//! Certificates of freedom from collision, and the acceptance check of a motion.

use certify::acceptance::{AcceptArgs, accept_run};
use certify::grow_command::{self, GrowArgs};
use certify::path_command::{self, PathArgs};
use stage_kit::{Outcome, StageError};

/// Commands besides `run` and `serve`.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Check the motion of a run against scene, task, regions and a dense collision check.
    Accept(AcceptArgs),
    /// Certify the path of any planner. Exit codes: 0 all pieces certified; 1 otherwise, the first that is not named;
    /// 2 bad input.
    Path(PathArgs),
    /// Grow certified regions about configurations by sums of squares (C-IRIS). Exit codes: 0 each seed has a region; 1
    /// otherwise; 2 bad input.
    Grow(GrowArgs),
}

fn main() -> std::process::ExitCode {
    stage_kit::main_with::<certify::CertifyStage, Command>(|command| match command {
        Command::Accept(args) => accept(&args),
        Command::Path(args) => path_command::run(&args, &mut std::io::stdout()),
        Command::Grow(args) => grow_command::run(&args, &mut std::io::stdout()),
    })
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
