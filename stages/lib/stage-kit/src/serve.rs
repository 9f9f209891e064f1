//! Channel mode: the stage asks the orchestrator for jobs until it is told to stop.

use crate::channel_carrier::{Answer, ChannelCarrier, Identity, copy_scene};
use crate::command_line::{Ending, GivenArgs, ServeArgs, ServedScene};
use crate::inputs::{Input, Job, load_artefacts, load_scene};
use crate::process::{StopFlag, die_with_parent};
use crate::stage::{Stage, StageError};
use crate::work::{Place, perform, remove_folder};
use ipc_types::exit_code::ExitCode;
use ipc_types::message::Question;
use ipc_types::stage_name::StageName;
use ipc_types::{Digest, domain, join};
use std::path::Path;
use std::time::Instant;

/// Serves until the orchestrator says stop. The exit code and the words are those of the last job.
pub(crate) fn serve<S: Stage>(args: &ServeArgs<S::Options>) -> (ExitCode, String) {
    let mut ending = Ending::default();
    let folder = args.run.join(S::NAME.word());
    let (status, spans) = file_names(S::NAME, args.worker);
    if let Err(error) = jobs::<S>(args, &folder, &mut ending) {
        // A job that has ended keeps its outcome when the orchestrator takes the stage down.
        if !(error == StageError::Stopped && ending.result.is_some()) {
            ending.result = Some(Err(error));
        }
    }
    ending.record::<S>(&args.given, &folder, &status, &spans)
}

/// Names of status and spans: several workers write to one folder, the orchestrator joins what they say.
fn file_names(stage: StageName, worker: u32) -> (String, String) {
    match stage {
        StageName::Certify => (format!("status-{worker}"), format!("spans-{worker}.jsonl")),
        _ => ("status".to_owned(), "spans.jsonl".to_owned()),
    }
}

fn jobs<S: Stage>(
    args: &ServeArgs<S::Options>,
    folder: &Path,
    ending: &mut Ending,
) -> Result<(), StageError> {
    if !die_with_parent(args.parent) {
        return Err(StageError::Stopped);
    }
    ending.stop = StopFlag::of_process(None)
        .map_err(|error| StageError::Failed(format!("signals cannot be handled: {error}")))?;
    std::fs::create_dir_all(folder)
        .map_err(|error| StageError::BadInput(format!("--run {}: {error}", args.run.display())))?;
    let given = &args.given;
    let (scene, task) = load_scene(&given.scene, given.task.as_deref(), given.clearance)?;
    ending.scene = ServedScene::of(&scene, task.as_ref());
    copy_scene(&scene, &args.run)?;
    let identity = Identity {
        stage: S::NAME,
        worker: args.worker,
        scene_digest: scene.digest,
        options_digest: options_digest::<S>(given),
        run: args.run.clone(),
    };
    let mut job = Job::new(scene, task, given.clearance, given.seed);
    if S::READS.contains(&Input::Regions) {
        // Found out before others have worked in vain.
        job.task()?;
    }
    let node = domain::enter(&args.domain).map_err(StageError::failed)?;
    let mut carrier =
        ChannelCarrier::open(node, identity, ending.stop.clone()).map_err(StageError::failed)?;
    let (status, spans) = file_names(S::NAME, args.worker);
    let mut stage = S::default();
    let mut answer = carrier.ask(Question::Ready, 0, &[])?;
    while let Answer::Job = answer {
        let began = Instant::now();
        match prepare::<S>(&mut job, folder, &args.run) {
            Ok(()) => {
                let place = Place { folder, stop: &ending.stop, joins: S::NAME != StageName::Certify };
                ending.add(perform(&mut stage, &job, &given.options, &mut carrier, &place));
            }
            Err(error) => ending.result = Some(Err(error)),
        }
        ending.seconds += began.elapsed().as_secs_f64();
        // On disk before it is announced.
        let (code, _) = ending.record::<S>(given, folder, &status, &spans);
        answer = carrier.ask(Question::Finished, code.code(), &[])?;
    }
    Ok(())
}

fn prepare<S: Stage>(job: &mut Job, folder: &Path, run: &Path) -> Result<(), StageError> {
    if S::NAME == StageName::Gcs {
        // Segments of an earlier plan.
        remove_folder(&join::parts_folder(folder))?;
    }
    load_artefacts(job, S::READS, run)
}

/// Digest of all that shapes the outputs besides the scene.
fn options_digest<S: Stage>(given: &GivenArgs<S::Options>) -> Digest {
    let options = serde_json::to_string(&given.options).unwrap_or_default();
    let text = format!("{:?} {} {:?} {options}", given.task, given.seed, given.clearance);
    *blake3::hash(text.as_bytes()).as_bytes()
}
