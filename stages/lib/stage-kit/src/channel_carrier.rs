//! Questions, answers and announcements over the channels of a run.

use crate::host::{Announcement, Carrier, Progress};
use crate::process::StopFlag;
use crate::stage::StageError;
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::ipc;
use ipc_types::artefact::Region;
use ipc_types::channel::{self, ChannelError, ControlClient, CutPublisher, PlanPublisher, RegionPublisher};
use ipc_types::channel::{RegionSubscriber, RunNode, SegmentPublisher, WorkClient};
use ipc_types::container::CertifiedPart;
use ipc_types::join::read_part;
use ipc_types::message::{
    self, ControlRequest, CutHeader, NO_ID, PlanHeader, ProgressRecord, Question, RegionHeader, Reply,
    SegmentHeader, WorkReply, WorkRequest,
};
use ipc_types::stage_name::StageName;
use ipc_types::{Digest, PROTOCOL_VERSION};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a wait lasts before the stop flag is looked at again; an event ends it sooner.
const TICK: Duration = Duration::from_millis(20);

/// Least time between two progress records.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);

/// Who this process is in the run.
#[derive(Debug, Clone)]
pub(crate) struct Identity {
    pub stage: StageName,
    pub worker: u32,
    pub scene_digest: Digest,
    pub options_digest: Digest,
    pub run: PathBuf,
}

/// The ports for outputs that a stage has.
enum Outbox {
    Candidates(RegionPublisher),
    Certified(RegionPublisher),
    Plans(PlanPublisher),
    Paths { cuts: CutPublisher, segments: SegmentPublisher },
}

/// One end of the channels of a run.
pub(crate) struct ChannelCarrier {
    identity: Identity,
    stop: StopFlag,
    control: ControlClient,
    work: Option<WorkClient>,
    finished_candidate: u64,
    outbox: Outbox,
    inbox: Option<RegionSubscriber>,
    /// Certified regions that arrived, by id.
    arrived: BTreeMap<u64, Region>,
    events: Notifier<ipc::Service>,
    wake: Listener<ipc::Service>,
    progress: Publisher<ipc::Service, ProgressRecord, ()>,
    last_progress: Option<Instant>,
    sequence: u64,
    job: u64,
    // Declared last: ports are dropped before the node they belong to.
    _node: RunNode,
}

/// What the orchestrator answered to a question on `control/<stage>`.
pub(crate) enum Answer {
    Job,
    Stop,
    /// Ids of the certified regions.
    Certified(Vec<u64>),
    NoCertification,
}

impl ChannelCarrier {
    /// Opens the channels of `identity.stage`.
    pub(crate) fn open(
        node: RunNode,
        identity: Identity,
        stop: StopFlag,
    ) -> Result<ChannelCarrier, ChannelError> {
        let stage = identity.stage;
        let outbox = match stage {
            StageName::Decompose => Outbox::Candidates(channel::publisher(&node, channel::CANDIDATES)?),
            StageName::Certify => Outbox::Certified(channel::publisher(&node, channel::CERTIFIED)?),
            StageName::Miqp => Outbox::Plans(channel::publisher(&node, channel::PLANS)?),
            StageName::Gcs => Outbox::Paths {
                cuts: channel::publisher(&node, channel::CUTS)?,
                segments: channel::publisher(&node, channel::SEGMENTS)?,
            },
        };
        let inbox = match stage {
            StageName::Decompose => Some(channel::subscriber(&node, channel::CERTIFIED)?),
            _ => None,
        };
        Ok(ChannelCarrier {
            control: channel::control_client(&node, stage)?,
            work: if stage == StageName::Certify { Some(channel::work_client(&node)?) } else { None },
            finished_candidate: NO_ID,
            outbox,
            inbox,
            arrived: BTreeMap::new(),
            events: channel::notifier(&node, &channel::events_name(stage))?,
            wake: channel::listener(&node, &channel::wake_name(stage))?,
            progress: channel::progress_publisher(&node)?,
            last_progress: None,
            sequence: 0,
            job: 0,
            identity,
            stop,
            _node: node,
        })
    }

