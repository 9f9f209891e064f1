//! A run from its first process to its last: who is fed what, and when it ends.
//!
//! All stages start at once. Candidates stream from decompose to the work queue, workers pull them, decompose may ask
//! what became of a round. When all candidates are done, the parts are joined, miqp plans, gcs looks for paths; leaf
//! cuts go back to miqp until every segment has a path or no plan is left. At last the motion is checked.

mod end;
mod feed;
mod hand_over;
mod hear;
mod processes;

use super::child::end_all;
use super::hub::{Domain, Hub};
use super::interrupt::{Stop, Watch};
use super::slot::{Part, Slot};
use super::stage_command::{certifies, log_of, reason};
use super::work_queue::WorkQueue;
use super::{PipelineOutcome, ProgressSink, RunRequest, StageProgress};
use crate::failure::{ExitCode, Failure};
use crate::run_directory::RunDirectory;
use crate::run_record::Acceptance;
use ipc_types::Digest;
use ipc_types::artefact::RegionsFile;
use ipc_types::channel::{WaitingStage, WaitingWorker};
use ipc_types::stage_name::StageName;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How often processes and signals are looked at when no stage says anything.
const TICK: Duration = Duration::from_millis(20);

/// Least time between two looks at the progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);

/// How the part of a run before the acceptance check ended.
enum Ending {
    /// Every segment has a path.
    Paths,
    /// It ends without a motion, which it may not have been asked for.
    Early(ExitCode, String),
    /// It was stopped from outside, in these words.
    Stopped(ExitCode, &'static str),
}

/// A run.
pub struct Run<'a> {
    request: &'a RunRequest,
    directory: &'a RunDirectory,
    sink: &'a mut dyn ProgressSink,
    watch: Watch,
    slots: BTreeMap<StageName, Slot>,
    queue: WorkQueue,
    waiting_workers: Vec<WaitingWorker>,
    /// decompose waits for what became of these candidates.
    feedback: Option<(WaitingStage, Vec<u64>)>,
    /// The candidates of a decompose that has ended.
    candidates: Option<RegionsFile>,
    scene_digest: Option<Digest>,
    n_cuts: usize,
    /// Limits that were hit on the way.
    limits: Vec<String>,
    last_progress: Option<Instant>,
    newest: BTreeMap<StageName, StageProgress>,
    hub: Hub,
    // Declared last: its files go when all that uses them has gone.
    domain: Domain,
}

