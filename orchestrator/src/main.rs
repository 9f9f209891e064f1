//! `regrasp`: launches, feeds, watches and records the stages. No mathematics.

mod cli;
mod failure;
mod pipeline;
mod quantity;
mod report;
mod results;
mod run_directory;
mod run_record;
mod stage;

use clap::Parser;

fn main() -> std::process::ExitCode {
    let _cli = cli::Cli::parse();
    std::process::ExitCode::SUCCESS
}
