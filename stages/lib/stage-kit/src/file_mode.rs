//! File mode: one stage alone, from the files of a run to its own folder.

use crate::command_line::{Ending, RunArgs, ServedScene};
use crate::host::{Announcement, Carrier, Progress};
use crate::inputs::{Input, Job, broken, load_artefacts, load_regions, load_scene, of_store};
use crate::process::StopFlag;
use crate::stage::{Stage, StageError};
use crate::work::{Place, perform, remove_folder};
use ipc_types::artefact::{Region, RegionsFile};
use ipc_types::store::find_artefact;
use ipc_types::{join, validate};
use std::collections::{BTreeMap, VecDeque};
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::time::Duration;

/// Runs the stage on files. The ending is what `status.json` and the exit code say.
pub(crate) fn run<S: Stage>(args: &RunArgs<S::Options>) -> Ending {
    let mut ending = Ending::default();
    if let Err(error) = work::<S>(args, &mut ending) {
        ending.result = Some(Err(error));
    }
    ending
}

fn work<S: Stage>(args: &RunArgs<S::Options>, ending: &mut Ending) -> Result<(), StageError> {
    ending.stop = StopFlag::of_process(args.time_limit.map(Duration::from_secs_f64))
        .map_err(|error| StageError::Failed(format!("signals cannot be handled: {error}")))?;
    let may_be_alone = S::READS.iter().all(|read| *read == Input::Feedback);
    let input = args.input.as_deref();
    if input.is_none() && !may_be_alone {
        return Err(StageError::bad_input("--in: missing; give the run directory that this stage reads"));
    }
    if let Some(input) = input.filter(|input| !input.is_dir()) {
        return Err(StageError::BadInput(format!(
            "--in {}: no such folder; give a run directory",
            input.display()
        )));
    }
    let (scene, task) = load_scene(&args.given.scene, args.given.task.as_deref(), args.given.clearance)?;
    ending.scene = ServedScene::of(&scene, task.as_ref());
    let mut job = Job::new(scene, task, args.given.clearance, args.given.seed);
    let mut carrier = FileCarrier::default();
    if let Some(input) = input {
        load_artefacts(&mut job, S::READS, input)?;
        carrier.load(&job, S::READS, input)?;
    }
    std::fs::create_dir_all(&args.out).map_err(|error| {
        StageError::BadInput(format!("--out {}: cannot be created: {error}", args.out.display()))
    })?;
    let parts = join::parts_folder(&args.out);
    remove_folder(&parts)?;
    let place = Place { folder: &args.out, stop: &ending.stop, joins: true };
    let finished = perform(&mut S::default(), &job, &args.given.options, &mut carrier, &place);
    if !finished.is_broken() {
        // What the parts hold is in the joined files now.
        remove_folder(&parts)?;
    }
    ending.add(finished);
    Ok(())
}

/// Answers from the files of an earlier run.
#[derive(Default)]
struct FileCarrier {
    queue: VecDeque<Region>,
    /// By candidate id: the candidate, and its certified versions.
    earlier: BTreeMap<u64, (Region, Vec<Region>)>,
}

impl FileCarrier {
    fn load(&mut self, job: &Job, reads: &[Input], run: &Path) -> Result<(), StageError> {
        if reads.contains(&Input::Candidates) {
            self.queue = load_regions(job, &run.join("decompose"))?.into();
        }
        if reads.contains(&Input::Feedback) {
            let find = |folder: &Path| -> Result<Vec<Region>, StageError> {
                let file = find_artefact::<RegionsFile>(folder, "regions", Some(&job.scene.digest));
                let Some(file) = file.map_err(of_store)? else { return Ok(Vec::new()) };
                validate::regions(&file, &job.coordinates())
                    .map_err(|rule| broken(&folder.join("regions"), &rule))?;
                Ok(file.regions)
            };
            let certified = find(&run.join("certify"))?;
            // Without certification nothing came back, as in the run itself.
            if !certified.is_empty() && certified.iter().all(|region| region.certified) {
                self.earlier =
                    find(&run.join("decompose"))?.into_iter().map(|r| (r.id, (r, Vec::new()))).collect();
                for region in certified {
                    let parent = region.parent.and_then(|parent| self.earlier.get_mut(&parent));
                    parent.into_iter().for_each(|(_, versions)| versions.push(region.clone()));
                }
            }
        }
        Ok(())
    }
}

impl Carrier for FileCarrier {
    fn next_candidate(&mut self) -> Result<Option<Region>, StageError> {
        Ok(self.queue.pop_front())
    }

    /// Only if the earlier run had exactly these candidates: then certification would do the same again.
    fn certified_versions(&mut self, candidates: &[&Region]) -> Result<Option<Vec<Region>>, StageError> {
        let mut versions = Vec::new();
        for candidate in candidates {
            match self.earlier.get(&candidate.id) {
                Some((same, certified)) if same == *candidate => versions.extend(certified.iter().cloned()),
                _ => return Ok(None),
            }
        }
        versions.sort_by_key(|region| region.id);
        Ok(Some(versions))
    }

    fn announce(&mut self, _announcement: Announcement<'_>) -> Result<(), StageError> {
        Ok(())
    }

    fn progress(&mut self, progress: Progress<'_>) {
        let mut stderr = std::io::stderr();
        if stderr.is_terminal() {
            let of = if progress.total > 0 { format!(" of {}", progress.total) } else { String::new() };
            // A terminal that has gone away is no reason to stop.
            let _ =
                write!(stderr, "\r\x1b[K{}{of}  {:.4}  {}", progress.done, progress.value, progress.message);
            let _ = stderr.flush();
        }
    }
}