    /// Asks the orchestrator and waits for its answer.
    pub(crate) fn ask(
        &mut self,
        question: Question,
        exit_code: i32,
        ids: &[u64],
    ) -> Result<Answer, StageError> {
        let name = channel::control_name(self.identity.stage);
        let failed = |error: &dyn std::fmt::Debug| StageError::failed(ChannelError::new(name.clone(), error));
        let mut request = self.control.loan_slice_uninit(ids.len()).map_err(|error| failed(&error))?;
        *request.user_header_mut() = ControlRequest {
            protocol_version: PROTOCOL_VERSION,
            stage: self.identity.stage.number(),
            worker: self.identity.worker,
            pid: std::process::id(),
            question: question as u32,
            exit_code,
            job: self.job,
            scene_digest: self.identity.scene_digest,
        };
        let pending = request.write_from_fn(|i| ids[i]).send().map_err(|error| failed(&error))?;
        self.notify()?;
        loop {
            if let Some(answer) = pending.receive().map_err(|error| failed(&error))? {
                let header = answer.user_header();
                if header.protocol_version != PROTOCOL_VERSION {
                    let found = header.protocol_version;
                    return Err(StageError::failed(message::MessageError::Version { found }));
                }
                return match Reply::from_number(header.reply) {
                    Some(Reply::Job) => {
                        self.job = header.job;
                        Ok(Answer::Job)
                    }
                    Some(Reply::Stop) => Ok(Answer::Stop),
                    Some(Reply::Certified) => Ok(Answer::Certified(answer.payload().to_vec())),
                    Some(Reply::NoCertification) => Ok(Answer::NoCertification),
                    None => Err(StageError::Failed(format!("{name}: answer {} is not known", header.reply))),
                };
            }
            self.wait()?;
        }
    }

    /// Waits for an event, a tick at most.
    fn wait(&mut self) -> Result<(), StageError> {
        self.collect()?;
        if self.stop.is_set() {
            return Err(StageError::Stopped);
        }
        let name = channel::wake_name(self.identity.stage);
        match self.wake.timed_wait(|_| {}, TICK) {
            // A signal ends the wait early: it is no fault of the channel, and the stop flag says what it was.
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(error) => Err(StageError::failed(ChannelError::new(name, error))),
        }
    }

    fn notify(&self) -> Result<(), StageError> {
        let name = channel::events_name(self.identity.stage);
        self.events.notify().map_err(|error| StageError::failed(ChannelError::new(name, error)))?;
        Ok(())
    }

    /// Takes in the certified regions that have arrived.
    fn collect(&mut self) -> Result<(), StageError> {
        let Some(inbox) = &self.inbox else { return Ok(()) };
        let failed =
            |error: &dyn std::fmt::Debug| StageError::failed(ChannelError::new(channel::CERTIFIED, error));
        while let Some(sample) = inbox.receive().map_err(|error| failed(&error))? {
            let region = sample.user_header().decode(sample.payload(), &self.identity.scene_digest);
            if let Some(region) = region.map_err(StageError::failed)? {
                self.arrived.insert(region.id, region);
            }
        }
        Ok(())
    }

    fn header(&mut self, region: &Region) -> (RegionHeader, Vec<f64>) {
        let (header, payload) = RegionHeader::encode(region, &self.identity.scene_digest);
        let header = RegionHeader {
            worker: self.identity.worker,
            sequence: self.sequence,
            options_digest: self.identity.options_digest,
            ..header
        };
        self.sequence += 1;
        (header, payload)
    }

    fn part_folder(&self) -> PathBuf {
        self.identity.run.join(StageName::Certify.word())
    }
}

impl Carrier for ChannelCarrier {
    fn shares_work(&self) -> bool {
        true
    }

    fn next_candidate(&mut self) -> Result<Option<Region>, StageError> {
        let failed =
            |error: &dyn std::fmt::Debug| StageError::failed(ChannelError::new(channel::WORK, error));
        let Some(work) = &self.work else { return Ok(None) };
        let request = WorkRequest {
            protocol_version: PROTOCOL_VERSION,
            worker: self.identity.worker,
            pid: std::process::id(),
            reserved: 0,
            finished_candidate: self.finished_candidate,
            scene_digest: self.identity.scene_digest,
        };
        let pending = work.send_copy(request).map_err(|error| failed(&error))?;
        self.finished_candidate = NO_ID;
        self.notify()?;
        loop {
            if let Some(answer) = pending.receive().map_err(|error| failed(&error))? {
                let header = answer.user_header();
                return match WorkReply::from_number(header.reply) {
                    Some(WorkReply::Stop) => Ok(None),
                    Some(WorkReply::Region) => {
                        let region = header.region.decode(answer.payload(), &self.identity.scene_digest);
                        match region.map_err(StageError::failed)? {
                            Some(region) => Ok(Some(region)),
                            None => {
                                let folder = self.identity.run.join(StageName::Decompose.word());
                                read_part(&folder, header.region.id, Some(&self.identity.scene_digest))
                                    .map(Some)
                                    .map_err(StageError::failed)
                            }
                        }
                    }
                    None => {
                        Err(StageError::Failed(format!("certify/work: answer {} is not known", header.reply)))
                    }
                };
            }
            self.wait()?;
        }
    }

