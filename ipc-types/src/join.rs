//! Parts that several processes wrote become one file: sorted by id, so the same bytes whoever wrote them.

use crate::Digest;
use crate::artefact::{CertificatesFile, RegionsFile};
use crate::container::{Artefact, CertifiedPart};
use crate::store::{StoreError, read_bin, write_artefact, write_bin};
use std::path::{Path, PathBuf};

/// Folder of the parts of a stage.
pub fn parts_folder(stage_folder: &Path) -> PathBuf {
    stage_folder.join("parts")
}

/// Writes the part `<stage_folder>/parts/<id>.bin`.
pub fn write_part<A: Artefact>(
    stage_folder: &Path,
    id: u64,
    part: &A,
    scene_digest: &Digest,
) -> Result<(), StoreError> {
    write_bin(&parts_folder(stage_folder), &id.to_string(), part, scene_digest)
}

/// Reads the part `<stage_folder>/parts/<id>.bin`.
pub fn read_part<A: Artefact>(
    stage_folder: &Path,
    id: u64,
    scene_digest: Option<&Digest>,
) -> Result<A, StoreError> {
    read_bin(&parts_folder(stage_folder).join(format!("{id}.bin")), scene_digest)
}

/// The certified regions and the certificates of all parts, sorted by region id.
pub fn join_certified(
    coordinates: Vec<String>,
    parts: impl IntoIterator<Item = CertifiedPart>,
) -> (RegionsFile, CertificatesFile) {
    let (mut regions, mut certificates) = (Vec::new(), Vec::new());
    for part in parts {
        regions.extend(part.regions);
        certificates.extend(part.certificates);
    }
    regions.sort_by_key(|region| region.id);
    certificates.sort_by_key(|certificate| certificate.region_id);
    (RegionsFile { coordinates, regions, coverage: None }, CertificatesFile { regions: certificates })
}

/// Writes `regions.bin`, `regions.json` and `certificates.bin`.
pub fn write_certified(
    stage_folder: &Path,
    regions: &RegionsFile,
    certificates: &CertificatesFile,
    scene_digest: &Digest,
) -> Result<(), StoreError> {
    write_artefact(stage_folder, "regions", regions, scene_digest)?;
    write_bin(stage_folder, "certificates", certificates, scene_digest)
}
