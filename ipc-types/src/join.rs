//! Parts that several processes wrote become one file: sorted by id, so the same bytes whoever wrote them.

use crate::Digest;
use crate::artefact::{RegionCertificate, RegionsFile};
use crate::container::{Artefact, CertifiedPart, Kind, Written};
use crate::store::{StoreError, read_bin, write_artefact, write_bin};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Folder of the parts of a stage.
pub fn parts_folder(stage_folder: &Path) -> PathBuf {
    stage_folder.join("parts")
}

/// Writes the part `<stage_folder>/parts/<id>.bin`.
pub fn write_part<A: Written>(
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

/// As [`CertificatesFile`](crate::artefact::CertificatesFile), of certificates that are elsewhere.
#[derive(Serialize)]
struct Certificates<'a> {
    regions: Vec<&'a RegionCertificate>,
}

impl Written for Certificates<'_> {
    const KIND: Kind = Kind::Certificates;
}

/// Writes `regions.bin`, `regions.json` and `certificates.bin`: what is certified in all parts, sorted by region id.
pub fn write_certified<'a>(
    stage_folder: &Path,
    coordinates: Vec<String>,
    parts: impl IntoIterator<Item = &'a CertifiedPart>,
    scene_digest: &Digest,
) -> Result<(), StoreError> {
    let (mut regions, mut certificates) = (Vec::new(), Vec::new());
    for part in parts {
        regions.extend(part.regions.iter().cloned());
        certificates.extend(&part.certificates);
    }
    regions.sort_by_key(|region| region.id);
    certificates.sort_by_key(|certificate| certificate.region_id);
    let regions = RegionsFile { coordinates, regions, coverage: None };
    write_artefact(stage_folder, "regions", &regions, scene_digest)?;
    write_bin(stage_folder, "certificates", &Certificates { regions: certificates }, scene_digest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefact::{CertificatesFile, Region};
    use crate::store::read_artefact;

    #[test]
    fn parts_become_files_in_the_order_of_ids() {
        let folder = tempfile::tempdir().unwrap();
        let region = |id: u64| Region {
            id,
            parent: None,
            A: vec![vec![1.0], vec![-1.0]],
            b: vec![1.0, id as f64],
            center: vec![0.0],
            method: "box".into(),
            certified: true,
            margin: 0.0,
        };
        let certificate =
            |region_id: u64| RegionCertificate { region_id, rows: Vec::new(), pairs: Vec::new() };
        let part = |candidate_id: u64, ids: &[u64]| CertifiedPart {
            candidate_id,
            regions: ids.iter().map(|&id| region(id)).collect(),
            certificates: ids.iter().map(|&id| certificate(id)).collect(),
            reason: String::new(),
        };
        let parts = [part(0, &[5, 7]), part(1, &[]), part(2, &[6])];
        write_certified(folder.path(), vec!["x".into()], &parts, &[1; 32]).unwrap();
        let regions: RegionsFile = read_artefact(folder.path(), "regions", Some(&[1; 32])).unwrap();
        assert_eq!(regions.regions, [5, 6, 7].map(region));
        assert_eq!(regions.coordinates, ["x"]);
        let certificates: CertificatesFile =
            read_artefact(folder.path(), "certificates", Some(&[1; 32])).unwrap();
        assert_eq!(certificates.regions, [5, 6, 7].map(certificate));
    }
}
