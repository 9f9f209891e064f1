//! Certificates of an earlier run, used where they still hold.
//!
//! A certificate is never carried over: each pair's tree of cells is evaluated against the scene and the region at
//! hand, as strictly as the search evaluates its own, and only what holds takes the place of a search. A candidate may
//! have more faces than the region that the certificate was made for, as long as it begins with that region's.

use crate::cell::CellBox;
use crate::control_net::ControlNet;
use crate::pair_model::PairModel;
use crate::pair_search::PairProof;
use crate::recheck::{are_usable, pair_holds};
use crate::rows::Rows;
use convex_sets::HPolyhedron;
use ipc_types::artefact::{self, Cell, CertificatesFile, RegionCertificate, RegionsFile, RowOrigin};
use ipc_types::store::{StoreError, find_artefact};
use ipc_types::validate;
use std::collections::BTreeMap;
use std::path::Path;

/// Regions of an earlier run with their certificates.
#[derive(Debug, Clone, Default)]
pub struct EarlierCertificates {
    regions: Vec<(artefact::Region, RegionCertificate)>,
}

impl EarlierCertificates {
    /// Regions, each with its certificate.
    pub fn new(regions: Vec<(artefact::Region, RegionCertificate)>) -> Self {
        Self { regions }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.regions.is_empty()
    }

    /// `certify/regions` and `certify/certificates` of the run in `folder`, whose scene may have been another one with
    /// the same `coordinates`. Errors say which file, what is wrong, and what to do.
    pub fn of_run(folder: &Path, coordinates: &[String]) -> Result<Self, String> {
        let said = |error: StoreError| format!("--reuse: {error}");
        let folder = folder.join("certify");
        let missing = |name: &str| {
            format!(
                "--reuse: {} is not there; give a run whose regions are certified",
                folder.join(name).display()
            )
        };
        let regions = find_artefact::<RegionsFile>(&folder, "regions", None).map_err(said)?;
        let regions = regions.ok_or_else(|| missing("regions"))?;
        let certificates = find_artefact::<CertificatesFile>(&folder, "certificates", None).map_err(said)?;
        let certificates = certificates.ok_or_else(|| missing("certificates"))?;
        validate::regions(&regions, coordinates).map_err(|rule| {
            format!(
                "--reuse: {}: {rule}; give a run of a scene with these coordinates",
                folder.join("regions").display()
            )
        })?;
        let mut by_id: BTreeMap<u64, RegionCertificate> = certificates
            .regions
            .into_iter()
            .map(|certificate| (certificate.region_id, certificate))
            .collect();
        let regions = regions.regions.into_iter().filter_map(|region| {
            let certificate = by_id.remove(&region.id)?;
            Some((region, certificate))
        });
        Ok(Self { regions: regions.collect() })
    }

    /// The certificate of the earlier region with which `candidate` begins, bit for bit; of several the one with most
    /// faces.
    pub fn of_candidate(&self, candidate: &HPolyhedron) -> Option<&RegionCertificate> {
        let begins = |region: &artefact::Region| {
            region.A.len() <= candidate.n_faces()
                && region.A.iter().zip(&region.b).enumerate().all(|(face_idx, (a, b))| {
                    candidate.A.row(face_idx).iter().eq(a.iter()) && candidate.b[face_idx] == *b
                })
        };
        let matching = self.regions.iter().filter(|(region, _)| begins(region));
        matching.max_by_key(|(region, _)| region.A.len()).map(|(_, certificate)| certificate)
    }
}

/// The rows of an earlier certificate, as far as they hold on a region.
pub struct EarlierRows {
    /// All rows; the cells' multipliers index them.
    rows: Rows,
    /// The face of the region that a row is.
    faces: Vec<Option<u32>>,
    /// Whether it holds.
    holds: Vec<bool>,
}

impl EarlierRows {
    /// `faces`: those of the region at hand.
    pub fn new(certificate: &RegionCertificate, faces: &Rows, limits: &CellBox) -> Self {
        let n = limits.lower.len();
        let zero = vec![0.0; n];
        let mut rows = Rows::empty(n);
        let mut found = Self { rows: Rows::empty(n), faces: Vec::new(), holds: Vec::new() };
        for row in &certificate.rows {
            let is_row = row.a.len() == n && row.b.is_finite() && row.a.iter().all(|a| a.is_finite());
            let face = match row.origin {
                RowOrigin::Face(face) => Some(face),
                RowOrigin::Implied(_) => None,
            };
            found.holds.push(is_row && row_holds(row, faces, limits));
            found.faces.push(face);
            rows.push(if row.a.len() == n { &row.a } else { &zero }, row.b, None);
        }
        found.rows = rows;
        found
    }
}

/// Whether a row of a certificate holds on the region with these faces, by the reason that it gives.
pub fn row_holds(row: &artefact::SweptRow, faces: &Rows, limits: &CellBox) -> bool {
    match &row.origin {
        RowOrigin::Face(face) => {
            let face = *face as usize;
            face < faces.len() && faces.a(face) == row.a && faces.b[face] == row.b
        }
        RowOrigin::Implied(multipliers) => {
            let minus_a: Vec<f64> = row.a.iter().map(|a| -a).collect();
            let center: f64 = row.a.iter().enumerate().map(|(j, a)| a * limits.center(j)).sum();
            are_usable(multipliers, faces.len())
                && center - faces.bound(limits, &minus_a, multipliers) <= row.b
        }
    }
}

/// The earlier proof of the pair of `model`, if it holds on the region with `n_faces` faces; its multipliers index
/// those faces, then its own rows, which the faces imply.
pub fn reused(
    model: &PairModel,
    certificate: &RegionCertificate,
    earlier: &EarlierRows,
    n_faces: usize,
    limits: &CellBox,
    net: &mut ControlNet,
) -> Option<PairProof> {
    let is_pair = |pair: &&artefact::PairCertificate| {
        (pair.body_a as usize, pair.body_b as usize) == (model.pair.body_a, model.pair.body_b)
    };
    let artefact::PairProof::Swept(proof) = &certificate.pairs.iter().find(is_pair)?.proof else {
        return None;
    };
    let uses = |cell: &Cell| {
        crate::assemble::multipliers(cell).iter().map(|(row, _)| *row as usize).collect::<Vec<_>>()
    };
    let used: Vec<usize> = proof.cells.iter().flat_map(uses).collect();
    if !used.iter().all(|&row| earlier.holds.get(row) == Some(&true)) {
        return None;
    }
    pair_holds(model, model.demand(), proof, &earlier.rows, limits, net).ok()?;
    let mut position: BTreeMap<usize, u32> = BTreeMap::new();
    let mut implied = Vec::new();
    for row in used {
        position.entry(row).or_insert_with(|| {
            earlier.faces[row].unwrap_or_else(|| {
                implied.push((earlier.rows.a(row).to_vec(), earlier.rows.b[row]));
                (n_faces + implied.len() - 1) as u32
            })
        });
    }
    let mut cells = proof.cells.clone();
    for cell in &mut cells {
        for (row, _) in crate::assemble::multipliers_mut(cell) {
            *row = position[&(*row as usize)];
        }
    }
    Some(PairProof { cells, cuts: implied, n_tried: 0, is_reused: true })
}
