//! Artefacts in a folder: written at once, read from `.bin`, else from the `.json` twin.

use crate::Digest;
use crate::container::{self, Artefact, ContainerError, Written};
use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// An artefact that could not be read or written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum StoreError {
    #[error("{folder}: neither {name}.bin nor {name}.json is there; run the stage that writes it first")]
    NotThere { folder: PathBuf, name: String },
    #[error("{file}: cannot be read: {source}")]
    Read { file: PathBuf, source: std::io::Error },
    #[error("{file}: cannot be written: {source}; check the disk's space and permissions")]
    Write { file: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Container(#[from] ContainerError),
    #[error("{file}: not the JSON that is expected: {source}; correct the file")]
    Json { file: PathBuf, source: serde_json::Error },
}

/// Writes `bytes` under another name and renames it, so that a reader never sees half a file. The folder is created.
pub fn write_at_once(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let failed = |source| StoreError::Write { file: path.to_owned(), source };
    let mut hidden = path.as_os_str().to_owned();
    // Two processes that write the same name must not share the temporary one.
    hidden.push(format!(".{}.tmp", std::process::id()));
    let write = || std::fs::write(&hidden, bytes).and_then(|()| std::fs::rename(&hidden, path));
    match write() {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(failed)?;
            }
            write().map_err(failed)
        }
        other => other.map_err(|error| {
            // A half-written temporary file must not stay; the first error is the one to report.
            let _ = std::fs::remove_file(&hidden);
            failed(error)
        }),
    }
}

/// Writes `<folder>/<name>.bin`.
pub fn write_bin<A: Written>(
    folder: &Path,
    name: &str,
    value: &A,
    scene_digest: &Digest,
) -> Result<(), StoreError> {
    let file = folder.join(format!("{name}.bin"));
    write_at_once(&file, &container::encode(&file, value, scene_digest)?)
}

/// Writes `<folder>/<name>.json`.
pub fn write_json<T: Serialize>(folder: &Path, name: &str, value: &T) -> Result<(), StoreError> {
    let file = folder.join(format!("{name}.json"));
    let text =
        crate::json::to_text(value).map_err(|source| StoreError::Json { file: file.clone(), source })?;
    write_at_once(&file, &text)
}

/// Writes both `<folder>/<name>.bin` and its text twin.
pub fn write_artefact<A: Written>(
    folder: &Path,
    name: &str,
    value: &A,
    scene_digest: &Digest,
) -> Result<(), StoreError> {
    write_bin(folder, name, value, scene_digest)?;
    write_json(folder, name, value)
}

/// Reads one `.bin`. With `scene_digest`, one made for another scene is refused.
pub fn read_bin<A: Artefact>(file: &Path, scene_digest: Option<&Digest>) -> Result<A, StoreError> {
    let bytes = std::fs::read(file).map_err(|source| StoreError::Read { file: file.to_owned(), source })?;
    Ok(container::decode(file, &bytes, scene_digest)?)
}

/// Reads one `.json`.
pub fn read_json<T: DeserializeOwned>(file: &Path) -> Result<T, StoreError> {
    let bytes = std::fs::read(file).map_err(|source| StoreError::Read { file: file.to_owned(), source })?;
    serde_json::from_slice(&bytes).map_err(|source| StoreError::Json { file: file.to_owned(), source })
}

/// Reads `<folder>/<name>.bin`, or `<folder>/<name>.json` if only that is there.
pub fn read_artefact<A: Artefact>(
    folder: &Path,
    name: &str,
    scene_digest: Option<&Digest>,
) -> Result<A, StoreError> {
    find_artefact(folder, name, scene_digest)?
        .ok_or_else(|| StoreError::NotThere { folder: folder.to_owned(), name: name.to_owned() })
}

/// As [`read_artefact`]; `None` if neither form is there.
pub fn find_artefact<A: Artefact>(
    folder: &Path,
    name: &str,
    scene_digest: Option<&Digest>,
) -> Result<Option<A>, StoreError> {
    let bin = folder.join(format!("{name}.bin"));
    let json = folder.join(format!("{name}.json"));
    if bin.exists() {
        read_bin(&bin, scene_digest).map(Some)
    } else if json.exists() {
        read_json(&json).map(Some)
    } else {
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefact::{CutsFile, LeafCut, Mode};

    fn cuts() -> CutsFile {
        CutsFile { cuts: vec![LeafCut { mode: Mode::Transit, reached: vec![1], exits: vec![(1, 5)] }] }
    }

    #[test]
    fn either_form_is_read_and_the_binary_one_first() {
        let folder = tempfile::tempdir().unwrap();
        let read = || read_artefact::<CutsFile>(folder.path(), "cuts", Some(&[1; 32]));
        assert!(matches!(read(), Err(StoreError::NotThere { .. })));
        write_artefact(folder.path(), "cuts", &cuts(), &[1; 32]).unwrap();
        std::fs::write(folder.path().join("cuts.json"), "{\"cuts\": []}").unwrap();
        assert_eq!(read().unwrap(), cuts());
        std::fs::remove_file(folder.path().join("cuts.bin")).unwrap();
        assert_eq!(read().unwrap().cuts, []);
        std::fs::write(folder.path().join("cuts.json"), "{\"cuts\": 3}").unwrap();
        assert!(read().unwrap_err().to_string().contains("cuts.json"));
    }

    #[test]
    fn a_damaged_binary_is_not_passed_over_for_its_twin() {
        let folder = tempfile::tempdir().unwrap();
        write_artefact(folder.path(), "cuts", &cuts(), &[1; 32]).unwrap();
        std::fs::write(folder.path().join("cuts.bin"), "x").unwrap();
        assert!(matches!(
            find_artefact::<CutsFile>(folder.path(), "cuts", None),
            Err(StoreError::Container(_))
        ));
    }

    #[test]
    fn writing_makes_the_folder_and_leaves_no_other_file() {
        let folder = tempfile::tempdir().unwrap();
        write_json(&folder.path().join("a/b"), "cuts", &cuts()).unwrap();
        assert_eq!(std::fs::read_dir(folder.path().join("a/b")).unwrap().count(), 1);
    }
}
