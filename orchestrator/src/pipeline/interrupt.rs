//! Why a run should end early: Ctrl-C, SIGTERM, or its time limit.

use crate::failure::Failure;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

static INTERRUPTED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Why to end early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// SIGINT or SIGTERM.
    Interrupted,
    /// The time limit.
    TimeLimit,
}

/// Watches for a reason to end early.
#[derive(Debug, Clone)]
pub struct Watch {
    interrupted: Arc<AtomicBool>,
    deadline: Option<Instant>,
}

impl Watch {
    /// From now on; signals are handled once for the process.
    pub fn begin(time_limit: Option<Duration>) -> Result<Watch, Failure> {
        let interrupted = match INTERRUPTED.get() {
            Some(flag) => Arc::clone(flag),
            None => {
                let flag = Arc::new(AtomicBool::new(false));
                for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
                    signal_hook::flag::register(signal, Arc::clone(&flag)).map_err(|cause| {
                        Failure::stage_failed(format!("signals cannot be handled: {cause}"))
                    })?;
                }
                Arc::clone(INTERRUPTED.get_or_init(|| flag))
            }
        };
        Ok(Watch { interrupted, deadline: time_limit.and_then(|limit| Instant::now().checked_add(limit)) })
    }

    /// The reason, if there is one.
    pub fn reason(&self) -> Option<Stop> {
        if self.interrupted.load(Ordering::Relaxed) {
            Some(Stop::Interrupted)
        } else if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            Some(Stop::TimeLimit)
        } else {
            None
        }
    }
}
