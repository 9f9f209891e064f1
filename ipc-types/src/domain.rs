//! The iceoryx2 domain of a run: a prefix of its own, so that runs do not see each other, and nothing left behind.

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{FileName, LogLevel, SemanticString, SignalHandlingMode, ipc, set_log_level};
use std::path::{Path, PathBuf};

/// What every domain's name begins with.
pub const DOMAIN_PREFIX: &str = "regrasp-";

/// A domain that cannot be entered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shared-memory domain {domain}: {cause}; check that /dev/shm and /tmp/iceoryx2 can be written")]
pub struct DomainError {
    /// Name of the domain.
    pub domain: String,
    /// What went wrong.
    pub cause: String,
}

/// Name of a new domain: process id of its orchestrator, then something that tells two runs of one process apart.
pub fn new_name(process_id: u32, nonce: u64) -> String {
    format!("{DOMAIN_PREFIX}{process_id}-{nonce:x}_")
}

/// Process id in the name of a domain or of a file of it.
pub fn process_id_of(name: &str) -> Option<u32> {
    name.strip_prefix(DOMAIN_PREFIX)?.split(['-', '_']).next()?.parse().ok()
}

fn config(domain: &str) -> Result<Config, DomainError> {
    let failed = |cause: String| DomainError { domain: domain.to_owned(), cause };
    if !domain.starts_with(DOMAIN_PREFIX) || domain.contains('/') || domain.len() > 64 {
        return Err(failed(format!("expected a name of at most 64 bytes that begins with {DOMAIN_PREFIX}")));
    }
    // The library's own defaults, whatever configuration files the machine has: all processes must agree.
    let mut config = Config::default();
    config.global.prefix = FileName::new(domain.as_bytes()).map_err(|error| failed(format!("{error:?}")))?;
    Ok(config)
}

/// Enters the domain. Signals stay with the caller.
pub fn enter(domain: &str) -> Result<Node<ipc::Service>, DomainError> {
    // What the library has to say is said by the errors of its calls.
    set_log_level(LogLevel::Fatal);
    NodeBuilder::new()
        .config(&config(domain)?)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(|error| DomainError { domain: domain.to_owned(), cause: format!("{error:?}") })
}

/// Folders in which the library keeps files of a domain.
fn folders() -> Vec<PathBuf> {
    let global = Config::default().global;
    let as_path =
        |path: &iceoryx2::prelude::Path| PathBuf::from(String::from_utf8_lossy(path.as_bytes()).into_owned());
    vec![PathBuf::from("/dev/shm"), as_path(&global.service_dir()), as_path(&global.node_dir())]
}

/// Every file and folder that belongs to the domains for which `belongs` holds.
fn files(belongs: impl Fn(&str) -> bool) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in folders() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry.file_name().to_str().is_some_and(&belongs) {
                found.push(entry.path());
            }
        }
    }
    found.sort();
    found
}

/// Everything of the domain that is in shared memory or on disk.
pub fn files_of(domain: &str) -> Vec<PathBuf> {
    files(|name| name.starts_with(domain))
}

/// Everything of domains whose orchestrator is alive no more, as `is_alive` tells of a process id.
pub fn files_of_dead(is_alive: impl Fn(u32) -> bool) -> Vec<PathBuf> {
    files(|name| process_id_of(name).is_some_and(|id| !is_alive(id)))
}

/// Removes what is left of a domain once all its processes have ended: first what the library finds of dead nodes by
/// its own call, then the one file that it leaves for ever, `<prefix>_node…global_mgmt`, and whatever else bears the
/// name. Returns what remains, which is nothing unless permissions are missing.
pub fn clean(domain: &str) -> Vec<PathBuf> {
    if let Ok(node) = enter(domain) {
        node.try_cleanup_dead_nodes();
    }
    remove_all(&files_of(domain));
    files_of(domain)
}

/// Removes files and folders.
pub fn remove_all(paths: &[PathBuf]) {
    for path in paths {
        // What cannot be removed is found again by the caller, who reports it.
        let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    }
}

/// Whether the path lies in a folder that domains use.
pub fn is_domain_file(path: &Path) -> bool {
    path.file_name().and_then(|name| name.to_str()).is_some_and(|name| process_id_of(name).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_process_id_is_in_the_name() {
        assert_eq!(process_id_of(&new_name(4711, 255)), Some(4711));
        assert_eq!(process_id_of("regrasp-12-ff_node.global_mgmt"), Some(12));
        assert_eq!(process_id_of("iox2_x"), None);
    }

    #[test]
    fn nothing_is_left_of_a_domain() {
        let domain = new_name(std::process::id(), 1);
        {
            let _node = enter(&domain).unwrap();
            assert!(!files_of(&domain).is_empty());
        }
        assert_eq!(clean(&domain), Vec::<PathBuf>::new());
    }

    #[test]
    fn strange_names_are_refused() {
        for name in ["", "iox2_", "regrasp-/../x", &format!("regrasp-{}", "x".repeat(80))] {
            assert!(enter(name).is_err(), "{name}");
        }
    }
}
