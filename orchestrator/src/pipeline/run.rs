//! A run from its first process to its last: who is fed what, and when it ends.
//!
//! All stages start at once. Candidates stream from decompose to the work queue, workers pull them, decompose may ask
//! what became of a round. When all candidates are done, the parts are joined, miqp plans, gcs looks for paths; leaf
//! cuts go back to miqp until every segment has a path or no plan is left. At last the motion is checked.

use super::alone::{GRACE, accept, digest_of, stage_failure};
use super::certified::{join_statuses, write_joined, write_uncertified};
use super::child::{Child, end_all, wait_all};
use super::hub::{Domain, Hub};
use super::interrupt::{Stop, Watch};
use super::slot::{Part, Process, Slot};
use super::stage_command::{certifies, channel_mode, file_mode, log_of, reason, stage_request};
use super::work_queue::WorkQueue;
use super::{PipelineOutcome, PlanRequest, ProgressSink, StageProgress};
use crate::failure::{ExitCode, Failure};
use crate::run_directory::RunDirectory;
use crate::run_record::{Acceptance, StageRecord};
use ipc_types::artefact::{CutsFile, PlanFile, Region, RegionsFile};
use ipc_types::channel::{WaitingStage, WaitingWorker};
use ipc_types::container::CertifiedPart;
use ipc_types::join::{parts_folder, read_part};
use ipc_types::message::{self, MessageError, NO_ID, Question, Reply};
use ipc_types::stage_name::StageName;
use ipc_types::status::Status;
use ipc_types::store::{find_artefact, read_artefact, read_json};
use ipc_types::{Digest, hexadecimal};
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
    /// It ends without a motion.
    Early(ExitCode, String),
}

