//! The channel table: names, patterns and capacities, the same for both ends.
//!
//! | channel | pattern | carries | writer → reader |
//! | --- | --- | --- | --- |
//! | `regions/candidate` | publish-subscribe | regions | decompose → orchestrator |
//! | `regions/certified` | publish-subscribe | regions | certify → all |
//! | `certify/work` | request-response | workers pull regions | certify ↔ orchestrator |
//! | `plans/grasp` | publish-subscribe | configurations | miqp → orchestrator |
//! | `plans/cuts` | publish-subscribe | leaf cuts | gcs → orchestrator |
//! | `plans/segments` | publish-subscribe | control points | gcs → orchestrator |
//! | `control/<stage>` | request-response | a job and its outcome | stage ↔ orchestrator |
//! | `events/<stage>` | event | something happened | stage → orchestrator |
//! | `wake/<stage>` | event | an answer is there | orchestrator → stage |
//! | `progress` | publish-subscribe, newest wins | progress records | all → orchestrator |
//!
//! A request goes to every connected server and a sample to every subscriber, so neither is a work queue: workers ask,
//! the orchestrator is the only server. Region channels do not overflow; a sample that finds a full buffer is dropped
//! by its sender and read from disk by its reader, so a busy reader never blocks a writer.

use crate::message::{
    ControlAnswer, ControlRequest, CutHeader, PlanHeader, ProgressRecord, RegionHeader, SegmentHeader,
    WorkAnswer, WorkRequest,
};
use crate::stage_name::StageName;
use iceoryx2::active_request::ActiveRequest;
use iceoryx2::node::Node;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::server::Server;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, ServiceName, ZeroCopySend, ipc};
use std::fmt::Debug;

/// Most certification workers of a run.
pub const MAX_WORKERS: usize = 256;

/// Processes of a run, with room to spare for observers.
const MAX_PROCESSES: usize = MAX_WORKERS + 16;

/// Samples that wait for a busy reader before they are dropped and read from disk.
const BUFFER: usize = 64;

/// Elements that are allocated in advance for a sample; longer ones make the segment grow.
const FIRST_LENGTH: usize = 512;

/// The same for ids, and for work: the library sets memory aside for every client that there may be.
const FIRST_IDS: usize = 4;
const FIRST_WORK: usize = 64;

/// Node of a process in the domain of a run.
pub type RunNode = Node<ipc::Service>;
/// Sends regions.
pub type RegionPublisher = Publisher<ipc::Service, [f64], RegionHeader>;
/// Receives regions.
pub type RegionSubscriber = Subscriber<ipc::Service, [f64], RegionHeader>;
/// Asks for work.
pub type WorkClient = Client<ipc::Service, WorkRequest, (), [f64], WorkAnswer>;
/// Gives work.
pub type WorkServer = Server<ipc::Service, WorkRequest, (), [f64], WorkAnswer>;
/// A worker that waits for an answer.
pub type WaitingWorker = ActiveRequest<ipc::Service, WorkRequest, (), [f64], WorkAnswer>;
/// A worker's wait for an answer.
pub type PendingWork = PendingResponse<ipc::Service, WorkRequest, (), [f64], WorkAnswer>;
/// Asks for jobs.
pub type ControlClient = Client<ipc::Service, [u64], ControlRequest, [u64], ControlAnswer>;
/// Gives jobs.
pub type ControlServer = Server<ipc::Service, [u64], ControlRequest, [u64], ControlAnswer>;
/// A stage that waits for an answer.
pub type WaitingStage = ActiveRequest<ipc::Service, [u64], ControlRequest, [u64], ControlAnswer>;
/// A stage's wait for an answer.
pub type PendingControl = PendingResponse<ipc::Service, [u64], ControlRequest, [u64], ControlAnswer>;

/// A channel that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("channel {channel}: {cause}; are all processes of the run of the same version?")]
pub struct ChannelError {
    /// Name of the channel.
    pub channel: String,
    /// What went wrong.
    pub cause: String,
}

impl ChannelError {
    /// An error of the library on a channel.
    pub fn new(channel: impl Into<String>, cause: impl Debug) -> ChannelError {
        ChannelError { channel: channel.into(), cause: format!("{cause:?}") }
    }
}

