//! The orchestrator's ends of all channels of a run.

use crate::failure::Failure;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{CallbackProgression, SignalHandlingMode, WaitSet, WaitSetBuilder, ipc};
use ipc_types::artefact::Region;
use ipc_types::channel::{
    self, ChannelError, ControlServer, CutSubscriber, PlanSubscriber, RegionSubscriber, RunNode,
    SegmentSubscriber, WaitingStage, WaitingWorker, WorkServer,
};
use ipc_types::message::{ControlAnswer, ProgressRecord, RegionHeader, Reply, WorkAnswer, WorkReply};
use ipc_types::stage_name::StageName;
use ipc_types::{Digest, PROTOCOL_VERSION, domain};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::Path;
use std::time::Duration;

impl From<ChannelError> for Failure {
    fn from(error: ChannelError) -> Failure {
        Failure::stage_failed(error.to_string())
    }
}

/// The domain of a run; what is left of it goes when this is dropped. Drop it after the children and the hub.
pub struct Domain {
    /// Its name.
    pub name: String,
}

impl Domain {
    /// A name that no other run has.
    pub fn new() -> Domain {
        let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let nonce = since_epoch.map_or(0, |time| time.subsec_nanos().into());
        Domain { name: domain::new_name(std::process::id(), nonce) }
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        for path in domain::clean(&self.name) {
            eprintln!("warning: {} could not be removed", path.display());
        }
    }
}

/// The orchestrator's ends of all channels.
pub struct Hub {
    control: BTreeMap<StageName, ControlServer>,
    work: WorkServer,
    candidates: RegionSubscriber,
    plans: PlanSubscriber,
    cuts: CutSubscriber,
    segments: SegmentSubscriber,
    progress: Subscriber<ipc::Service, ProgressRecord, ()>,
    events: Vec<Listener<ipc::Service>>,
    wake: BTreeMap<StageName, Notifier<ipc::Service>>,
    waiting: WaitSet<ipc::Service>,
    // Declared last: ports are dropped before the node they belong to.
    _node: RunNode,
}

/// What gcs and miqp announced since the last look.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct Announced {
    /// Segments, as (position, length).
    pub segments: Vec<(u64, f64)>,
    /// Cuts.
    pub n_cuts: u64,
    /// Plans, as (ℓ, cost).
    pub plans: Vec<(u64, f64)>,
}

