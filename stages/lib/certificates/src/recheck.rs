//! A second look at a certificate in plain `f64`, from the stored data alone.
//!
//! It shares the control nets with the search, so it is no independent verifier (that is `regrasp-check`, in interval
//! arithmetic); it finds certificates whose data do not say what the search meant.

use crate::cell::CellBox;
use crate::control_net::ControlNet;
use crate::control_net::MAX_HALF_ANGLE;
use crate::corner_leaf::CornerLeaf;
use crate::pair_model::PairModel;
use crate::reuse::row_holds;
use crate::rows::Rows;
use crate::sums::pair_sums::PairSums;
use crate::sums::recheck_sums::{SumsError, recheck_sums};
use convex_sets::HPolyhedron;
use ipc_types::artefact::{Cell, PairCertificate, PairProof, RegionCertificate, SweptProof};
use nalgebra::{DMatrix, DVector, Vector3};
use scene::Scene;

/// What is wrong with a certificate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum RecheckError {
    #[error("row {row_idx} does not hold on the region by the reason given")]
    Row { row_idx: usize },
    #[error("the pairs are not those of the scene")]
    Pairs,
    #[error("pair {pair_idx}, cell {cell_idx}: {problem}")]
    Cell { pair_idx: usize, cell_idx: usize, problem: &'static str },
    #[error("pair {pair_idx}, sum of squares: {problem}")]
    Sums { pair_idx: usize, problem: SumsError },
}

/// Looks at the certificate of `region`; returns the number of cells.
pub fn recheck(
    scene: &Scene,
    region: &HPolyhedron,
    certificate: &RegionCertificate,
) -> Result<usize, RecheckError> {
    let limits = CellBox {
        lower: scene.lower().iter().copied().collect(),
        upper: scene.upper().iter().copied().collect(),
    };
    let faces = Rows::new(region);
    for (row_idx, row) in certificate.rows.iter().enumerate() {
        if !row_holds(row, &faces, &limits) {
            return Err(RecheckError::Row { row_idx });
        }
    }
    let pairs = scene.collision_pairs();
    let named = |pair: &PairCertificate| (pair.body_a as usize, pair.body_b as usize);
    if !pairs.iter().map(|p| (p.body_a, p.body_b)).eq(certificate.pairs.iter().map(named)) {
        return Err(RecheckError::Pairs);
    }
    let n = scene.dim();
    let rows = Rows::new(&HPolyhedron {
        A: DMatrix::from_fn(certificate.rows.len(), n, |i, j| certificate.rows[i].a[j]),
        b: DVector::from_fn(certificate.rows.len(), |i, _| certificate.rows[i].b),
    });
    let mut n_cells = 0;
    let mut net = ControlNet::default();
    for (pair_idx, (pair, certificate)) in pairs.iter().zip(&certificate.pairs).enumerate() {
        match &certificate.proof {
            PairProof::Swept(proof) => {
                let model = PairModel::new(scene, *pair, certificate.clearance);
                pair_holds(&model, certificate.clearance, proof, &rows, &limits, &mut net)
                    .map_err(|(cell_idx, problem)| RecheckError::Cell { pair_idx, cell_idx, problem })?;
                n_cells += proof.cells.len();
            }
            PairProof::SumOfSquares(proof) => {
                recheck_sums(&PairSums::new(scene, *pair, certificate.clearance), proof, &rows, &limits)
                    .map_err(|problem| RecheckError::Sums { pair_idx, problem })?;
            }
        }
    }
    Ok(n_cells)
}

/// Whether multipliers may be used: they name rows that exist, and none is negative.
pub(crate) fn are_usable(multipliers: &[(u32, f64)], n_rows: usize) -> bool {
    multipliers.iter().all(|&(row, mu)| (row as usize) < n_rows && mu >= 0.0 && mu.is_finite())
}

/// Whether a pair's cells prove a gap above `demand`, metres, where `rows` hold; else the first cell that does not, and
/// why.
pub(crate) fn pair_holds(
    model: &PairModel,
    demand: f64,
    certificate: &SweptProof,
    rows: &Rows,
    limits: &CellBox,
    net: &mut ControlNet,
) -> Result<(), (usize, &'static str)> {
    if certificate.frames != model.frame_choices() {
        return Err((0, "the frames are not those of the pair"));
    }
    let mut open = vec![limits.clone()];
    for (cell_idx, cell) in certificate.cells.iter().enumerate() {
        let Some(at) = open.pop() else { return Err((cell_idx, "the tree goes on after its end")) };
        match cell {
            Cell::Split { coordinate, at: value } => {
                let j = usize::from(*coordinate);
                if !(j < at.lower.len() && at.lower[j] < *value && *value < at.upper[j]) {
                    return Err((cell_idx, "the split is not inside the cell"));
                }
                let (mut lower, mut upper) = (at.clone(), at);
                lower.upper[j] = *value;
                upper.lower[j] = *value;
                open.extend([upper, lower]);
            }
            Cell::Empty { multipliers } => {
                if !(are_usable(multipliers, rows.len()) && rows.excludes(&at, multipliers)) {
                    return Err((cell_idx, "the rows do not exclude the cell"));
                }
            }
            Cell::Separated { frame, normal, g, multipliers } => {
                let frame_idx = usize::from(*frame);
                if frame_idx >= model.frames.len() || !are_usable(multipliers, rows.len()) {
                    return Err((cell_idx, "it names a frame or a row that does not exist"));
                }
                let mut row = vec![0.0; at.lower.len()];
                for &(j, value) in g {
                    if !model.coordinates.contains(&usize::from(j)) {
                        return Err((cell_idx, "g has an entry on a coordinate that does not move the pair"));
                    }
                    row[usize::from(j)] = value;
                }
                let turns = model.coordinates.iter().zip(&model.is_angle).filter(|(_, is_angle)| **is_angle);
                if turns.map(|(&j, _)| at.half(j)).any(|half| half > MAX_HALF_ANGLE) {
                    return Err((cell_idx, "an angle of the cell is too wide"));
                }
                let n = Vector3::from(*normal);
                let kappa = model.kappa(net, frame_idx, &at, &n, &row).kappa;
                let gap = if g.is_empty() && multipliers.is_empty() {
                    kappa[0]
                } else {
                    kappa[1] + rows.bound(&at, &row, multipliers)
                };
                if !(gap > demand * n.norm()) {
                    return Err((cell_idx, "the plane does not separate the bodies"));
                }
            }
            Cell::Corners { frame, normal, near, multipliers } => {
                let leaf = CornerLeaf { frame: *frame, normal, near, multipliers };
                if !are_usable(multipliers, rows.len()) || !(leaf.gap(model, rows, &at) > demand) {
                    return Err((cell_idx, "a corner is not proven to stay beyond the plane"));
                }
            }
        }
    }
    if open.is_empty() { Ok(()) } else { Err((certificate.cells.len(), "the tree ends too early")) }
}
