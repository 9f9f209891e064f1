//! `regrasp clean`: removes what dead runs left in shared memory.

use crate::cli::CleanArgs;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::clean_dead;
use crate::quantity::count;

/// Removes, or only names, leftovers of runs whose processes are gone.
pub fn clean(args: &CleanArgs) -> Result<ExitCode, Failure> {
    let removed = clean_dead(args.dry_run)?;
    let verb = if args.dry_run { "would be removed" } else { "removed" };
    let mut text: String = removed.iter().map(|name| format!("{name}\n")).collect();
    text.push_str(&format!("{} {verb}\n", count(removed.len(), "leftover")));
    super::print(text.as_bytes())?;
    Ok(ExitCode::Done)
}
