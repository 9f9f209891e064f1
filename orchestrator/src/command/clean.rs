//! `regrasp clean`: removes what dead runs left in shared memory.

use crate::cli::CleanArgs;
use crate::failure::{ExitCode, Failure};
use crate::quantity::count;
use ipc_types::domain::{files_of_dead, remove_all};

/// Removes, or only names, leftovers of runs whose orchestrator is gone; runs that still work are not touched.
pub fn clean(args: &CleanArgs) -> Result<ExitCode, Failure> {
    let leftovers = files_of_dead(is_alive);
    let mut text: String = leftovers.iter().map(|path| format!("{}\n", path.display())).collect();
    if args.dry_run {
        text.push_str(&format!("{} would be removed\n", count(leftovers.len(), "leftover")));
        super::print(text.as_bytes())?;
        return Ok(ExitCode::Done);
    }
    remove_all(&leftovers);
    text.push_str(&format!("{} removed\n", count(leftovers.len(), "leftover")));
    super::print(text.as_bytes())?;
    let remaining = files_of_dead(is_alive);
    match remaining.first() {
        Some(path) => Err(Failure::stage_failed(format!(
            "{} cannot be removed; it may belong to another user",
            path.display()
        ))),
        None => Ok(ExitCode::Done),
    }
}

/// Whether a process with this id exists. One that may not be signalled exists too.
fn is_alive(process_id: u32) -> bool {
    let Ok(process_id) = libc::pid_t::try_from(process_id) else { return false };
    // SAFETY: signal 0 is sent to nobody; the call only reports whether it could be.
    let answer = unsafe { libc::kill(process_id, 0) };
    answer == 0 || std::io::Error::last_os_error().raw_os_error() == Some(libc::EPERM)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_lives_and_an_impossible_one_does_not() {
        assert!(is_alive(std::process::id()));
        assert!(!is_alive(u32::MAX));
        assert!(!is_alive(i32::MAX as u32));
    }
}
