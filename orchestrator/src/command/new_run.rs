//! A new run, of whatever is asked: made, recorded, reported.

use crate::cli::NewRunArgs;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::{self, PipelineOutcome, RunRequest};
use crate::progress::Progress;
use crate::report::write_report;
use crate::results::Results;
use crate::run_directory::RunDirectory;
use crate::run_record::{Asked, Outcome, RUN_FORMAT, RunRecord};
use crate::stage::{StageCommands, StageOptions};
use crate::summary::Summary;
use ipc_types::stage_name::StageName;
use std::path::Path;
use std::time::{Duration, Instant};

/// Runs the stages that `request` needs. Bad input leaves no run directory behind: the next attempt may take the same
/// name.
pub fn new_run(args: &NewRunArgs, request: &RunRequest) -> Result<ExitCode, Failure> {
    // Also says that the scene is not there before a directory is made for it.
    crate::run_directory::scene_name(&args.scene)?;
    let run = match &args.out {
        Some(path) => RunDirectory::create_at(path)?,
        None => RunDirectory::create_next(&args.scene)?,
    };
    let mut record = new_record(request);
    let mut progress = Progress::new();
    let start = Instant::now();
    let outcome = record.write(run.path()).and_then(|()| pipeline::run_stages(request, &run, &mut progress));
    progress.finish();
    record.seconds = start.elapsed().as_secs_f64();
    match outcome {
        Ok(outcome) => {
            put_outcome(&mut record, &outcome);
            record.write(run.path())?;
            finish(&run, args.json)?;
            Ok(outcome.exit_code)
        }
        Err(failure) if failure.exit_code == ExitCode::BadInput => {
            run.remove();
            Err(failure)
        }
        Err(failure) => {
            record.outcome = Outcome::from(&failure);
            record.write(run.path())?;
            Err(Failure { message: format!("{}\nrun: {}", failure.message, run.path().display()), ..failure })
        }
    }
}

/// Writes the report and prints the summary.
pub fn finish(run: &RunDirectory, json: bool) -> Result<(), Failure> {
    let results = Results::read(run)?;
    write_report(run, &results)?;
    let summary = Summary::of(run, &results);
    eprint!("{}", summary.text());
    if json { super::print_json(&summary) } else { Ok(()) }
}

/// Notes in the record how the pipeline ended.
pub fn put_outcome(record: &mut RunRecord, outcome: &PipelineOutcome) {
    record.outcome = Outcome { exit_code: outcome.exit_code.code(), message: outcome.message.clone() };
    record.scene_digest.clone_from(&outcome.scene_digest);
    record.excluded_pairs.clone_from(&outcome.excluded_pairs);
    record.acceptance.clone_from(&outcome.acceptance);
    for stage in &outcome.stages {
        record.put_stage(stage.clone());
    }
}

/// What the stages are asked. `options` come from the options of one command; `--set` wins over them.
pub fn request(args: &NewRunArgs, asked: Asked, mut options: StageOptions) -> Result<RunRequest, Failure> {
    if let Some(coverage) = args.coverage {
        options.insert(StageName::Decompose, "coverage", coverage.to_string());
    }
    if let Some(run) = &args.extend {
        extend(run, &mut options)?;
    }
    options.extend(&StageOptions::parse(&args.set)?);
    let commands = StageCommands::parse(&args.stage)?;
    let last = asked.last_stage();
    if let Some(stage) = options.0.keys().chain(commands.0.keys()).find(|stage| **stage > last) {
        return Err(Failure::bad_input(format!(
            "--set, --stage: {stage} is not run, the run ends with {last}; leave it out, or use `regrasp plan`"
        )));
    }
    Ok(RunRequest {
        scene: args.scene.clone(),
        asked,
        task: args.task.clone(),
        seed: args.seed,
        workers: args.workers.unwrap_or_else(processors),
        certify: args.certify,
        clearance: args.clearance,
        options,
        commands,
        time_limit: args.time_limit.map(Duration::from_secs_f64),
    })
}

/// Lets decompose begin with the regions of `run`, and certify with its certificates, if it has any.
fn extend(run: &Path, options: &mut StageOptions) -> Result<(), Failure> {
    let absolute = run.canonicalize().ok().filter(|run| run.is_dir());
    let Some(absolute) = absolute.as_deref().and_then(Path::to_str) else {
        let named = run.display();
        return Err(Failure::bad_input(format!("--extend {named}: no such folder; give a run directory")));
    };
    options.insert(StageName::Decompose, "extend", absolute.to_owned());
    if Path::new(absolute).join("certify/certificates.bin").is_file() {
        options.insert(StageName::Certify, "reuse", absolute.to_owned());
    }
    Ok(())
}

fn processors() -> u32 {
    std::thread::available_parallelism().map_or(1, |n| u32::try_from(n.get()).unwrap_or(1)).min(256)
}

fn new_record(request: &RunRequest) -> RunRecord {
    RunRecord {
        format: RUN_FORMAT,
        version: env!("CARGO_PKG_VERSION").into(),
        scene: request.scene.display().to_string(),
        scene_digest: String::new(),
        asked: request.asked,
        task: request.task.clone(),
        seed: request.seed,
        workers: request.workers,
        certify: request.certify,
        clearance: request.clearance,
        options: request.options.clone(),
        commands: request.commands.clone(),
        excluded_pairs: Vec::new(),
        outcome: Outcome { exit_code: ExitCode::Interrupted.code(), message: "the run has not ended".into() },
        seconds: 0.0,
        stages: Vec::new(),
        acceptance: None,
    }
}
