//! One stage alone on the files of a run, and the acceptance check.

use super::StageRequest;
use super::certified::write_uncertified;
use super::child::{Child, CommandLine, Ended, end_all};
use super::interrupt::{Stop, Watch};
use super::stage_command::{acceptance, certifies, file_mode, log_of, reason};
use crate::failure::{ExitCode, Failure};
use crate::run_directory::RunDirectory;
use crate::run_record::{Acceptance, StageRecord};
use ipc_types::artefact::RegionsFile;
use ipc_types::container;
use ipc_types::stage_name::StageName;
use ipc_types::status::Status;
use ipc_types::store::{read_artefact, read_json};
use std::path::Path;
use std::time::{Duration, Instant};

/// How often a process that says nothing is looked at.
const TICK: Duration = Duration::from_millis(2);

/// How long a process may take to end once it is asked.
pub const GRACE: Duration = Duration::from_secs(2);

/// Runs one stage alone on files; the record says how long it took. `Err` is bad input or a failed stage; a negative
/// answer, a limit and an interruption stand in the record's exit code.
pub fn run_stage(request: &StageRequest) -> Result<StageRecord, Failure> {
    if request.stage == StageName::Certify && !certifies(request.certify) {
        return copy_candidates(request);
    }
    let log = log_of(&request.output);
    let command = file_mode(request, &log)?;
    let watch = Watch::begin(request.time_limit)?;
    let (ended, stop) = run_to_end(&command, &watch)?;
    let exit_code = match stop {
        Some(Stop::Interrupted) => ExitCode::Interrupted,
        Some(Stop::TimeLimit) => ExitCode::Limit,
        None => ExitCode::from_code(ended.code),
    };
    let words = || reason(&request.output, "status.json", &log);
    match exit_code {
        ExitCode::BadInput => Err(Failure::bad_input(format!("{}: {}", request.stage, words()))),
        ExitCode::Failed => Err(stage_failure(request.stage, &ended, &words(), &log)),
        _ => Ok(StageRecord {
            stage: request.stage,
            command: command.words(),
            processes: 1,
            exit_code: exit_code.code(),
            seconds: ended.seconds,
            cpu_seconds: ended.cpu_seconds,
            peak_bytes: read_json::<Status>(&request.output.join("status.json"))
                .map_or(ended.peak_bytes, |status| status.peak_bytes),
            stale: false,
        }),
    }
}

/// A stage that failed: its name, how it ended, why, and where its log is.
pub fn stage_failure(stage: StageName, ended: &Ended, words: &str, log: &Path) -> Failure {
    // After a kill the log's last words are not the cause.
    let why = if ended.code < 0 { String::new() } else { format!(": {words}") };
    Failure::stage_failed(format!("stage {stage} {}{why}; log: {}", ended.words(), log.display()))
}

/// Runs a command until it ends, or until there is a reason to end it.
fn run_to_end(command: &CommandLine, watch: &Watch) -> Result<(Ended, Option<Stop>), Failure> {
    let mut child = Child::start(command)?;
    loop {
        if let Some(ended) = child.poll() {
            return Ok((ended, None));
        }
        if let Some(stop) = watch.reason() {
            end_all([&mut child].into_iter(), GRACE);
            let ended = child.poll();
            return ended
                .map(|ended| (ended, Some(stop)))
                .ok_or_else(|| Failure::stage_failed(format!("{} cannot be ended", command.words())));
        }
        std::thread::sleep(TICK);
    }
}

/// `--certify none` on files.
fn copy_candidates(request: &StageRequest) -> Result<StageRecord, Failure> {
    let began = Instant::now();
    let folder = request.input.join(StageName::Decompose.word());
    let candidates: RegionsFile = read_artefact(&folder, "regions", None)?;
    write_uncertified(&request.output, &candidates, &digest_of(&folder))?;
    Ok(StageRecord {
        stage: StageName::Certify,
        command: String::new(),
        processes: 0,
        exit_code: 0,
        seconds: began.elapsed().as_secs_f64(),
        cpu_seconds: 0.0,
        peak_bytes: 0,
        stale: false,
    })
}

/// Digest of the scene that the regions in this folder are of; zero if only the text twin is there.
pub fn digest_of(folder: &Path) -> ipc_types::Digest {
    let file = folder.join("regions.bin");
    let bytes = std::fs::read(&file).unwrap_or_default();
    container::header(&file, &bytes).map_or([0; 32], |header| header.scene_digest)
}

/// The acceptance check of a run.
pub fn accept(
    scene: &Path,
    task: Option<&str>,
    clearance: Option<f64>,
    run: &RunDirectory,
    watch: &Watch,
) -> Result<Acceptance, Failure> {
    let log = run.path().join("acceptance.txt");
    // What an earlier check said is of an earlier motion.
    let _ = std::fs::remove_file(&log);
    let command = acceptance(scene, task, clearance, run.path(), &log)?;
    let (ended, stop) = run_to_end(&command, watch)?;
    let text = std::fs::read_to_string(&log).unwrap_or_default();
    let lines: Vec<String> =
        text.lines().map(str::trim).filter(|line| !line.is_empty()).map(String::from).collect();
    match stop {
        Some(_) => Err(Failure {
            exit_code: ExitCode::Interrupted,
            message: "the acceptance check was stopped; plan and trajectory are kept".into(),
        }),
        None => match ended.code {
            0 => Ok(Acceptance { accepted: true, lines }),
            1 => Ok(Acceptance { accepted: false, lines }),
            _ => Err(Failure::stage_failed(format!(
                "the acceptance check {}: {}; log: {}",
                ended.words(),
                lines.last().map_or("it gave no reason", String::as_str),
                log.display()
            ))),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::CertifyMethod;
    use crate::stage::{StageCommands, StageOptions};
    use std::collections::BTreeMap;

    fn request(folder: &Path, script: &str) -> StageRequest {
        let words = vec!["/bin/sh".to_owned(), "-c".to_owned(), script.to_owned()];
        StageRequest {
            stage: StageName::Gcs,
            scene: "scene".into(),
            task: None,
            seed: 0,
            clearance: None,
            certify: CertifyMethod::Swept,
            input: folder.to_owned(),
            output: folder.join("gcs"),
            options: StageOptions::default(),
            commands: StageCommands(BTreeMap::from([(StageName::Gcs, words)])),
            time_limit: None,
        }
    }

    #[test]
    fn codes_of_a_stage_alone_become_records_and_failures() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(run_stage(&request(folder.path(), "exit 0")).unwrap().exit_code, 0);
        assert_eq!(run_stage(&request(folder.path(), "exit 1")).unwrap().exit_code, 1);
        let bad = run_stage(&request(folder.path(), "echo 'error: no such thing' >&2; exit 2")).unwrap_err();
        assert_eq!((bad.exit_code, bad.message.contains("gcs")), (ExitCode::BadInput, true));
        assert!(bad.message.contains("no such thing"), "{}", bad.message);
        let failed = run_stage(&request(folder.path(), "kill -9 $$")).unwrap_err();
        assert_eq!(failed.exit_code, ExitCode::Failed);
        assert!(
            failed.message.contains("signal 9") && failed.message.contains("log.txt"),
            "{}",
            failed.message
        );
    }

    #[test]
    fn the_time_limit_ends_a_stage() {
        let folder = tempfile::tempdir().unwrap();
        let limited = StageRequest {
            time_limit: Some(Duration::from_millis(30)),
            ..request(folder.path(), "sleep 1000")
        };
        assert_eq!(run_stage(&limited).unwrap().exit_code, ExitCode::Limit.code());
    }
}
