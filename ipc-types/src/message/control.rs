//! Jobs, their outcomes, and work for certification workers. Stages ask, the orchestrator answers when it can.

use super::region::RegionHeader;
use crate::Digest;
use iceoryx2::prelude::ZeroCopySend;

/// Header of a request on `control/<stage>`. Payload: ids of candidates of [`Question::Certified`], else empty.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("ControlRequest")]
#[repr(C)]
pub struct ControlRequest {
    /// [`crate::PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// Number of the stage.
    pub stage: u32,
    /// Number of the worker; 0 where there is one.
    pub worker: u32,
    /// Process.
    pub pid: u32,
    /// A [`Question`].
    pub question: u32,
    /// Exit code that the job would have; with [`Question::Finished`].
    pub exit_code: i32,
    /// Number of the job that has ended; with [`Question::Finished`].
    pub job: u64,
    /// Digest of the scene.
    pub scene_digest: Digest,
}

/// What a stage asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Question {
    /// The stage has loaded the scene: what is its first job?
    Ready = 1,
    /// The job has ended, its outputs and `status.json` are on disk: what next?
    Finished = 2,
    /// decompose: what became of these candidates?
    Certified = 3,
}

impl Question {
    /// The question of that number.
    pub fn from_number(number: u32) -> Option<Question> {
        [Question::Ready, Question::Finished, Question::Certified].into_iter().find(|q| *q as u32 == number)
    }
}

/// Header of an answer on `control/<stage>`. Payload: ids of certified regions of [`Reply::Certified`], else empty.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("ControlAnswer")]
#[repr(C)]
pub struct ControlAnswer {
    /// [`crate::PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// A [`Reply`].
    pub reply: u32,
    /// Number of the job.
    pub job: u64,
    /// Number of ids in the payload.
    pub n_ids: u64,
}

/// What the orchestrator answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Reply {
    /// Do this job: read the inputs from the run directory.
    Job = 1,
    /// End. All outputs are received.
    Stop = 2,
    /// All the candidates are certified; the payload names the regions.
    Certified = 3,
    /// There is no certification in this run.
    NoCertification = 4,
}

impl Reply {
    /// The answer of that number.
    pub fn from_number(number: u32) -> Option<Reply> {
        [Reply::Job, Reply::Stop, Reply::Certified, Reply::NoCertification]
            .into_iter()
            .find(|reply| *reply as u32 == number)
    }
}

/// A request on `certify/work`: give me a region.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("WorkRequest")]
#[repr(C)]
pub struct WorkRequest {
    /// [`crate::PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// Number of the worker.
    pub worker: u32,
    /// Process.
    pub pid: u32,
    /// Filled with zeros.
    pub reserved: u32,
    /// The candidate whose part is on disk now, or [`super::NO_ID`].
    pub finished_candidate: u64,
    /// Digest of the scene.
    pub scene_digest: Digest,
}

/// Header of an answer on `certify/work`. Payload: that of the region.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("WorkAnswer")]
#[repr(C)]
pub struct WorkAnswer {
    /// [`crate::PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// A [`WorkReply`].
    pub reply: u32,
    /// The candidate.
    pub region: RegionHeader,
}

/// What the orchestrator answers a worker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum WorkReply {
    /// Certify this region.
    Region = 1,
    /// There will be no more.
    Stop = 2,
}

impl WorkReply {
    /// The answer of that number.
    pub fn from_number(number: u32) -> Option<WorkReply> {
        [WorkReply::Region, WorkReply::Stop].into_iter().find(|reply| *reply as u32 == number)
    }
}
