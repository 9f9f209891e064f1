//! Where the executables of the project lie: next to this one.

use crate::failure::Failure;
use std::path::PathBuf;
use std::process::Command;

/// Path of an executable of the project, next to this one; `None` if it is not there.
pub fn sibling(name: &str) -> Option<PathBuf> {
    let folder = std::env::current_exe().ok()?.parent()?.to_owned();
    Some(folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))).filter(|path| path.is_file())
}

/// As [`sibling`], or a failure that says how to build it.
pub fn required(name: &str) -> Result<PathBuf, Failure> {
    sibling(name).ok_or_else(|| {
        Failure::bad_input(format!(
            "{name} is not next to {}; build it with `cargo build --release`",
            std::env::current_exe().map_or_else(|_| "regrasp".into(), |path| path.display().to_string())
        ))
    })
}

/// What a program answers to `--version`; `None` if it does not start or fails.
pub fn version_of(program: &PathBuf) -> Option<String> {
    let output = Command::new(program).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let version = text.split_whitespace().last()?.to_owned();
    output.status.success().then_some(version)
}
