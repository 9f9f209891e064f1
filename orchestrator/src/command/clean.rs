//! `regrasp clean`: removes what dead runs left in shared memory.

use crate::cli::CleanArgs;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::clean_dead;
use crate::quantity::count;

/// Removes, or only names, leftovers of runs whose orchestrator is gone; runs that still work are not touched.
pub fn clean(args: &CleanArgs) -> Result<ExitCode, Failure> {
    let leftovers = clean_dead(args.dry_run)?;
    let mut text: String = leftovers.iter().map(|name| format!("{name}\n")).collect();
    let verb = if args.dry_run { "would be removed" } else { "removed" };
    text.push_str(&format!("{} {verb}\n", count(leftovers.len(), "leftover")));
    super::print(text.as_bytes())?;
    if args.dry_run {
        return Ok(ExitCode::Done);
    }
    match clean_dead(true)?.first() {
        Some(name) => {
            Err(Failure::stage_failed(format!("{name} cannot be removed; it may belong to another user")))
        }
        None => Ok(ExitCode::Done),
    }
}
