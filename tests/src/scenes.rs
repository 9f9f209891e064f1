//! Scenes for tests: those of the project, and damaged copies of them.

use std::path::{Path, PathBuf};

/// A scene of the project.
pub fn scene(name: &str) -> PathBuf {
    crate::programs::project().join("scenes").join(name)
}

/// A copy of a scene of the project in `folder`, in which `change` may replace text of a file.
///
/// # Panics
/// If the scene cannot be copied, or the text to replace is not there: the test would test nothing.
#[track_caller]
pub fn changed(name: &str, folder: &Path, change: &Change<'_>) -> PathBuf {
    let copy = folder.join(name);
    std::fs::create_dir_all(&copy).expect("a folder for the copy");
    for entry in std::fs::read_dir(scene(name)).expect("a scene of the project") {
        let path = entry.expect("an entry of the scene").path();
        let file_name = path.file_name().expect("a file has a name").to_owned();
        let mut text = std::fs::read_to_string(&path).expect("a scene is text");
        if file_name.to_str() == Some(change.file) {
            assert!(text.contains(change.from), "{}: no `{}` there", change.file, change.from);
            text = text.replacen(change.from, change.to, 1);
        }
        std::fs::write(copy.join(file_name), text).expect("the copy is written");
    }
    copy
}

/// A change of a scene: the first `from` in `file` becomes `to`.
#[derive(Debug, Clone, Copy)]
pub struct Change<'a> {
    /// File of the scene.
    pub file: &'a str,
    /// Text that is there.
    pub from: &'a str,
    /// Text in its place.
    pub to: &'a str,
}