impl<'a> Run<'a> {
    /// Opens the channels and starts all stages.
    pub fn start(
        request: &'a RunRequest,
        directory: &'a RunDirectory,
        sink: &'a mut dyn ProgressSink,
    ) -> Result<Run<'a>, Failure> {
        let watch = Watch::begin(request.time_limit)?;
        let domain = Domain::new();
        let hub = Hub::open(&domain.name)?;
        let mut run = Run {
            request,
            directory,
            sink,
            watch,
            slots: BTreeMap::new(),
            queue: WorkQueue::default(),
            waiting_workers: Vec::new(),
            feedback: None,
            candidates: None,
            scene_digest: None,
            n_cuts: 0,
            limits: Vec::new(),
            last_progress: None,
            newest: BTreeMap::new(),
            hub,
            domain,
        };
        for stage in StageName::ALL {
            let is_left_out = stage > request.asked.last_stage()
                || (stage == StageName::Certify && !certifies(request.certify));
            let part = if is_left_out {
                Part::Absent
            } else if request.commands.0.contains_key(&stage) {
                Part::Files
            } else {
                Part::Channels
            };
            let mut slot = Slot::new(stage, part);
            if part == Part::Channels {
                let n_workers = if stage == StageName::Certify { request.workers.max(1) } else { 1 };
                for worker in 0..n_workers {
                    slot.processes.push(run.start_served(stage, worker)?);
                }
            }
            run.slots.insert(stage, slot);
        }
        run.want(StageName::Decompose)?;
        if run.slot(StageName::Certify).part == Part::Channels {
            run.want(StageName::Certify)?;
        }
        Ok(run)
    }

    /// Runs to the end. Whatever happens, no process and no shared memory is left when the run is dropped.
    pub fn finish(mut self) -> Result<PipelineOutcome, Failure> {
        let ending = self.work();
        let mut acceptance = None;
        let stopped = matches!(ending, Ok(Ending::Stopped(..)));
        let (exit_code, mut message) = match ending {
            Ok(Ending::Paths) => {
                self.stop_stages();
                let checked = self.accept()?;
                let verdict = match (&checked, self.limits.is_empty()) {
                    (Acceptance { accepted: false, .. }, _) => (
                        ExitCode::Failed,
                        format!(
                            "the motion did not pass its acceptance check: {}",
                            checked.lines.last().map_or("it gave no reason", String::as_str)
                        ),
                    ),
                    (_, true) => (ExitCode::Done, self.words()),
                    (_, false) => (ExitCode::Limit, format!("{}; {}", self.words(), self.limits.join("; "))),
                };
                acceptance = Some(checked);
                verdict
            }
            Ok(Ending::Early(exit_code, message)) => {
                self.stop_stages();
                (exit_code, message)
            }
            Ok(Ending::Stopped(exit_code, why)) => {
                self.stop_stages();
                (exit_code, why.to_owned())
            }
            Err(failure) => {
                self.slots.values_mut().for_each(|slot| slot.waiting.clear());
                end_all(self.slots.values_mut().flat_map(Slot::children), Duration::from_millis(300));
                return Err(failure);
            }
        };
        let interrupted = exit_code == ExitCode::Interrupted || exit_code == ExitCode::Limit;
        self.keep_certified(interrupted)?;
        if stopped {
            message = format!("{message}; {}", self.kept());
        }
        let (excluded_pairs, scene_digest) = self.about_scene();
        let stages = self.records();
        if acceptance.is_some() || matches!(exit_code, ExitCode::Done | ExitCode::Negative) {
            self.remove_parts();
        }
        Ok(PipelineOutcome { exit_code, message, stages, acceptance, scene_digest, excluded_pairs })
    }

    /// The loop: hear, look at the processes, give out what can be given.
    fn work(&mut self) -> Result<Ending, Failure> {
        loop {
            match self.watch.reason() {
                Some(Stop::Interrupted) => return Ok(interrupted()),
                Some(Stop::TimeLimit) => {
                    return Ok(Ending::Stopped(ExitCode::Limit, "the time limit was hit"));
                }
                None => {}
            }
            self.hear()?;
            self.look_at_processes()?;
            self.feed()?;
            if let Some(ending) = self.advance()? {
                return Ok(ending);
            }
            self.show(false)?;
            self.hub.wait(TICK)?;
        }
    }

    fn slot(&mut self, stage: StageName) -> &mut Slot {
        self.slots.entry(stage).or_insert_with(|| Slot::new(stage, Part::Absent))
    }

    fn folder(&self, stage: StageName) -> PathBuf {
        self.directory.path().join(stage.word())
    }

    fn log(&self, stage: StageName, worker: u32) -> PathBuf {
        let folder = self.folder(stage);
        if worker == 0 { log_of(&folder) } else { folder.join(format!("log-{worker}.txt")) }
    }

    fn reason(&self, stage: StageName, worker: u32) -> String {
        let status = if stage == StageName::Certify {
            format!("status-{worker}.json")
        } else {
            "status.json".to_owned()
        };
        reason(&self.folder(stage), &status, &self.log(stage, worker))
    }

    fn words(&self) -> String {
        format!("{}; {}", self.reason(StageName::Miqp, 0), self.reason(StageName::Gcs, 0))
    }

    /// Tells the sink what is new, at once or if it is time.
    fn show(&mut self, at_once: bool) -> Result<(), Failure> {
        let now = Instant::now();
        if !at_once && self.last_progress.is_some_and(|last| now.duration_since(last) < PROGRESS_INTERVAL) {
            return Ok(());
        }
        self.last_progress = Some(now);
        let certify = StageProgress {
            stage: Some(StageName::Certify),
            done: self.queue.n_done(),
            total: self.queue.n_known(),
            value: 0.0,
            message: format!("{} certified", self.queue.n_certified()),
            finished: false,
        };
        if self.slots.get(&StageName::Certify).is_some_and(|slot| slot.part == Part::Channels) {
            self.newest.insert(StageName::Certify, certify);
        }
        for (stage, progress) in &mut self.newest {
            progress.stage = Some(*stage);
            self.sink.progress(progress);
        }
        Ok(())
    }

    /// The stage has done its work: its last line says so.
    fn finished(&mut self, stage: StageName) {
        // Showing cannot fail the run.
        let _ = self.show(true);
        let mut progress = self.newest.remove(&stage).unwrap_or_default();
        progress.stage = Some(stage);
        progress.finished = true;
        self.sink.progress(&progress);
    }
}

impl Drop for Run<'_> {
    fn drop(&mut self) {
        // Children end before their channels go; after a good end there are none left.
        self.feedback = None;
        self.waiting_workers.clear();
        self.slots.values_mut().for_each(|slot| slot.waiting.clear());
        end_all(self.slots.values_mut().flat_map(Slot::children), Duration::ZERO);
    }
}

fn interrupted() -> Ending {
    Ending::Stopped(ExitCode::Interrupted, "interrupted")
}