    fn certified_versions(&mut self, candidates: &[&Region]) -> Result<Option<Vec<Region>>, StageError> {
        let ids: Vec<u64> = candidates.iter().map(|candidate| candidate.id).collect();
        let certified_ids = match self.ask(Question::Certified, 0, &ids)? {
            Answer::Certified(certified_ids) => certified_ids,
            Answer::NoCertification => return Ok(None),
            Answer::Job | Answer::Stop => return Err(StageError::Stopped),
        };
        self.collect()?;
        let arrived = certified_ids.iter().map(|id| self.arrived.get(id).cloned()).collect();
        let mut regions: Vec<Region> = match arrived {
            Some(regions) => regions,
            // The channel lost some: the disk has them all.
            None => {
                let mut regions = Vec::new();
                for id in ids {
                    let part = read_part(&self.part_folder(), id, Some(&self.identity.scene_digest));
                    regions.extend(part.map(|part: CertifiedPart| part.regions).map_err(StageError::failed)?);
                }
                regions
            }
        };
        regions.sort_by_key(|region| region.id);
        Ok(Some(regions))
    }

    fn announce(&mut self, announcement: Announcement<'_>) -> Result<(), StageError> {
        let scene = self.identity.scene_digest;
        match announcement {
            Announcement::Candidate(region) => {
                let (header, payload) = self.header(region);
                if let Outbox::Candidates(port) = &self.outbox {
                    channel::publish(port, channel::CANDIDATES, header, &payload)
                        .map_err(StageError::failed)?;
                }
            }
            Announcement::Certified(part) => {
                self.finished_candidate = part.candidate_id;
                for region in &part.regions {
                    let (header, payload) = self.header(region);
                    if let Outbox::Certified(port) = &self.outbox {
                        channel::publish(port, channel::CERTIFIED, header, &payload)
                            .map_err(StageError::failed)?;
                    }
                }
            }
            Announcement::Plan(plan) => {
                let (header, payload) = PlanHeader::encode(plan, self.job, &scene);
                if let Outbox::Plans(port) = &self.outbox {
                    channel::publish(port, channel::PLANS, header, &payload).map_err(StageError::failed)?;
                }
            }
            Announcement::Segment { segment_idx, segment } => {
                let (header, payload) = SegmentHeader::encode(segment_idx, segment, &scene);
                if let Outbox::Paths { segments, .. } = &self.outbox {
                    channel::publish(segments, channel::SEGMENTS, header, &payload)
                        .map_err(StageError::failed)?;
                }
            }
            Announcement::Cut(cut) => {
                let (header, payload) = CutHeader::encode(cut, &scene);
                if let Outbox::Paths { cuts, .. } = &self.outbox {
                    channel::publish(cuts, channel::CUTS, header, &payload).map_err(StageError::failed)?;
                }
            }
        }
        self.notify()
    }

    fn progress(&mut self, progress: Progress<'_>) {
        let now = Instant::now();
        if self.last_progress.is_some_and(|last| now.duration_since(last) < PROGRESS_INTERVAL) {
            return;
        }
        self.last_progress = Some(now);
        let Progress { done, total, value, message } = progress;
        let record =
            ProgressRecord::new(self.identity.stage, self.identity.worker, done, total, value, message);
        // Progress that is lost is replaced by the next.
        let _ = self.progress.send_copy(record);
    }
}

/// The scene's files below `<run>/scene`, as they were read. Several processes may write the same bytes.
pub(crate) fn copy_scene(scene: &scene::Scene, run: &Path) -> Result<(), StageError> {
    for file in &scene.files {
        let path = run.join("scene").join(&file.name);
        if !path.exists() {
            ipc_types::store::write_at_once(&path, &file.bytes).map_err(StageError::failed)?;
        }
    }
    Ok(())
}
