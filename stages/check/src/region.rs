//! One certified region: its certificate covers every pair of bodies that may collide.

use crate::cells::{self, CellError};
use crate::interval::Interval;
use crate::sos::{self, SosError};
use crate::{pairs, parallel};
use ipc_types::artefact::{PairProof, Region, RegionCertificate, RowOrigin};
use scene::{Role, Scene};

/// Why a region is not proven free.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// A row of the certificate is not the face that it says it is.
    #[error("region {region_id}: row {row_idx} of its certificate is not face {face_idx} of the region")]
    Face {
        /// Region.
        region_id: u64,
        /// Row of the certificate.
        row_idx: usize,
        /// Face of the region.
        face_idx: usize,
    },
    /// A row of the certificate does not follow from the faces of the region.
    #[error(
        "region {region_id}: row {row_idx} of its certificate is not implied by the faces (exceeds by {excess:e})"
    )]
    NotImplied {
        /// Region.
        region_id: u64,
        /// Row of the certificate.
        row_idx: usize,
        /// Upper bound of what may be exceeded.
        excess: f64,
    },
    /// The list of pairs is not the scene's.
    #[error(
        "region {region_id}: its certificate does not cover exactly the pairs of the scene: {name_a} – {name_b} is {problem}"
    )]
    Pairs {
        /// Region.
        region_id: u64,
        /// Body A.
        name_a: String,
        /// Body B.
        name_b: String,
        /// `missing`, `not a pair of the scene`, or `out of order`.
        problem: &'static str,
    },
    /// Less clearance is proven than was asked for.
    #[error(
        "region {region_id}: {name_a} – {name_b} is certified for a clearance of {found} m, asked for are {asked} m"
    )]
    Clearance {
        /// Region.
        region_id: u64,
        /// Body A.
        name_a: String,
        /// Body B.
        name_b: String,
        /// In the certificate.
        found: f64,
        /// Asked for.
        asked: f64,
    },
    /// The cells of a pair prove nothing.
    #[error("region {region_id}: {name_a} – {name_b}: {source}")]
    Cells {
        /// Region.
        region_id: u64,
        /// Body A.
        name_a: String,
        /// Body B.
        name_b: String,
        /// Cause.
        source: CellError,
    },
    /// The sums of squares of a pair prove nothing.
    #[error("region {region_id}: {name_a} – {name_b}: {source}")]
    SumOfSquares {
        /// Region.
        region_id: u64,
        /// Body A.
        name_a: String,
        /// Body B.
        name_b: String,
        /// Cause.
        source: SosError,
    },
    /// The region's own data are malformed.
    #[error("region {region_id}: {problem}")]
    Malformed {
        /// Region.
        region_id: u64,
        /// What is wrong.
        problem: &'static str,
    },
}

/// Clearance asked of a pair: the task's, but 0 between a robot link and an object link, which may touch.
pub fn asked_clearance(scene: &Scene, body_a: usize, body_b: usize, clearance: f64) -> f64 {
    let role = |body: usize| scene.links[scene.bodies[body].link_idx].role;
    match (role(body_a), role(body_b)) {
        (Role::Robot, Role::Object) | (Role::Object, Role::Robot) => 0.0,
        _ => clearance,
    }
}

/// How much a certificate took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Cells of swept hulls.
    pub cells: usize,
    /// Points proven by sums of squares.
    pub sos_points: usize,
}