/// `regions/candidate`.
pub const CANDIDATES: &str = "regions/candidate";
/// `regions/certified`.
pub const CERTIFIED: &str = "regions/certified";
/// `certify/work`.
pub const WORK: &str = "certify/work";
/// `plans/grasp`.
pub const PLANS: &str = "plans/grasp";
/// `plans/cuts`.
pub const CUTS: &str = "plans/cuts";
/// `plans/segments`.
pub const SEGMENTS: &str = "plans/segments";
/// `progress`.
pub const PROGRESS: &str = "progress";

/// `control/<stage>`.
pub fn control_name(stage: StageName) -> String {
    format!("control/{stage}")
}

/// `events/<stage>`.
pub fn events_name(stage: StageName) -> String {
    format!("events/{stage}")
}

/// `wake/<stage>`.
pub fn wake_name(stage: StageName) -> String {
    format!("wake/{stage}")
}

fn service_name(channel: &str) -> Result<ServiceName, ChannelError> {
    ServiceName::new(channel).map_err(|error| ChannelError::new(channel, error))
}

type Factory<P, H> = iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, [P], H>;

/// A channel of outputs with header `H` and payload `[P]`.
fn output_channel<P, H>(node: &RunNode, channel: &str) -> Result<Factory<P, H>, ChannelError>
where
    P: ZeroCopySend + Debug + 'static,
    H: ZeroCopySend + Debug + Default + 'static,
{
    node.service_builder(&service_name(channel)?)
        .publish_subscribe::<[P]>()
        .user_header::<H>()
        .enable_safe_overflow(false)
        .subscriber_max_buffer_size(BUFFER)
        .subscriber_max_borrowed_samples(2)
        .history_size(0)
        .max_publishers(MAX_PROCESSES)
        .max_subscribers(16)
        .max_nodes(MAX_PROCESSES)
        .open_or_create()
        .map_err(|error| ChannelError::new(channel, error))
}

/// Sends outputs: with a full buffer at a reader the sample is dropped for it.
pub fn publisher<P, H>(node: &RunNode, channel: &str) -> Result<Publisher<ipc::Service, [P], H>, ChannelError>
where
    P: ZeroCopySend + Debug + 'static,
    H: ZeroCopySend + Debug + Default + 'static,
{
    output_channel::<P, H>(node, channel)?
        .publisher_builder()
        .initial_max_slice_len(FIRST_LENGTH)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(|error| ChannelError::new(channel, error))
}

/// Receives outputs.
pub fn subscriber<P, H>(
    node: &RunNode,
    channel: &str,
) -> Result<Subscriber<ipc::Service, [P], H>, ChannelError>
where
    P: ZeroCopySend + Debug + 'static,
    H: ZeroCopySend + Debug + Default + 'static,
{
    let factory = output_channel::<P, H>(node, channel)?;
    factory.subscriber_builder().create().map_err(|error| ChannelError::new(channel, error))
}

/// Sends one output.
pub fn publish<P, H>(
    publisher: &Publisher<ipc::Service, [P], H>,
    channel: &str,
    header: H,
    payload: &[P],
) -> Result<(), ChannelError>
where
    P: ZeroCopySend + Debug + Copy + 'static,
    H: ZeroCopySend + Debug + Default + 'static,
{
    let failed = |error: &dyn Debug| ChannelError::new(channel, error);
    let mut sample = publisher.loan_slice_uninit(payload.len()).map_err(|error| failed(&error))?;
    *sample.user_header_mut() = header;
    sample.write_from_fn(|i| payload[i]).send().map_err(|error| failed(&error))?;
    Ok(())
}

type WorkFactory = iceoryx2::service::port_factory::request_response::PortFactory<
    ipc::Service,
    WorkRequest,
    (),
    [f64],
    WorkAnswer,
>;

