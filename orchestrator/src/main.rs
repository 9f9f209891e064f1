//! `regrasp`: launches, feeds, watches and records the stages. No mathematics.

mod cli;
mod command;
mod executable;
mod failure;
mod pipeline;
mod progress;
mod quantity;
mod report;
mod results;
mod run_directory;
mod run_record;
mod stage;
mod summary;

use clap::Parser;

fn main() {
    let cli = cli::Cli::parse();
    let code = match command::run(&cli.command) {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("error: {}", failure.message);
            failure.exit_code
        }
    };
    std::process::exit(code.code());
}
