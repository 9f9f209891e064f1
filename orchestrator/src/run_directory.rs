//! The run directory: where a run keeps everything that anyone may need later.

use crate::failure::Failure;
use ipc_types::stage_name::StageName;
use std::path::{Path, PathBuf};

/// A run directory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunDirectory {
    path: PathBuf,
}

impl RunDirectory {
    /// Creates the directory that `--out` names. It must not exist yet.
    pub fn create_at(path: &Path) -> Result<RunDirectory, Failure> {
        if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent).map_err(|cause| {
                Failure::bad_input(format!(
                    "--out {}: cannot create {}: {cause}",
                    path.display(),
                    parent.display()
                ))
            })?;
        }
        match std::fs::create_dir(path) {
            Ok(()) => Ok(RunDirectory { path: path.to_owned() }),
            Err(cause) if cause.kind() == std::io::ErrorKind::AlreadyExists => Err(Failure::bad_input(
                format!("--out {}: exists already; name a new directory, or remove it first", path.display()),
            )),
            Err(cause) => Err(Failure::bad_input(format!(
                "--out {}: {cause}; name a directory that can be made",
                path.display()
            ))),
        }
    }

    /// Creates the next free `runs/<scene>/<nnnn>` below the current directory.
    pub fn create_next(scene: &Path) -> Result<RunDirectory, Failure> {
        RunDirectory::create_next_in(&Path::new("runs").join(scene_name(scene)?))
    }

    fn create_next_in(folder: &Path) -> Result<RunDirectory, Failure> {
        std::fs::create_dir_all(folder).map_err(|cause| Failure::file("create", folder, cause))?;
        let entries = std::fs::read_dir(folder).map_err(|cause| Failure::file("read", folder, cause))?;
        let numbers = entries.flatten().filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
        let mut number = numbers.max().unwrap_or(0);
        // Another run may take the same number between our look and our creation: then the next one is tried.
        loop {
            number = number
                .checked_add(1)
                .ok_or_else(|| Failure::file("number a run in", folder, "the numbers are used up"))?;
            let path = folder.join(format!("{number:04}"));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(RunDirectory { path }),
                Err(cause) if cause.kind() == std::io::ErrorKind::AlreadyExists => continue,
                Err(cause) => return Err(Failure::file("create", &path, cause)),
            }
        }
    }

    /// An existing run.
    pub fn open(path: &Path) -> Result<RunDirectory, Failure> {
        if !path.join("run.json").is_file() {
            return Err(Failure::bad_input(format!(
                "{}: no run.json there; expected a run directory, such as runs/bottle-cap-3dof/0001",
                path.display()
            )));
        }
        Ok(RunDirectory { path: path.to_owned() })
    }

    /// The directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Folder of a stage.
    pub fn stage(&self, stage: StageName) -> PathBuf {
        self.path.join(stage.word())
    }

    /// Copies of the files of the scene that the stages really read.
    pub fn scene(&self) -> PathBuf {
        self.path.join("scene")
    }

    /// The report.
    pub fn report(&self) -> PathBuf {
        self.path.join("report.html")
    }

    /// Removes the directory with all it holds; for a run that never began because its input was bad.
    pub fn remove(self) {
        // What cannot be removed stays; the input's error is what the user needs to read.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// Name of the folder that a scene lies in: of `scenes/x/scene.toml` and `scenes/x` it is `x`.
pub fn scene_name(scene: &Path) -> Result<String, Failure> {
    let real = scene.canonicalize().map_err(|cause| {
        Failure::bad_input(format!(
            "{}: {cause}; expected a scene folder or its scene.toml, such as scenes/bottle-cap-3dof",
            scene.display()
        ))
    })?;
    let folder = if real.is_file() { real.parent().unwrap_or(&real) } else { &real };
    Ok(folder.file_name().map_or_else(|| "scene".into(), |name| name.to_string_lossy().into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn out_must_not_exist() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a/b");
        RunDirectory::create_at(&path).unwrap();
        let failure = RunDirectory::create_at(&path).unwrap_err();
        assert_eq!(failure.exit_code.code(), 2);
        assert!(failure.message.contains("exists already"));
    }

    #[test]
    fn runs_are_numbered_on() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("0041")).unwrap();
        std::fs::create_dir(folder.path().join("notes")).unwrap();
        let run = RunDirectory::create_next_in(folder.path()).unwrap();
        assert!(run.path().ends_with("0042"));
        assert!(RunDirectory::create_next_in(folder.path()).unwrap().path().ends_with("0043"));
    }

    #[test]
    fn a_scene_is_named_by_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("cap");
        std::fs::create_dir(&scene).unwrap();
        std::fs::write(scene.join("scene.toml"), "").unwrap();
        assert_eq!(scene_name(&scene).unwrap(), "cap");
        assert_eq!(scene_name(&scene.join("scene.toml")).unwrap(), "cap");
        assert_eq!(scene_name(&folder.path().join("none")).unwrap_err().exit_code.code(), 2);
    }
}
