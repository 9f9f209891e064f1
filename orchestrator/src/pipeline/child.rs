//! A child process: started with a log, watched, ended with all it started, its use of resources measured.

use crate::failure::Failure;
use std::ffi::OsString;
use std::fs::OpenOptions;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A command line, and where its output goes.
#[derive(Debug, Clone)]
pub struct CommandLine {
    /// Program.
    pub program: PathBuf,
    /// Arguments.
    pub arguments: Vec<OsString>,
    /// Environment variables besides ours.
    pub environment: Vec<(&'static str, OsString)>,
    /// File to which standard output and standard error are appended.
    pub log: PathBuf,
}

impl CommandLine {
    /// Words joined by spaces, for `run.json`.
    pub fn words(&self) -> String {
        let mut words = vec![self.program.display().to_string()];
        words.extend(self.arguments.iter().map(|word| word.to_string_lossy().into_owned()));
        words.join(" ")
    }
}

/// A process that was started.
#[derive(Debug)]
pub struct Child {
    pid: libc::pid_t,
    started: Instant,
    ended: Option<Ended>,
}

/// How a process ended, and what it used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ended {
    /// Exit code; negative is the signal that ended it.
    pub code: i32,
    /// Wall-clock time of its life, seconds.
    pub seconds: f64,
    /// User and system time, seconds.
    pub cpu_seconds: f64,
    /// Largest resident memory, bytes.
    pub peak_bytes: u64,
}

impl Ended {
    /// The ending in words.
    pub fn words(&self) -> String {
        if self.code < 0 {
            format!("was killed by signal {}", -self.code)
        } else {
            format!("ended with exit code {}", self.code)
        }
    }
}

