//! The process: signals, time limit, death with the parent, panics, use of resources.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Why the work should end early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// SIGINT or SIGTERM.
    Interrupted,
    /// The time limit has passed.
    TimeLimit,
}

/// Tells the work to end early. Cheap to ask and to clone; may be asked from any thread.
#[derive(Debug, Clone, Default)]
pub struct StopFlag {
    interrupted: Arc<AtomicBool>,
    deadline: Option<Instant>,
}

impl StopFlag {
    /// Set by SIGINT and SIGTERM, and once `limit` has passed from now.
    pub(crate) fn of_process(limit: Option<Duration>) -> std::io::Result<StopFlag> {
        let interrupted = Arc::new(AtomicBool::new(false));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            signal_hook::flag::register(signal, Arc::clone(&interrupted))?;
        }
        Ok(StopFlag { interrupted, deadline: limit.and_then(|limit| Instant::now().checked_add(limit)) })
    }

    /// Why to stop, if so.
    pub fn reason(&self) -> Option<Stop> {
        if self.interrupted.load(Ordering::Relaxed) {
            Some(Stop::Interrupted)
        } else if self.deadline.is_some_and(|deadline| Instant::now() >= deadline) {
            Some(Stop::TimeLimit)
        } else {
            None
        }
    }

    /// Whether to stop.
    pub fn is_set(&self) -> bool {
        self.reason().is_some()
    }
}

/// Asks the kernel to kill this process when its parent dies, so that no stage outlives a run. `parent` is the parent
/// that is meant: if it has died already, the answer is false.
pub(crate) fn die_with_parent(parent: Option<u32>) -> bool {
    #[cfg(target_os = "linux")]
    {
        // SAFETY: prctl with PR_SET_PDEATHSIG takes a signal number and touches no memory of ours; getppid cannot fail.
        let now = unsafe {
            libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
            libc::getppid()
        };
        parent.is_none_or(|meant| i64::from(meant) == i64::from(now))
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = parent;
        true
    }
}

/// What the process has used so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Usage {
    /// User and system time, seconds.
    pub cpu_seconds: f64,
    /// Largest resident memory, bytes.
    pub peak_bytes: u64,
}

/// What the process has used so far.
pub(crate) fn usage() -> Usage {
    // SAFETY: `rusage` is plain data for which zero is valid, and getrusage writes only into the struct it is given.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        if libc::getrusage(libc::RUSAGE_SELF, &mut usage) != 0 {
            return Usage::default();
        }
        usage
    };
    let seconds = |time: libc::timeval| time.tv_sec as f64 + 1e-6 * time.tv_usec as f64;
    Usage {
        cpu_seconds: seconds(usage.ru_utime) + seconds(usage.ru_stime),
        peak_bytes: own_peak_bytes().unwrap_or_else(|| u64::try_from(usage.ru_maxrss).unwrap_or(0) * 1024),
    }
}

/// Peak of this program alone: getrusage also counts what the parent held when it forked.
fn own_peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()? * 1024)
}

static PANIC_MESSAGE: Mutex<Option<String>> = Mutex::new(None);

/// Runs `work`; a panic becomes a message of one line.
pub(crate) fn without_panic<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    std::panic::set_hook(Box::new(|info| {
        let words = info.payload().downcast_ref::<&str>().map(|text| (*text).to_owned());
        let words = words.or_else(|| info.payload().downcast_ref::<String>().cloned());
        let place =
            info.location().map_or(String::new(), |place| format!(" ({}:{})", place.file(), place.line()));
        let message = format!("internal error: {}{place}", words.unwrap_or_default());
        if let Ok(mut slot) = PANIC_MESSAGE.lock() {
            // The first panic is the cause; later ones follow from it.
            slot.get_or_insert(one_line(&message));
        }
    }));
    let result = catch_unwind(AssertUnwindSafe(work));
    let _ = std::panic::take_hook();
    result.map_err(|_| {
        let message = PANIC_MESSAGE.lock().ok().and_then(|mut slot| slot.take());
        message.unwrap_or_else(|| "internal error".to_owned())
    })
}

/// `text` in one line.
pub(crate) fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_line() {
        let message = without_panic(|| panic!("two\nlines {}", 7)).unwrap_err();
        assert!(message.starts_with("internal error: two; lines 7 ("), "{message}");
        assert_eq!(without_panic(|| 5), Ok(5));
    }

    #[test]
    fn a_passed_deadline_sets_the_flag() {
        let flag = StopFlag { deadline: Some(Instant::now()), ..StopFlag::default() };
        assert_eq!(flag.reason(), Some(Stop::TimeLimit));
        assert!(!StopFlag::default().is_set());
    }

    #[test]
    fn usage_is_positive() {
        assert!(usage().peak_bytes > 0);
    }
}
