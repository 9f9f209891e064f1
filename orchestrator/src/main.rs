//! `regrasp`: launches, feeds, watches and records the stages. No mathematics.

mod cli;
mod failure;
mod run_directory;
mod run_record;
mod stage;

use clap::Parser;

fn main() -> std::process::ExitCode {
    let _cli = cli::Cli::parse();
    std::process::ExitCode::SUCCESS
}
