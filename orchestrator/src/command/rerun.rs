//! `regrasp rerun`: one stage of an earlier run again, and with `--onward` those after it.

use super::new_run::finish;
use crate::cli::RerunArgs;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::{self, StageRequest, run_stage};
use crate::run_directory::RunDirectory;
use crate::run_record::{Asked, Outcome, RunRecord, StageRecord};
use crate::stage::{StageCommands, StageOptions, later_stages, stage_from_name};
use ipc_types::artefact::CutsFile;
use ipc_types::stage_name::StageName;
use ipc_types::store::find_artefact;
use std::path::Path;

/// Rounds of planning and cutting; every cut removes leaves for good, so a run that needs more than these is broken.
const MAX_ROUNDS: usize = 1000;

/// Runs a stage again on the run's own copy of the scene, and replaces its folder. Later stages become stale.
pub fn rerun(args: &RerunArgs) -> Result<ExitCode, Failure> {
    let run = RunDirectory::open(&args.run)?;
    let mut record = RunRecord::read(run.path())?;
    let stage = match args.stage.split_once('=') {
        Some((name, _)) => {
            record.commands.0.extend(StageCommands::parse(std::slice::from_ref(&args.stage))?.0);
            stage_from_name(name)?
        }
        None => stage_from_name(&args.stage)?,
    };
    let last = record.asked.last_stage();
    if stage > last {
        return Err(Failure::bad_input(format!(
            "--stage {stage}: {} is a run of regions, which ends with {last}; `regrasp plan` makes plans",
            run.path().display()
        )));
    }
    record.options.extend(&StageOptions::parse(&args.set)?);
    if stage < StageName::Miqp {
        // Cuts name regions; those of other regions would cut at random.
        remove_cuts(&run)?;
    }
    let exit_code =
        if args.onward { onward(&run, &mut record, stage)? } else { alone(&run, &mut record, stage)? };
    record.write(run.path())?;
    finish(&run, args.json)?;
    Ok(exit_code)
}

/// The request of one stage of a run, alone on files.
pub fn stage_request(
    run: &RunDirectory,
    record: &RunRecord,
    stage: StageName,
    options: &StageOptions,
) -> StageRequest {
    let copy = run.scene();
    StageRequest {
        stage,
        scene: if copy.join("scene.toml").is_file() { copy } else { record.scene.clone().into() },
        task: record.task.clone(),
        seed: record.seed,
        clearance: record.clearance,
        certify: record.certify,
        input: run.path().to_owned(),
        output: run.stage(stage),
        options: options.clone(),
        commands: record.commands.clone(),
        time_limit: None,
    }
}

fn alone(run: &RunDirectory, record: &mut RunRecord, stage: StageName) -> Result<ExitCode, Failure> {
    let cost = replace(run, record, stage)?;
    let exit_code = ExitCode::from_code(cost.exit_code);
    for later in later_stages(stage) {
        if let Some(stale) = record.stages.iter_mut().find(|other| other.stage == later) {
            stale.stale = true;
        }
    }
    record.acceptance = None;
    record.outcome = Outcome {
        exit_code: cost.exit_code,
        message: format!("{stage} was run again alone; what later stages wrote is stale"),
    };
    Ok(exit_code)
}

fn onward(run: &RunDirectory, record: &mut RunRecord, first: StageName) -> Result<ExitCode, Failure> {
    for stage in StageName::ALL.into_iter().filter(|stage| *stage >= first && *stage < StageName::Miqp) {
        let cost = replace(run, record, stage)?;
        if cost.exit_code != 0 {
            return Ok(ended(record, run, stage, &cost));
        }
    }
    if record.asked == Asked::Regions {
        record.outcome = Outcome {
            exit_code: ExitCode::Done.code(),
            message: pipeline_reason(&run.stage(StageName::Certify)).unwrap_or_default(),
        };
        return Ok(ExitCode::Done);
    }
    let mut plans = first <= StageName::Miqp;
    for _ in 0..MAX_ROUNDS {
        if plans {
            let cost = replace(run, record, StageName::Miqp)?;
            if cost.exit_code != 0 {
                return Ok(ended(record, run, StageName::Miqp, &cost));
            }
        }
        let known = n_cuts(run)?;
        let cost = replace(run, record, StageName::Gcs)?;
        if cost.exit_code == 0 {
            return accepted(run, record);
        }
        if n_cuts(run)? <= known {
            return Ok(ended(record, run, StageName::Gcs, &cost));
        }
        plans = true;
    }
    Err(Failure::stage_failed(format!("no plan has all its paths after {MAX_ROUNDS} rounds of cuts")))
}

/// A stage ended without its output, or with a negative answer: that is how the run ends.
fn ended(record: &mut RunRecord, run: &RunDirectory, stage: StageName, cost: &StageRecord) -> ExitCode {
    let reason = pipeline_reason(&run.stage(stage)).unwrap_or_else(|| "it gave no reason".into());
    record.acceptance = None;
    record.outcome = Outcome { exit_code: cost.exit_code, message: format!("{stage}: {reason}") };
    ExitCode::from_code(cost.exit_code)
}

fn pipeline_reason(folder: &Path) -> Option<String> {
    let status: ipc_types::status::Status = ipc_types::store::read_json(&folder.join("status.json")).ok()?;
    Some(status.reason)
}

fn accepted(run: &RunDirectory, record: &mut RunRecord) -> Result<ExitCode, Failure> {
    let request = stage_request(run, record, StageName::Gcs, &record.options);
    let acceptance = pipeline::accept(&request.scene, record.task.as_deref(), record.clearance, run)?;
    let exit_code = if acceptance.accepted { ExitCode::Done } else { ExitCode::Failed };
    record.outcome = Outcome {
        exit_code: exit_code.code(),
        message: if acceptance.accepted { "planned".into() } else { "the acceptance check failed".into() },
    };
    record.acceptance = Some(acceptance);
    Ok(exit_code)
}

/// Runs a stage into a new folder and puts it in place of the old one, so that a stage that fails leaves the old.
fn replace(run: &RunDirectory, record: &mut RunRecord, stage: StageName) -> Result<StageRecord, Failure> {
    let mut request = stage_request(run, record, stage, &record.options);
    let (old, new) = (run.stage(stage), run.path().join(format!("{stage}.new")));
    remove(&new)?;
    request.output.clone_from(&new);
    let cost = run_stage(&request).inspect_err(|_| drop(remove(&new)))?;
    remove(&old)?;
    std::fs::rename(&new, &old).map_err(|cause| Failure::file("rename", &new, cause))?;
    record.put_stage(cost.clone());
    Ok(cost)
}

fn remove(folder: &Path) -> Result<(), Failure> {
    match std::fs::remove_dir_all(folder) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::file("remove", folder, cause))
        }
        _ => Ok(()),
    }
}

fn n_cuts(run: &RunDirectory) -> Result<usize, Failure> {
    let cuts: Option<CutsFile> = find_artefact(&run.stage(StageName::Gcs), "cuts", None)?;
    Ok(cuts.map_or(0, |file| file.cuts.len()))
}

fn remove_cuts(run: &RunDirectory) -> Result<(), Failure> {
    for name in ["cuts.bin", "cuts.json"] {
        let file = run.stage(StageName::Gcs).join(name);
        match std::fs::remove_file(&file) {
            Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => {
                return Err(Failure::file("remove", &file, cause));
            }
            _ => {}
        }
    }
    Ok(())
}