impl Child {
    /// Starts the command in a process group of its own. It is killed when this process dies.
    pub fn start(command: &CommandLine) -> Result<Child, Failure> {
        let log_file = || -> std::io::Result<std::fs::File> {
            if let Some(folder) = command.log.parent() {
                std::fs::create_dir_all(folder)?;
            }
            OpenOptions::new().create(true).append(true).open(&command.log)
        };
        let log = log_file().map_err(|cause| Failure::file("write", &command.log, cause))?;
        let log_too = log.try_clone().map_err(|cause| Failure::file("write", &command.log, cause))?;
        let mut process = Command::new(&command.program);
        process
            .args(&command.arguments)
            .envs(command.environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(log)
            .stderr(log_too)
            .process_group(0);
        let parent = std::process::id();
        // SAFETY: between fork and exec only prctl and getppid are called, which are async-signal-safe.
        unsafe {
            process.pre_exec(move || die_with(parent));
        }
        let child = process.spawn().map_err(|cause| {
            Failure::bad_input(format!(
                "{}: cannot be started: {cause}; give a program that exists and may be executed",
                command.program.display()
            ))
        })?;
        let pid = libc::pid_t::try_from(child.id())
            .map_err(|_| Failure::stage_failed(format!("process id {} is out of range", child.id())))?;
        Ok(Child { pid, started: Instant::now(), ended: None })
    }

    /// How it ended, if it has. What it started and left behind is killed.
    pub fn poll(&mut self) -> Option<Ended> {
        if self.ended.is_none() {
            // SAFETY: `siginfo_t` and `rusage` are plain data for which zero is valid; both calls write only into what
            // they are given, and `pid` is a child of ours that was not waited for yet.
            unsafe {
                let mut info: libc::siginfo_t = std::mem::zeroed();
                let id = libc::id_t::try_from(self.pid).unwrap_or(0);
                let flags = libc::WEXITED | libc::WNOHANG | libc::WNOWAIT;
                let seen = libc::waitid(libc::P_PID, id, &mut info, flags);
                if seen == 0 && info.si_pid() == 0 {
                    return None;
                }
                // The child is a zombie now, so its group's number cannot belong to anybody else.
                libc::kill(-self.pid, libc::SIGKILL);
                let (mut status, mut usage): (libc::c_int, libc::rusage) = (0, std::mem::zeroed());
                let reaped = libc::wait4(self.pid, &mut status, 0, &mut usage) == self.pid;
                let code = match reaped {
                    true if libc::WIFEXITED(status) => libc::WEXITSTATUS(status),
                    true => -libc::WTERMSIG(status),
                    // Somebody else waited for it: its code is lost.
                    false => 4,
                };
                let seconds = |time: libc::timeval| time.tv_sec as f64 + 1e-6 * time.tv_usec as f64;
                self.ended = Some(Ended {
                    code,
                    seconds: self.started.elapsed().as_secs_f64(),
                    cpu_seconds: seconds(usage.ru_utime) + seconds(usage.ru_stime),
                    peak_bytes: u64::try_from(usage.ru_maxrss).unwrap_or(0) * 1024,
                });
            }
        }
        self.ended
    }

    /// Sends a signal to it and to all it started, if it runs.
    fn signal(&mut self, signal: libc::c_int) {
        if self.poll().is_none() {
            // SAFETY: the group is that of a child of ours that was not waited for yet.
            unsafe {
                libc::kill(-self.pid, signal);
            }
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        end_all([self].into_iter(), Duration::ZERO);
    }
}

/// Ends children: they are asked (SIGTERM), and after `grace` killed. Returns when none is left.
pub fn end_all<'a>(children: impl Iterator<Item = &'a mut Child>, grace: Duration) {
    let mut running: Vec<&mut Child> =
        children.filter_map(|child| child.poll().is_none().then_some(child)).collect();
    let asked = Instant::now();
    if !grace.is_zero() {
        running.iter_mut().for_each(|child| child.signal(libc::SIGTERM));
    }
    let mut killed = false;
    while !running.is_empty() {
        if !killed && asked.elapsed() >= grace {
            running.iter_mut().for_each(|child| child.signal(libc::SIGKILL));
            killed = true;
        }
        std::thread::sleep(Duration::from_millis(2));
        running.retain_mut(|child| child.poll().is_none());
    }
}

/// Waits until the children have ended by themselves, `patience` at most.
pub fn wait_all<'a>(children: impl Iterator<Item = &'a mut Child>, patience: Duration) {
    let began = Instant::now();
    let mut running: Vec<&mut Child> = children.collect();
    loop {
        running.retain_mut(|child| child.poll().is_none());
        if running.is_empty() || began.elapsed() >= patience {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// In the child, before it becomes the program.
fn die_with(parent: u32) -> std::io::Result<()> {
    #[cfg(target_os = "linux")]
    // SAFETY: prctl with PR_SET_PDEATHSIG takes a signal number and touches no memory; getppid cannot fail.
    unsafe {
        if libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) != 0 {
            return Err(std::io::Error::last_os_error());
        }
        if i64::from(libc::getppid()) != i64::from(parent) {
            return Err(std::io::Error::from_raw_os_error(libc::ESRCH));
        }
    }
    Ok(())
}

/// What a program says of its failure: its own verdict, else its first error, else its last line.
pub fn words_in_log(log: &Path) -> Option<String> {
    let bytes = std::fs::read(log).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    let verdict = lines().rfind(|line| {
        line.starts_with("regrasp-")
            && [": bad input: ", ": failed: ", ": negative: "].iter().any(|w| line.contains(w))
    });
    let first_error = || lines().find(|line| line.starts_with("error:"));
    let words = verdict.or_else(first_error).or_else(|| lines().next_back())?;
    let words = words
        .split_once(": bad input: ")
        .or_else(|| words.split_once(": failed: "))
        .map_or(words, |(_, w)| w);
    Some(words.trim_start_matches("error: ").chars().take(2000).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str, folder: &Path) -> CommandLine {
        CommandLine {
            program: "/bin/sh".into(),
            arguments: vec!["-c".into(), script.into()],
            environment: vec![("REGRASP_DOMAIN", "d".into())],
            log: folder.join("log.txt"),
        }
    }

    #[test]
    fn a_child_s_code_output_and_use_are_seen() {
        let folder = tempfile::tempdir().unwrap();
        let mut child =
            Child::start(&shell("echo out; echo \"error: $REGRASP_DOMAIN\" >&2; exit 3", folder.path()))
                .unwrap();
        wait_all([&mut child].into_iter(), Duration::from_secs(600));
        let ended = child.poll().unwrap();
        assert_eq!(ended.code, 3);
        assert!(ended.peak_bytes > 0);
        assert_eq!(words_in_log(&folder.path().join("log.txt")).unwrap(), "d");
    }

    #[test]
    fn a_child_that_ignores_sigterm_is_killed_with_what_it_started() {
        let folder = tempfile::tempdir().unwrap();
        let pid_file = folder.path().join("pid");
        let script = format!("trap '' TERM; sleep 1000 & echo $! > {}; wait", pid_file.display());
        let mut child = Child::start(&shell(&script, folder.path())).unwrap();
        let grandchild = loop {
            if let Ok(pid) =
                std::fs::read_to_string(&pid_file).unwrap_or_default().trim().parse::<libc::pid_t>()
            {
                break pid;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        end_all([&mut child].into_iter(), Duration::from_millis(50));
        assert_eq!(child.poll().unwrap().code, -libc::SIGKILL);
        // The orphan is reaped by init; until then it may be a zombie, which runs no more.
        let runs = || {
            let stat = std::fs::read_to_string(format!("/proc/{grandchild}/stat")).unwrap_or_default();
            !stat.is_empty() && !stat.contains(") Z ")
        };
        while runs() {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn what_cannot_be_started_is_bad_input() {
        let folder = tempfile::tempdir().unwrap();
        let command = CommandLine { program: "/no/such/program".into(), ..shell("", folder.path()) };
        assert_eq!(Child::start(&command).unwrap_err().exit_code.code(), 2);
    }
}