/// Verifies one region against its certificate.
pub fn verify(
    scene: &Scene,
    region: &Region,
    certificate: &RegionCertificate,
    clearance: f64,
) -> Result<Counts, RegionError> {
    let region_id = region.id;
    let malformed = |problem| RegionError::Malformed { region_id, problem };
    let n = scene.dim();
    let finite = |row: &[f64]| row.len() == n && row.iter().all(|x| x.is_finite());
    if region.A.len() != region.b.len() || !region.A.iter().all(|row| finite(row)) {
        return Err(malformed("its rows are not finite numbers, one a coordinate"));
    }
    if !region.b.iter().all(|b| b.is_finite()) || !finite(&region.center) {
        return Err(malformed("its offsets or its centre are not finite numbers"));
    }
    let lower: Vec<f64> = scene.coordinates.iter().map(|c| c.lower).collect();
    let upper: Vec<f64> = scene.coordinates.iter().map(|c| c.upper).collect();
    verify_rows(region, certificate, &lower, &upper)?;
    let names = |a: usize, b: usize| (scene.bodies[a].name.clone(), scene.bodies[b].name.clone());
    let required = pairs::required_pairs(scene);
    let mut found = certificate.pairs.iter();
    let mut proofs = Vec::with_capacity(required.len());
    for &(a, b) in &required {
        let (name_a, name_b) = names(a, b);
        let pair = found.next().filter(|pair| (pair.body_a as usize, pair.body_b as usize) == (a, b));
        let Some(pair) = pair else {
            let listed = certificate.pairs.iter().any(|p| (p.body_a as usize, p.body_b as usize) == (a, b));
            let problem = if listed { "out of order" } else { "missing" };
            return Err(RegionError::Pairs { region_id, name_a, name_b, problem });
        };
        let asked = asked_clearance(scene, a, b, clearance);
        if !(pair.clearance >= asked) {
            return Err(RegionError::Clearance { region_id, name_a, name_b, found: pair.clearance, asked });
        }
        proofs.push(pair);
    }
    if let Some(extra) = found.next() {
        let name = |body: u32| {
            scene.bodies.get(body as usize).map_or_else(|| format!("body {body}"), |body| body.name.clone())
        };
        return Err(RegionError::Pairs {
            region_id,
            name_a: name(extra.body_a),
            name_b: name(extra.body_b),
            problem: "not a pair of the scene",
        });
    }
    let weight = |idx: usize| match &proofs[idx].proof {
        PairProof::Swept(proof) => proof.cells.len(),
        // A programme takes about as long as this many cells.
        PairProof::SumOfSquares(_) => 1000,
    };
    let verify = |idx: usize| {
        let (pair, rows) = (proofs[idx], &certificate.rows);
        let (name_a, name_b) = names(pair.body_a as usize, pair.body_b as usize);
        match &pair.proof {
            PairProof::Swept(proof) => cells::verify(scene, pair, proof, rows, &lower, &upper)
                .map(|cells| Counts { cells, sos_points: 0 })
                .map_err(|source| RegionError::Cells { region_id, name_a, name_b, source }),
            PairProof::SumOfSquares(proof) => sos::verify(scene, pair, proof, rows, &lower, &upper)
                .map(|sos_points| Counts { cells: 0, sos_points })
                .map_err(|source| RegionError::SumOfSquares { region_id, name_a, name_b, source }),
        }
    };
    let mut counts = Counts::default();
    // The first failure in the order of the pairs is told, whichever thread found its own first.
    for of_pair in parallel::in_order(proofs.len(), weight, verify) {
        let of_pair = of_pair?;
        counts.cells += of_pair.cells;
        counts.sos_points += of_pair.sos_points;
    }
    Ok(counts)
}

/// Every row of the certificate holds on the region (with the joint limits).
fn verify_rows(
    region: &Region,
    certificate: &RegionCertificate,
    lower: &[f64],
    upper: &[f64],
) -> Result<(), RegionError> {
    let region_id = region.id;
    for (row_idx, row) in certificate.rows.iter().enumerate() {
        match &row.origin {
            RowOrigin::Face(face_idx) => {
                let face_idx = *face_idx as usize;
                let same = region.A.get(face_idx).is_some_and(|a| *a == row.a)
                    && region.b.get(face_idx).is_some_and(|&b| b == row.b);
                if !same {
                    return Err(RegionError::Face { region_id, row_idx, face_idx });
                }
            }
            RowOrigin::Implied(multipliers) => {
                // a·q − b − Σ μ (A q − b) ≤ 0 on the joint box.
                let excess = implied_excess(region, &row.a, row.b, multipliers, lower, upper);
                if !(excess <= 0.0) {
                    return Err(RegionError::NotImplied { region_id, row_idx, excess });
                }
            }
        }
    }
    Ok(())
}

fn implied_excess(
    region: &Region,
    a: &[f64],
    b: f64,
    multipliers: &[(u32, f64)],
    lower: &[f64],
    upper: &[f64],
) -> f64 {
    if a.len() != lower.len() {
        return f64::INFINITY;
    }
    let mut slope: Vec<Interval> = a.iter().map(|&a| Interval::point(a)).collect();
    let mut sum = -Interval::point(b);
    for &(face_idx, mu) in multipliers {
        let Some(face) = region.A.get(face_idx as usize) else { return f64::INFINITY };
        if !(mu >= 0.0 && mu.is_finite()) {
            return f64::INFINITY;
        }
        let mu = Interval::point(mu);
        for (slope, &a) in slope.iter_mut().zip(face) {
            *slope = *slope - mu * Interval::point(a);
        }
        sum = sum + mu * Interval::point(region.b[face_idx as usize]);
    }
    for j in 0..slope.len() {
        sum = sum + slope[j] * Interval::hull(lower[j], upper[j]);
    }
    let excess = sum.hi();
    if excess.is_nan() { f64::INFINITY } else { excess }
}