/// A run.
pub struct Run<'a> {
    request: &'a PlanRequest,
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
        request: &'a PlanRequest,
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
            let part = if stage == StageName::Certify && !certifies(request.certify) {
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
        let (exit_code, message) = match ending {
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
            Err(failure) => {
                self.slots.values_mut().for_each(|slot| slot.waiting.clear());
                end_all(self.slots.values_mut().flat_map(Slot::children), Duration::from_millis(300));
                return Err(failure);
            }
        };
        let interrupted = exit_code == ExitCode::Interrupted || exit_code == ExitCode::Limit;
        self.keep_certified(interrupted)?;
        let (excluded_pairs, scene_digest) = self.about_scene();
        let stages = self.records();
        if acceptance.is_some() || exit_code == ExitCode::Negative {
            self.remove_parts();
        }
        Ok(PipelineOutcome { exit_code, message, stages, acceptance, scene_digest, excluded_pairs })
    }

    /// The loop: hear, look at the processes, give out what can be given.
    fn work(&mut self) -> Result<Ending, Failure> {
        loop {
            match self.watch.reason() {
                Some(Stop::Interrupted) => {
                    return Ok(Ending::Early(
                        ExitCode::Interrupted,
                        "interrupted; what was found is kept".into(),
                    ));
                }
                Some(Stop::TimeLimit) => {
                    return Ok(Ending::Early(
                        ExitCode::Limit,
                        "the time limit was hit; what was found is kept".into(),
                    ));
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

    // --- hearing ---

    fn hear(&mut self) -> Result<(), Failure> {
        for stage in StageName::ALL {
            for question in self.hub.questions(stage)? {
                self.hear_question(stage, question)?;
            }
        }
        if let Some(digest) = self.scene_digest {
            for (id, region) in self.hub.candidates(&digest)? {
                self.take_candidate(id, region)?;
            }
        }
        for worker in self.hub.workers()? {
            let request = *worker.payload();
            self.check_scene(StageName::Certify, request.protocol_version, &request.scene_digest)?;
            if request.finished_candidate != NO_ID {
                self.take_part(request.worker, request.finished_candidate)?;
            }
            self.waiting_workers.push(worker);
        }
        let announced = self.hub.announced()?;
        if !announced.segments.is_empty() {
            let newest = self.newest.entry(StageName::Gcs).or_default();
            newest.done += announced.segments.len() as u64;
            newest.value += announced.segments.iter().map(|segment| segment.1).sum::<f64>();
        }
        for record in self.hub.progress()? {
            if let Some(stage) =
                StageName::from_number(record.stage).filter(|stage| *stage != StageName::Certify)
            {
                let progress = StageProgress {
                    stage: Some(stage),
                    done: record.done,
                    total: record.total,
                    value: record.value,
                    message: record.words(),
                    finished: false,
                };
                self.newest.insert(stage, progress);
            }
        }
        Ok(())
    }

    fn hear_question(&mut self, stage: StageName, question: WaitingStage) -> Result<(), Failure> {
        let header = *question.user_header();
        self.check_scene(stage, header.protocol_version, &header.scene_digest)?;
        let slot = self.slot(stage);
        match Question::from_number(header.question) {
            Some(Question::Ready) => {
                if slot.part == Part::Files {
                    // It speaks over channels: from now on it is asked there, and the job it was started for is its first.
                    slot.part = Part::Channels;
                    slot.n_working = 0;
                    slot.wanted = true;
                }
                slot.waiting.push(question);
            }
            Some(Question::Finished) => {
                slot.job_ends(ExitCode::from_code(header.exit_code));
                slot.waiting.push(question);
                let worker = header.worker;
                match ExitCode::from_code(header.exit_code) {
                    ExitCode::BadInput => return Err(Failure::bad_input(self.reason(stage, worker))),
                    ExitCode::Failed => {
                        let log = self.log(stage, worker);
                        let words = self.reason(stage, worker);
                        return Err(Failure::stage_failed(format!(
                            "stage {stage} failed: {words}; log: {}",
                            log.display()
                        )));
                    }
                    _ => {}
                }
            }
            Some(Question::Certified) => {
                let ids = question.payload().to_vec();
                for id in &ids {
                    if !self.queue.knows(*id) {
                        // The channel lost it: it is on disk.
                        self.take_candidate(*id, None)?;
                    }
                }
                self.feedback = Some((question, ids));
            }
            None => {
                return Err(Failure::stage_failed(format!(
                    "stage {stage} asked an unknown question {}",
                    header.question
                )));
            }
        }
        Ok(())
    }

    /// All processes must speak the same protocol and have read the same scene.
    fn check_scene(&mut self, stage: StageName, version: u32, digest: &Digest) -> Result<(), Failure> {
        let expected = *self.scene_digest.get_or_insert(*digest);
        message::check(version, digest, &expected).map_err(|error| match error {
            MessageError::ForeignScene { .. } => Failure::bad_input(format!("stage {stage}: {error}")),
            _ => Failure::stage_failed(format!("stage {stage}: {error}")),
        })
    }

    fn take_candidate(&mut self, id: u64, region: Option<Region>) -> Result<(), Failure> {
        let region = match region {
            Some(region) => region,
            None => read_part(&self.folder(StageName::Decompose), id, self.scene_digest.as_ref())
                .map_err(|error| Failure::stage_failed(format!("stage decompose: {error}")))?,
        };
        self.queue.add(region).map_err(|words| Failure::stage_failed(format!("stage decompose: {words}")))
    }

    fn take_part(&mut self, worker: u32, candidate: u64) -> Result<(), Failure> {
        if self.queue.of_worker(worker) != Some(candidate) {
            return Err(Failure::stage_failed(format!(
                "stage certify: worker {worker} says that it finished candidate {candidate}, which it was not given"
            )));
        }
        let part: CertifiedPart =
            read_part(&self.folder(StageName::Certify), candidate, self.scene_digest.as_ref())
                .map_err(|error| Failure::stage_failed(format!("stage certify: {error}")))?;
        self.queue.finish(worker, part);
        Ok(())
    }

    // --- processes ---

    fn start_served(&self, stage: StageName, worker: u32) -> Result<Process, Failure> {
        let request = stage_request(self.request, stage, self.directory.path());
        let command = channel_mode(&request, &self.domain.name, worker, &self.log(stage, worker))?;
        Ok(Process { worker, command: command.words(), child: Child::start(&command)?, ended: None })
    }

    /// A job is wanted: served stages get it when they ask, others are started for it.
    fn want(&mut self, stage: StageName) -> Result<(), Failure> {
        self.slot(stage).want_job();
        if self.slot(stage).part == Part::Files {
            let request = stage_request(self.request, stage, self.directory.path());
            let mut command = file_mode(&request, &self.log(stage, 0))?;
            command.environment = vec![
                ("REGRASP_DOMAIN", self.domain.name.clone().into()),
                ("REGRASP_RUN", self.directory.path().into()),
            ];
            let process =
                Process { worker: 0, command: command.words(), child: Child::start(&command)?, ended: None };
            let slot = self.slot(stage);
            slot.processes.push(process);
            slot.wanted = false;
            slot.job_begins();
        }
        Ok(())
    }

    /// Deals with processes that have ended.
    fn look_at_processes(&mut self) -> Result<(), Failure> {
        for stage in StageName::ALL {
            let slot = self.slot(stage);
            let mut ends = Vec::new();
            for process in &mut slot.processes {
                if process.ended.is_none()
                    && let Some(ended) = process.child.poll()
                {
                    process.ended = Some(ended);
                    ends.push((process.worker, ended));
                }
            }
            for (worker, ended) in ends {
                let (part, told) = (self.slot(stage).part, self.slot(stage).told_to_stop);
                let outcome = if ended.code < 0 { ExitCode::Failed } else { ExitCode::from_code(ended.code) };
                let log = self.log(stage, worker);
                match outcome {
                    ExitCode::BadInput => return Err(Failure::bad_input(self.reason(stage, worker))),
                    _ if told && ended.code >= 0 => {}
                    ExitCode::Failed => {
                        // Its last words may have arrived before it died.
                        return Err(stage_failure(stage, &ended, &self.reason(stage, worker), &log));
                    }
                    _ if part == Part::Files => self.slot(stage).job_ends(outcome),
                    _ => {
                        let words = format!(
                            "stage {stage} {} before it was told to stop; log: {}",
                            ended.words(),
                            log.display()
                        );
                        return Err(Failure::stage_failed(words));
                    }
                }
            }
        }
        Ok(())
    }

    // --- feeding ---

    fn feed(&mut self) -> Result<(), Failure> {
        for stage in StageName::ALL {
            let slot = self.slot(stage);
            if slot.wanted && !slot.waiting.is_empty() {
                let (job, waiting) = (slot.job, std::mem::take(&mut slot.waiting));
                // Workers come one by one: the job stays open for those that have not asked yet.
                slot.wanted = stage == StageName::Certify;
                for question in waiting {
                    self.slot(stage).job_begins();
                    self.hub.answer(stage, &question, Reply::Job, job, &[])?;
                }
            }
        }
        while !self.waiting_workers.is_empty() && !self.queue.nothing_waits() {
            let request = self.waiting_workers.remove(0);
            let worker = request.payload().worker;
            if let (Some(region), Some(digest)) = (self.queue.next(worker), &self.scene_digest) {
                self.hub.answer_worker(&request, Some((region, digest)))?;
            }
        }
        if let Some((question, ids)) = self.feedback.take() {
            if self.slot(StageName::Certify).part != Part::Channels {
                self.hub.answer(StageName::Decompose, &question, Reply::NoCertification, 0, &[])?;
            } else if let Some(certified) = self.queue.certified_of(&ids) {
                self.hub.answer(StageName::Decompose, &question, Reply::Certified, 0, &certified)?;
            } else {
                self.feedback = Some((question, ids));
            }
        }
        Ok(())
    }

    // --- from stage to stage ---

    fn advance(&mut self) -> Result<Option<Ending>, Failure> {
        if self.slot(StageName::Decompose).is_done() && self.candidates.is_none() {
            if let Some(ending) = self.decompose_is_done()? {
                return Ok(Some(ending));
            }
        }
        if self.candidates.is_some() && self.slot(StageName::Miqp).job == 0 && self.certify_is_done()? {
            self.finished(StageName::Certify);
            self.want(StageName::Miqp)?;
        }
        if self.slot(StageName::Miqp).is_done()
            && self.slot(StageName::Gcs).job < self.slot(StageName::Miqp).job
        {
            match self.slot(StageName::Miqp).outcome {
                Some(ExitCode::Negative) => {
                    return Ok(Some(Ending::Early(ExitCode::Negative, self.reason(StageName::Miqp, 0))));
                }
                Some(ExitCode::Limit) => {
                    let words = self.reason(StageName::Miqp, 0);
                    if !self.has_plan()? {
                        return Ok(Some(Ending::Early(ExitCode::Limit, words)));
                    }
                    self.limits = vec![words];
                }
                Some(ExitCode::Interrupted) => return Ok(Some(interrupted())),
                _ => self.limits.clear(),
            }
            self.newest.remove(&StageName::Gcs);
            self.want(StageName::Gcs)?;
        }
        if self.slot(StageName::Gcs).is_done()
            && self.slot(StageName::Gcs).job == self.slot(StageName::Miqp).job
        {
            return match self.slot(StageName::Gcs).outcome {
                Some(ExitCode::Done) => Ok(Some(Ending::Paths)),
                Some(ExitCode::Negative) => {
                    self.cut_again()?;
                    Ok(None)
                }
                Some(ExitCode::Interrupted) => Ok(Some(interrupted())),
                _ => Ok(Some(Ending::Early(ExitCode::Limit, self.reason(StageName::Gcs, 0)))),
            };
        }
        Ok(None)
    }

    /// Reads decompose's files; what the channel lost is queued now.
    fn decompose_is_done(&mut self) -> Result<Option<Ending>, Failure> {
        match self.slot(StageName::Decompose).outcome {
            Some(ExitCode::Negative) => {
                return Ok(Some(Ending::Early(ExitCode::Negative, self.reason(StageName::Decompose, 0))));
            }
            Some(ExitCode::Interrupted) => return Ok(Some(interrupted())),
            _ => {}
        }
        let folder = self.folder(StageName::Decompose);
        let digest = *self.scene_digest.get_or_insert_with(|| digest_of(&folder));
        let file: RegionsFile = read_artefact(&folder, "regions", Some(&digest))
            .map_err(|error| Failure::stage_failed(format!("stage decompose: {error}")))?;
        ipc_types::validate::regions(&file, &file.coordinates)
            .map_err(|rule| Failure::stage_failed(format!("stage decompose: regions: {rule}")))?;
        for region in &file.regions {
            self.take_candidate(region.id, Some(region.clone()))?;
        }
        self.candidates = Some(file);
        self.finished(StageName::Decompose);
        if self.slot(StageName::Certify).part == Part::Files {
            self.want(StageName::Certify)?;
        }
        Ok(None)
    }

    /// Whether `certify/` is complete; completes it if it can be.
    fn certify_is_done(&mut self) -> Result<bool, Failure> {
        let Some(coordinates) = self.candidates.as_ref().map(|file| file.coordinates.clone()) else {
            return Ok(false);
        };
        let digest = self.scene_digest.unwrap_or_default();
        let folder = self.directory.path().join(StageName::Certify.word());
        match self.slot(StageName::Certify).part {
            Part::Absent => {
                if let Some(candidates) = &self.candidates {
                    write_uncertified(&folder, candidates, &digest)?;
                }
                Ok(true)
            }
            Part::Files => Ok(self.slot(StageName::Certify).is_done()),
            Part::Channels => {
                if !self.queue.is_idle() || self.queue.n_done() < self.queue.n_known() {
                    return Ok(false);
                }
                // No more work: the workers say good-bye, and those that come late are not given any.
                for worker in std::mem::take(&mut self.waiting_workers) {
                    self.hub.answer_worker(&worker, None)?;
                }
                let slot = self.slot(StageName::Certify);
                slot.wanted = false;
                if slot.n_working > 0 {
                    return Ok(false);
                }
                write_joined(&folder, coordinates, &self.queue, &digest)?;
                self.tell_to_stop(StageName::Certify);
                Ok(true)
            }
        }
    }

    /// gcs found segments without a path: its cuts go to miqp.
    fn cut_again(&mut self) -> Result<(), Failure> {
        let folder = self.folder(StageName::Gcs);
        let cuts: Option<CutsFile> = find_artefact(&folder, "cuts", None)
            .map_err(|error| Failure::stage_failed(format!("stage gcs: {error}")))?;
        let n_cuts = cuts.map_or(0, |file| file.cuts.len());
        if n_cuts <= self.n_cuts {
            return Err(Failure::stage_failed(format!(
                "stage gcs found no path and no new cut: {}; log: {}",
                self.reason(StageName::Gcs, 0),
                self.log(StageName::Gcs, 0).display()
            )));
        }
        self.n_cuts = n_cuts;
        self.want(StageName::Miqp)
    }

    fn has_plan(&self) -> Result<bool, Failure> {
        let plan: Option<PlanFile> =
            find_artefact(&self.folder(StageName::Miqp), "plan", self.scene_digest.as_ref())
                .map_err(|error| Failure::stage_failed(format!("stage miqp: {error}")))?;
        Ok(plan.is_some_and(|plan| plan.configurations.is_some()))
    }

    fn accept(&mut self) -> Result<Acceptance, Failure> {
        // The copy of what the stages read, if there is one: the original may change at any time.
        let copy = self.directory.scene();
        let scene = if copy.join("scene.toml").is_file() { copy } else { self.request.scene.clone() };
        accept(&scene, self.request.task.as_deref(), self.request.clearance, self.directory, &self.watch)
    }

    // --- the end ---

    fn tell_to_stop(&mut self, stage: StageName) {
        let slot = self.slot(stage);
        slot.told_to_stop = true;
        for question in std::mem::take(&mut slot.waiting) {
            // One that cannot be told is ended by a signal.
            let _ = self.hub.answer(stage, &question, Reply::Stop, 0, &[]);
        }
    }

    /// Ends all stages: those that wait are told, those that work are asked by SIGTERM, those that do not listen are
    /// killed.
    fn stop_stages(&mut self) {
        for stage in StageName::ALL {
            self.tell_to_stop(stage);
        }
        for worker in std::mem::take(&mut self.waiting_workers) {
            let _ = self.hub.answer_worker(&worker, None);
        }
        self.feedback = None;
        let idle = self.slots.values_mut().filter(|slot| slot.n_working == 0).flat_map(Slot::children);
        wait_all(idle, GRACE);
        end_all(self.slots.values_mut().flat_map(Slot::children), GRACE);
    }

    /// What the workers left becomes files, also after an interruption.
    fn keep_certified(&mut self, interrupted: bool) -> Result<(), Failure> {
        let folder = self.folder(StageName::Certify);
        let slot = self.slot(StageName::Certify);
        let (part, seconds) = (slot.part, slot.worked.as_secs_f64());
        if part != Part::Channels {
            return Ok(());
        }
        let n_workers = self.request.workers.max(1);
        join_statuses(&folder, n_workers, seconds, &self.queue)?;
        if let (true, Some(digest)) = (interrupted && self.slot(StageName::Miqp).job == 0, self.scene_digest)
        {
            let decompose =
                read_artefact::<RegionsFile>(&self.folder(StageName::Decompose), "regions", Some(&digest));
            // Without decompose's file the coordinates have no names; the parts are kept all the same.
            if let Ok(file) = decompose {
                write_joined(&folder, file.coordinates, &self.queue, &digest)?;
            }
        }
        Ok(())
    }

    /// Parts that are joined need not be kept.
    fn remove_parts(&self) {
        for stage in StageName::ALL {
            // What cannot be removed does no harm.
            let _ = std::fs::remove_dir_all(parts_folder(&self.folder(stage)));
        }
    }

    fn about_scene(&self) -> (Vec<String>, String) {
        let statuses = StageName::ALL.into_iter().filter_map(|stage| {
            read_json::<Status>(&self.folder(stage).join("status.json"))
                .ok()
                .filter(|s| !s.scene_digest.is_empty())
        });
        let digest = self.scene_digest.map_or_else(String::new, |digest| hexadecimal(&digest));
        let pairs = statuses.map(|status| status.excluded_pairs).max_by_key(Vec::len).unwrap_or_default();
        (pairs, digest)
    }

    fn records(&mut self) -> Vec<StageRecord> {
        let folder = self.directory.path();
        self.slots
            .values_mut()
            .filter(|slot| !slot.processes.is_empty())
            .map(|slot| {
                // Its own figure, if it gives one: ours counts what this process held when it started the stage.
                let own = read_json::<Status>(&folder.join(slot.stage.word()).join("status.json"));
                let own = own.ok().map(|status| status.peak_bytes).filter(|bytes| *bytes > 0);
                let ended: Vec<_> =
                    slot.processes.iter_mut().filter_map(|process| process.child.poll()).collect();
                StageRecord {
                    stage: slot.stage,
                    command: slot
                        .processes
                        .first()
                        .map_or_else(String::new, |process| process.command.clone()),
                    processes: u32::try_from(slot.processes.len()).unwrap_or(u32::MAX),
                    exit_code: slot.outcome.map_or_else(|| slot.exit_code(), ExitCode::code),
                    seconds: slot.worked.as_secs_f64(),
                    cpu_seconds: ended.iter().map(|ended| ended.cpu_seconds).sum(),
                    peak_bytes: own.or_else(|| ended.iter().map(|ended| ended.peak_bytes).max()).unwrap_or(0),
                    stale: false,
                }
            })
            .collect()
    }

    // --- small things ---

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
    Ending::Early(ExitCode::Interrupted, "interrupted; what was found is kept".into())
}
