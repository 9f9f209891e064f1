//! The command line that starts a stage, in either mode.

use super::child::{CommandLine, words_in_log};
use super::{RunRequest, StageRequest};
use crate::cli::CertifyMethod;
use crate::executable::required;
use crate::failure::Failure;
use crate::stage::StageCommands;
use ipc_types::stage_name::StageName;
use ipc_types::status::Status;
use ipc_types::store::read_json;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Program and first arguments: the command that replaces the stage, else the executable next to this one.
fn program(stage: StageName, commands: &StageCommands) -> Result<(PathBuf, Vec<OsString>), Failure> {
    match commands.0.get(&stage).and_then(|words| words.split_first()) {
        Some((program, arguments)) => Ok((program.into(), arguments.iter().map(OsString::from).collect())),
        None => Ok((required(stage.executable())?, Vec::new())),
    }
}

/// Arguments of both modes: scene, task, seed, clearance, kind of certificate, options.
fn given(request: &StageRequest) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = vec!["--scene".into(), request.scene.clone().into()];
    if let Some(task) = &request.task {
        arguments.extend(["--task".into(), task.into()]);
    }
    arguments.extend(["--seed".into(), request.seed.to_string().into()]);
    if let Some(clearance) = request.clearance {
        arguments.extend(["--clearance".into(), clearance.to_string().into()]);
    }
    if request.stage == StageName::Certify && request.certify == CertifyMethod::Sos {
        arguments.extend(["--method".into(), "sos".into()]);
    }
    arguments.extend(request.options.arguments(request.stage).into_iter().map(OsString::from));
    arguments
}

/// `… run --in DIR --out DIR …`.
pub fn file_mode(request: &StageRequest, log: &Path) -> Result<CommandLine, Failure> {
    let (program, mut arguments) = program(request.stage, &request.commands)?;
    arguments.extend(["run".into(), "--in".into(), request.input.clone().into()]);
    arguments.extend(["--out".into(), request.output.clone().into()]);
    arguments.extend(given(request));
    Ok(CommandLine { program, arguments, environment: Vec::new(), log: log.to_owned() })
}

/// `… serve --domain PREFIX --run DIR …`.
pub fn channel_mode(
    request: &StageRequest,
    domain: &str,
    worker: u32,
    log: &Path,
) -> Result<CommandLine, Failure> {
    let (program, mut arguments) = program(request.stage, &request.commands)?;
    arguments.extend(["serve".into(), "--domain".into(), domain.into()]);
    arguments.extend(["--run".into(), request.input.clone().into()]);
    arguments.extend(["--worker".into(), worker.to_string().into()]);
    arguments.extend(["--parent".into(), std::process::id().to_string().into()]);
    arguments.extend(given(request));
    Ok(CommandLine { program, arguments, environment: Vec::new(), log: log.to_owned() })
}

/// `regrasp-certify accept …`: the acceptance check of a run.
pub fn acceptance(
    scene: &Path,
    task: Option<&str>,
    clearance: Option<f64>,
    run: &Path,
    log: &Path,
) -> Result<CommandLine, Failure> {
    let mut arguments: Vec<OsString> = vec!["accept".into(), "--scene".into(), scene.into()];
    arguments.extend(["--run".into(), run.into()]);
    if let Some(task) = task {
        arguments.extend(["--task".into(), task.into()]);
    }
    if let Some(clearance) = clearance {
        arguments.extend(["--clearance".into(), clearance.to_string().into()]);
    }
    let program = required(StageName::Certify.executable())?;
    Ok(CommandLine { program, arguments, environment: Vec::new(), log: log.to_owned() })
}

/// The request of one stage of a run that is being planned.
pub fn stage_request(request: &RunRequest, stage: StageName, run: &Path) -> StageRequest {
    StageRequest {
        stage,
        scene: request.scene.clone(),
        task: request.task.clone(),
        seed: request.seed,
        clearance: request.clearance,
        certify: request.certify,
        input: run.to_owned(),
        output: run.join(stage.word()),
        options: request.options.clone(),
        commands: request.commands.clone(),
        time_limit: None,
    }
}

/// Whether regions are certified at all.
pub fn certifies(method: CertifyMethod) -> bool {
    method != CertifyMethod::None
}

/// The log of a stage in its folder.
pub fn log_of(folder: &Path) -> PathBuf {
    folder.join("log.txt")
}

/// Why a stage ended as it did: what its status says, else its log.
pub fn reason(folder: &Path, status: &str, log: &Path) -> String {
    let status: Option<Status> = read_json(&folder.join(status)).ok();
    let said = status.map(|status| status.reason).filter(|reason| !reason.is_empty());
    said.or_else(|| words_in_log(log)).unwrap_or_else(|| "it gave no reason".to_owned())
}
