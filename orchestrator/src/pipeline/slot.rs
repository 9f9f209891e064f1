//! What the orchestrator knows of one stage of a run.

use super::child::{Child, Ended};
use ipc_types::channel::WaitingStage;
use ipc_types::exit_code::ExitCode;
use ipc_types::stage_name::StageName;
use std::time::{Duration, Instant};

/// How a stage takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// It asks for jobs over channels.
    Channels,
    /// Each job is a program that is started with file-mode arguments, unless it asks over channels after all.
    Files,
    /// It is left out (`--certify none`, `regrasp regions`).
    Absent,
}

/// One stage of a run.
pub struct Slot {
    /// Which.
    pub stage: StageName,
    /// How it takes part.
    pub part: Part,
    /// Its processes, by worker; those of earlier jobs in file mode come first.
    pub processes: Vec<Process>,
    /// Questions that wait for a job.
    pub waiting: Vec<WaitingStage>,
    /// A job should start as soon as somebody asks for one.
    pub wanted: bool,
    /// Processes that work on the job.
    pub n_working: u32,
    /// Number of the job, from 1.
    pub job: u64,
    /// How the last job ended; `None` before.
    pub outcome: Option<ExitCode>,
    /// When the job began.
    pub began: Option<Instant>,
    /// Time of all jobs.
    pub worked: Duration,
    /// Whether it was told to stop.
    pub told_to_stop: bool,
}

/// A process of a stage.
pub struct Process {
    /// Number of the worker.
    pub worker: u32,
    /// The process.
    pub child: Child,
    /// Command, for `run.json`.
    pub command: String,
    /// How it ended, once that was dealt with.
    pub ended: Option<Ended>,
}

impl Slot {
    /// A stage before it starts.
    pub fn new(stage: StageName, part: Part) -> Slot {
        Slot {
            stage,
            part,
            processes: Vec::new(),
            waiting: Vec::new(),
            wanted: false,
            n_working: 0,
            job: 0,
            outcome: None,
            began: None,
            worked: Duration::ZERO,
            told_to_stop: false,
        }
    }

    /// A new job is wanted.
    pub fn want_job(&mut self) {
        self.wanted = true;
        self.job += 1;
        self.outcome = None;
    }

    /// The job has begun in one more process.
    pub fn job_begins(&mut self) {
        self.n_working += 1;
        self.began.get_or_insert_with(Instant::now);
    }

    /// A process has ended its part of the job; the worst outcome counts.
    pub fn job_ends(&mut self, outcome: ExitCode) {
        self.n_working = self.n_working.saturating_sub(1);
        let worse = self.outcome.is_none_or(|known| known.code() < outcome.code());
        if worse {
            self.outcome = Some(outcome);
        }
        if self.n_working == 0
            && let Some(began) = self.began.take()
        {
            self.worked += began.elapsed();
        }
    }

    /// Takes note that the processes have been ended, whether or not they had ended their parts.
    pub fn mark_ended(&mut self) {
        self.n_working = 0;
        if let Some(began) = self.began.take() {
            self.worked += began.elapsed();
        }
    }

    /// Whether the job has ended in all processes that worked on it.
    pub fn is_done(&self) -> bool {
        self.n_working == 0 && !self.wanted && self.outcome.is_some()
    }

    /// The children.
    pub fn children(&mut self) -> impl Iterator<Item = &mut Child> {
        self.processes.iter_mut().map(|process| &mut process.child)
    }

    /// Worst exit code of the processes that have ended; a signal is worse than any code.
    pub fn exit_code(&mut self) -> i32 {
        let codes =
            self.processes.iter_mut().filter_map(|process| process.child.poll()).map(|ended| ended.code);
        codes.reduce(|a, b| if a < 0 || (b >= 0 && a > b) { a } else { b }).unwrap_or(0)
    }
}