impl Hub {
    /// Creates all channels, before any stage starts.
    pub fn open(domain_name: &str) -> Result<Hub, Failure> {
        let node = domain::enter(domain_name).map_err(|error| Failure::stage_failed(error.to_string()))?;
        let (mut control, mut wake, mut events) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
        for stage in StageName::ALL {
            control.insert(stage, channel::control_server(&node, stage)?);
            wake.insert(stage, channel::notifier(&node, &channel::wake_name(stage))?);
            events.push(channel::listener(&node, &channel::events_name(stage))?);
        }
        let waiting = WaitSetBuilder::new()
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| ChannelError::new("events", error))?;
        Ok(Hub {
            control,
            work: channel::work_server(&node)?,
            candidates: channel::subscriber(&node, channel::CANDIDATES)?,
            plans: channel::subscriber(&node, channel::PLANS)?,
            cuts: channel::subscriber(&node, channel::CUTS)?,
            segments: channel::subscriber(&node, channel::SEGMENTS)?,
            progress: channel::progress_subscriber(&node)?,
            events,
            wake,
            waiting,
            _node: node,
        })
    }

    /// Waits until a stage has something to say, `timeout` at most.
    pub fn wait(&self, timeout: Duration) -> Result<(), Failure> {
        let failed = |error: &dyn Debug| ChannelError::new("events", error);
        {
            let mut guards = Vec::with_capacity(self.events.len());
            for listener in &self.events {
                guards.push(self.waiting.attach_notification(listener).map_err(|error| failed(&error))?);
            }
            self.waiting
                .wait_and_process_once_with_timeout(|_| CallbackProgression::Continue, timeout)
                .map_err(|error| failed(&error))?;
        }
        for listener in &self.events {
            // An event that is not taken out would wake us for ever.
            listener.try_wait(|_| {}).map_err(|error| failed(&error))?;
        }
        Ok(())
    }

    /// Questions of the stage since the last look.
    pub fn questions(&self, stage: StageName) -> Result<Vec<WaitingStage>, Failure> {
        let mut found = Vec::new();
        if let Some(server) = self.control.get(&stage) {
            while let Some(request) =
                server.receive().map_err(|error| ChannelError::new(channel::control_name(stage), error))?
            {
                found.push(request);
            }
        }
        Ok(found)
    }

    /// Workers that ask for work since the last look.
    pub fn workers(&self) -> Result<Vec<WaitingWorker>, Failure> {
        let mut found = Vec::new();
        while let Some(request) =
            self.work.receive().map_err(|error| ChannelError::new(channel::WORK, error))?
        {
            found.push(request);
        }
        Ok(found)
    }

    /// Candidates since the last look: the region, or only its id if it is to be read from disk.
    pub fn candidates(&self, scene_digest: &Digest) -> Result<Vec<(u64, Option<Region>)>, Failure> {
        let mut found = Vec::new();
        while let Some(sample) =
            self.candidates.receive().map_err(|error| ChannelError::new(channel::CANDIDATES, error))?
        {
            let header = sample.user_header();
            let region = header
                .decode(sample.payload(), scene_digest)
                .map_err(|error| Failure::stage_failed(format!("decompose: {error}")))?;
            found.push((header.id, region));
        }
        Ok(found)
    }

    /// Plans, cuts and segments since the last look.
    pub fn announced(&self) -> Result<Announced, Failure> {
        let mut found = Announced::default();
        while let Some(sample) =
            self.plans.receive().map_err(|error| ChannelError::new(channel::PLANS, error))?
        {
            found.plans.push((sample.user_header().n_grasps, sample.user_header().cost));
        }
        while self.cuts.receive().map_err(|error| ChannelError::new(channel::CUTS, error))?.is_some() {
            found.n_cuts += 1;
        }
        while let Some(sample) =
            self.segments.receive().map_err(|error| ChannelError::new(channel::SEGMENTS, error))?
        {
            found.segments.push((sample.user_header().segment_idx, sample.user_header().length));
        }
        Ok(found)
    }

    /// Progress records since the last look.
    pub fn progress(&self) -> Result<Vec<ProgressRecord>, Failure> {
        let mut found = Vec::new();
        while let Some(sample) =
            self.progress.receive().map_err(|error| ChannelError::new(channel::PROGRESS, error))?
        {
            if sample.payload().protocol_version == PROTOCOL_VERSION {
                found.push(*sample.payload());
            }
        }
        Ok(found)
    }

    /// Answers a stage.
    pub fn answer(
        &self,
        stage: StageName,
        request: &WaitingStage,
        reply: Reply,
        job: u64,
        ids: &[u64],
    ) -> Result<(), Failure> {
        let name = channel::control_name(stage);
        let failed = |error: &dyn Debug| ChannelError::new(name.clone(), error);
        let mut answer = request.loan_slice_uninit(ids.len()).map_err(|error| failed(&error))?;
        *answer.user_header_mut() = ControlAnswer {
            protocol_version: PROTOCOL_VERSION,
            reply: reply as u32,
            job,
            n_ids: ids.len() as u64,
        };
        // A stage that has died meanwhile is found by its exit.
        let _ = answer.write_from_fn(|i| ids[i]).send();
        self.wake(stage)
    }

    /// Gives a worker a region, or tells it that there will be no more.
    pub fn answer_worker(
        &self,
        request: &WaitingWorker,
        region: Option<(&Region, &Digest)>,
    ) -> Result<(), Failure> {
        let failed = |error: &dyn Debug| ChannelError::new(channel::WORK, error);
        let (reply, header, payload) = match region {
            Some((region, digest)) => {
                let (header, payload) = RegionHeader::encode(region, digest);
                (WorkReply::Region, header, payload)
            }
            None => (WorkReply::Stop, RegionHeader::default(), Vec::new()),
        };
        let mut answer = request.loan_slice_uninit(payload.len()).map_err(|error| failed(&error))?;
        *answer.user_header_mut() =
            WorkAnswer { protocol_version: PROTOCOL_VERSION, reply: reply as u32, region: header };
        let _ = answer.write_from_fn(|i| payload[i]).send();
        self.wake(StageName::Certify)
    }

    fn wake(&self, stage: StageName) -> Result<(), Failure> {
        if let Some(notifier) = self.wake.get(&stage) {
            notifier.notify().map_err(|error| ChannelError::new(channel::wake_name(stage), error))?;
        }
        Ok(())
    }
}

/// Removes, or only names, what runs have left whose orchestrator is alive no more.
pub fn clean_dead(dry_run: bool) -> Result<Vec<String>, Failure> {
    let found = domain::files_of_dead(is_alive);
    if !dry_run {
        let mut names: Vec<String> = found.iter().map(AsRef::as_ref).filter_map(domain_of).collect();
        names.dedup();
        // First by the library's own call, domain by domain; then whatever bears the names.
        names.iter().for_each(|name| drop(domain::clean(name)));
        domain::remove_all(&found);
    }
    Ok(found.iter().map(|path| path.display().to_string()).collect())
}

/// Name of the domain that a file belongs to: up to the first `_`.
fn domain_of(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    name.split_once('_').map(|(domain, _)| format!("{domain}_"))
}

fn is_alive(process_id: u32) -> bool {
    // SAFETY: signal 0 only asks whether the process exists.
    let answer = unsafe { libc::kill(libc::pid_t::try_from(process_id).unwrap_or(0), 0) };
    answer == 0 || std::io::Error::last_os_error().raw_os_error() == Some(libc::EPERM)
}