fn work_channel(node: &RunNode) -> Result<WorkFactory, ChannelError> {
    node.service_builder(&service_name(WORK)?)
        .request_response::<WorkRequest, [f64]>()
        .response_user_header::<WorkAnswer>()
        .max_servers(1)
        .max_clients(MAX_WORKERS)
        .max_nodes(MAX_PROCESSES)
        .max_active_requests_per_client(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
        .max_loaned_requests(1)
        .enable_safe_overflow_for_requests(false)
        .enable_safe_overflow_for_responses(false)
        .open_or_create()
        .map_err(|error| ChannelError::new(WORK, error))
}

/// Worker's end of `certify/work`.
pub fn work_client(node: &RunNode) -> Result<WorkClient, ChannelError> {
    let factory = work_channel(node)?;
    factory.client_builder().create().map_err(|error| ChannelError::new(WORK, error))
}

/// Orchestrator's end of `certify/work`.
pub fn work_server(node: &RunNode) -> Result<WorkServer, ChannelError> {
    work_channel(node)?
        .server_builder()
        .initial_max_slice_len(FIRST_WORK)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(|error| ChannelError::new(WORK, error))
}

type ControlFactory = iceoryx2::service::port_factory::request_response::PortFactory<
    ipc::Service,
    [u64],
    ControlRequest,
    [u64],
    ControlAnswer,
>;

fn control_channel(node: &RunNode, stage: StageName) -> Result<ControlFactory, ChannelError> {
    let channel = control_name(stage);
    node.service_builder(&service_name(&channel)?)
        .request_response::<[u64], [u64]>()
        .request_user_header::<ControlRequest>()
        .response_user_header::<ControlAnswer>()
        .max_servers(1)
        .max_clients(if stage == StageName::Certify { MAX_WORKERS } else { 4 })
        .max_nodes(MAX_PROCESSES)
        .max_active_requests_per_client(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
        .max_loaned_requests(1)
        .enable_safe_overflow_for_requests(false)
        .enable_safe_overflow_for_responses(false)
        .open_or_create()
        .map_err(|error| ChannelError::new(channel, error))
}

/// Stage's end of `control/<stage>`.
pub fn control_client(node: &RunNode, stage: StageName) -> Result<ControlClient, ChannelError> {
    control_channel(node, stage)?
        .client_builder()
        .initial_max_slice_len(FIRST_IDS)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .create()
        .map_err(|error| ChannelError::new(control_name(stage), error))
}

/// Orchestrator's end of `control/<stage>`.
pub fn control_server(node: &RunNode, stage: StageName) -> Result<ControlServer, ChannelError> {
    control_channel(node, stage)?
        .server_builder()
        .initial_max_slice_len(FIRST_IDS)
        .allocation_strategy(AllocationStrategy::PowerOfTwo)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(|error| ChannelError::new(control_name(stage), error))
}

type EventFactory = iceoryx2::service::port_factory::event::PortFactory<ipc::Service>;

fn event_channel(node: &RunNode, channel: &str) -> Result<EventFactory, ChannelError> {
    node.service_builder(&service_name(channel)?)
        .event()
        .max_listeners(MAX_PROCESSES)
        .max_notifiers(MAX_PROCESSES)
        .max_nodes(MAX_PROCESSES)
        .open_or_create()
        .map_err(|error| ChannelError::new(channel, error))
}

/// Tells the other side of an event channel.
pub fn notifier(node: &RunNode, channel: &str) -> Result<Notifier<ipc::Service>, ChannelError> {
    let factory = event_channel(node, channel)?;
    factory.notifier_builder().create().map_err(|error| ChannelError::new(channel, error))
}

/// Hears of events.
pub fn listener(node: &RunNode, channel: &str) -> Result<Listener<ipc::Service>, ChannelError> {
    let factory = event_channel(node, channel)?;
    factory.listener_builder().create().map_err(|error| ChannelError::new(channel, error))
}

type ProgressFactory =
    iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, ProgressRecord, ()>;

fn progress_channel(node: &RunNode) -> Result<ProgressFactory, ChannelError> {
    node.service_builder(&service_name(PROGRESS)?)
        .publish_subscribe::<ProgressRecord>()
        .enable_safe_overflow(true)
        .subscriber_max_buffer_size(1)
        .max_publishers(MAX_PROCESSES)
        .max_subscribers(16)
        .max_nodes(MAX_PROCESSES)
        .open_or_create()
        .map_err(|error| ChannelError::new(PROGRESS, error))
}

/// Sends progress records; the newest of a sender wins.
pub fn progress_publisher(
    node: &RunNode,
) -> Result<Publisher<ipc::Service, ProgressRecord, ()>, ChannelError> {
    let factory = progress_channel(node)?;
    factory.publisher_builder().create().map_err(|error| ChannelError::new(PROGRESS, error))
}

/// Receives progress records.
pub fn progress_subscriber(
    node: &RunNode,
) -> Result<Subscriber<ipc::Service, ProgressRecord, ()>, ChannelError> {
    let factory = progress_channel(node)?;
    factory.subscriber_builder().create().map_err(|error| ChannelError::new(PROGRESS, error))
}

/// Sends plans.
pub type PlanPublisher = Publisher<ipc::Service, [f64], PlanHeader>;
/// Receives plans.
pub type PlanSubscriber = Subscriber<ipc::Service, [f64], PlanHeader>;
/// Sends cuts.
pub type CutPublisher = Publisher<ipc::Service, [u64], CutHeader>;
/// Receives cuts.
pub type CutSubscriber = Subscriber<ipc::Service, [u64], CutHeader>;
/// Sends segments.
pub type SegmentPublisher = Publisher<ipc::Service, [f64], SegmentHeader>;
/// Receives segments.
pub type SegmentSubscriber = Subscriber<ipc::Service, [f64], SegmentHeader>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefact::Region;
    use crate::domain;
    use crate::message::{Question, Reply};
    use std::path::PathBuf;

    /// A domain that is cleaned when the test ends.
    struct TestDomain(String);

    impl TestDomain {
        fn new(nonce: u64) -> TestDomain {
            TestDomain(domain::new_name(std::process::id(), nonce))
        }
    }

    impl Drop for TestDomain {
        fn drop(&mut self) {
            assert_eq!(domain::clean(&self.0), Vec::<PathBuf>::new());
        }
    }

    #[test]
    fn regions_travel_and_a_full_buffer_does_not_block() {
        let name = TestDomain::new(0x101);
        let (sender, receiver) = (domain::enter(&name.0).unwrap(), domain::enter(&name.0).unwrap());
        let inbox = subscriber::<f64, RegionHeader>(&receiver, CERTIFIED).unwrap();
        let outbox = publisher::<f64, RegionHeader>(&sender, CERTIFIED).unwrap();
        let region = Region {
            id: 1,
            parent: None,
            A: vec![vec![1.0], vec![-1.0]],
            b: vec![1.0, 1.0],
            center: vec![0.0],
            method: "box".into(),
            certified: false,
            margin: 0.0,
        };
        let (header, payload) = RegionHeader::encode(&region, &[1; 32]);
        for sequence in 0..(BUFFER as u64 + 10) {
            publish(&outbox, CERTIFIED, RegionHeader { sequence, ..header }, &payload).unwrap();
        }
        // More elements than were allocated in advance.
        let mut n_received = 0;
        while let Some(sample) = inbox.receive().unwrap() {
            assert_eq!(sample.user_header().sequence, n_received);
            assert_eq!(
                sample.user_header().decode(sample.payload(), &[1; 32]).unwrap(),
                Some(region.clone())
            );
            n_received += 1;
        }
        assert_eq!(n_received, BUFFER as u64);
        publish(&outbox, CERTIFIED, header, &vec![0.5; 100 * FIRST_LENGTH]).unwrap();
        assert_eq!(inbox.receive().unwrap().unwrap().payload().len(), 100 * FIRST_LENGTH);
    }

    #[test]
    fn a_question_is_answered_when_there_is_an_answer() {
        let name = TestDomain::new(0x102);
        let (node, other) = (domain::enter(&name.0).unwrap(), domain::enter(&name.0).unwrap());
        let server = control_server(&node, StageName::Miqp).unwrap();
        let client = control_client(&other, StageName::Miqp).unwrap();
        let listener = listener(&node, &events_name(StageName::Miqp)).unwrap();
        let notifier = notifier(&other, &events_name(StageName::Miqp)).unwrap();
        let mut request = client.loan_slice_uninit(0).unwrap();
        request.user_header_mut().question = Question::Ready as u32;
        let pending = request.write_from_fn(|_| 0).send().unwrap();
        notifier.notify().unwrap();
        let mut n_events = 0;
        listener.try_wait(|_| n_events += 1).unwrap();
        assert_eq!(n_events, 1);
        let waiting = server.receive().unwrap().unwrap();
        assert!(pending.receive().unwrap().is_none());
        let mut answer = waiting.loan_slice_uninit(2).unwrap();
        answer.user_header_mut().reply = Reply::Certified as u32;
        answer.write_from_fn(|i| i as u64 + 40).send().unwrap();
        let received = pending.receive().unwrap().unwrap();
        assert_eq!(received.payload(), [40, 41]);
        assert_eq!(Reply::from_number(received.user_header().reply), Some(Reply::Certified));
    }
}
