//! `regrasp stages`: the stages and the executables found for them.

use crate::cli::StagesArgs;
use crate::executable::{sibling, version_of};
use crate::failure::{ExitCode, Failure};
use crate::stage::purpose;
use ipc_types::stage_name::StageName;
use serde::Serialize;

/// A line of the list.
#[derive(Debug, Serialize)]
struct Entry {
    name: &'static str,
    purpose: &'static str,
    executable: Option<String>,
    version: Option<String>,
}

/// Lists the stages; exit code 4 if one has no executable.
pub fn list_stages(args: &StagesArgs) -> Result<ExitCode, Failure> {
    let mut entries: Vec<Entry> = StageName::ALL
        .into_iter()
        .map(|stage| entry(stage.word(), purpose(stage), stage.executable()))
        .collect();
    entries.push(entry("check", "independent verification of a run", "regrasp-check"));
    if args.json {
        super::print_json(&entries)?;
    } else {
        let mut text = String::new();
        for entry in &entries {
            text.push_str(&format!(
                "{:<10} {:<34} {:<8} {}\n",
                entry.name,
                entry.purpose,
                entry.version.as_deref().unwrap_or("–"),
                entry.executable.as_deref().unwrap_or("not found; build it with `cargo build --release`"),
            ));
        }
        super::print(text.as_bytes())?;
    }
    let complete = entries.iter().all(|entry| entry.executable.is_some());
    Ok(if complete { ExitCode::Done } else { ExitCode::Failed })
}

fn entry(name: &'static str, purpose: &'static str, executable: &str) -> Entry {
    let path = sibling(executable);
    Entry {
        name,
        purpose,
        version: path.as_ref().and_then(version_of),
        executable: path.map(|path| path.display().to_string()),
    }
}
