//! One job, in either mode: the stage's function between its inputs and its files.

use crate::host::{Carrier, Host};
use crate::inputs::Job;
use crate::process::{StopFlag, without_panic};
use crate::stage::{Outcome, Stage, StageError};
use std::collections::BTreeMap;
use std::path::Path;

/// Where a job's outputs go, and what may end it.
pub(crate) struct Place<'a> {
    /// Folder of the stage.
    pub folder: &'a Path,
    /// Whether to stop.
    pub stop: &'a StopFlag,
    /// Whether this process has all outputs of the stage and writes its files; else the parts are all it writes.
    pub joins: bool,
}

/// What remains of a job once its files are written.
#[derive(Debug)]
pub(crate) struct Finished {
    pub result: Result<Outcome, StageError>,
    pub solver_calls: u64,
    pub details: BTreeMap<String, serde_json::Value>,
}

impl Finished {
    /// Whether the outputs are not to be used.
    pub(crate) fn is_broken(&self) -> bool {
        matches!(self.result, Err(StageError::BadInput(_) | StageError::Failed(_)))
    }
}

/// Runs one job and writes its files. A panic is a failure with a message.
pub(crate) fn perform<S: Stage>(
    stage: &mut S,
    job: &Job,
    options: &S::Options,
    carrier: &mut dyn Carrier,
    place: &Place<'_>,
) -> Finished {
    let mut host = Host::new(carrier, place.stop.clone(), place.folder, job.scene.digest, job.scene.dim());
    let mut result = without_panic(|| stage.run(job, options, &mut host))
        .unwrap_or_else(|message| Err(StageError::Failed(message)));
    if place.joins && !matches!(result, Err(StageError::BadInput(_) | StageError::Failed(_))) {
        let written = host.output.write(S::NAME, job, place.folder).and_then(|()| host.announce_plan());
        if let Err(error) = written {
            result = Err(error);
        }
    }
    Finished { result, solver_calls: host.output.solver_calls, details: host.output.details }
}

/// Removes a folder, if it is there.
pub(crate) fn remove_folder(folder: &Path) -> Result<(), StageError> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(StageError::Failed(format!("{}: cannot be removed: {error}", folder.display())))
        }
        _ => Ok(()),
    }
}
