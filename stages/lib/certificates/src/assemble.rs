//! Puts the proofs of the pairs of a region together: its faces, and why every row used holds on it.

use crate::cell::CellBox;
use crate::pair_model::PairModel;
use crate::pair_search::PairProof;
use crate::row_program::RowProgram;
use crate::rows::{Multipliers, RowBound, Rows};
use convex_sets::HPolyhedron;
use ipc_types::artefact::{Cell, PairCertificate, PairProof as Proof, RowOrigin, SweptProof, SweptRow};
use nalgebra::{DMatrix, DVector};

/// A region's faces and its certificate.
#[derive(Debug, Clone)]
pub struct Assembled {
    /// The polytope.
    pub polyhedron: HPolyhedron,
    /// Rows that the cells use.
    pub rows: Vec<SweptRow>,
    /// The cells of each pair.
    pub pairs: Vec<PairCertificate>,
}

/// Cuts are moved inwards by this (units of the coordinates), so that one of two nearly equal ones can be proven
/// superfluous. Larger: fewer faces, less volume.
const CUT_SHIFT: f64 = 1e-9;
/// A row counts as implied if it is by this much, relative to its multipliers. Erring side: keeps faces.
const MARGIN_IMPLIED: f64 = 1e-13;

/// A proof of a pair among the rows that all pairs share.
#[derive(Debug, Clone)]
pub struct SharedProof {
    /// Rows below this are the shared ones; the proof's cuts follow.
    pub n_base: usize,
    /// Where the cuts stand among the shared rows.
    pub offset: usize,
    /// The proof.
    pub proof: PairProof,
}

impl SharedProof {
    fn global(&self, row: u32) -> usize {
        let row = row as usize;
        if row < self.n_base { row } else { row - self.n_base + self.offset }
    }
}

/// Joins the proofs, one for each of `models`, over `rows`: the first `n_base` are the region's as it came, then cuts.
pub fn assemble(
    rows: &Rows,
    n_base: usize,
    limits: &CellBox,
    models: &[PairModel],
    proofs: Vec<SharedProof>,
) -> Assembled {
    let mut is_used = vec![false; rows.len()];
    for proof in &proofs {
        for (row, _) in proof.proof.cells.iter().flat_map(multipliers) {
            is_used[proof.global(*row)] = true;
        }
    }
    let (faces, origins) = faces(rows, n_base, limits, &is_used);
    let mut position = vec![0_u32; rows.len()];
    let mut swept_rows = Vec::new();
    for row in (0..rows.len()).filter(|&row| is_used[row]) {
        position[row] = swept_rows.len() as u32;
        let origin = match &origins[row] {
            // An unmoved face.
            Some(Origin::Face(face_idx)) => RowOrigin::Face(*face_idx),
            Some(Origin::Implied(multipliers)) => RowOrigin::Implied(multipliers.clone()),
            None => RowOrigin::Implied(Vec::new()),
        };
        swept_rows.push(SweptRow { a: rows.a(row).to_vec(), b: rows.b[row], origin });
    }
    let pairs = proofs
        .into_iter()
        .zip(models)
        .map(|(mut proof, model)| {
            let mut cells = std::mem::take(&mut proof.proof.cells);
            for cell in &mut cells {
                for (row, _) in multipliers_mut(cell) {
                    *row = position[proof.global(*row)];
                }
            }
            PairCertificate {
                body_a: model.pair.body_a as u32,
                body_b: model.pair.body_b as u32,
                clearance: model.clearance,
                proof: Proof::Swept(SweptProof { frames: model.frame_choices(), cells }),
            }
        })
        .collect();
    let (m, n) = (faces.len(), limits.lower.len());
    let polyhedron = HPolyhedron {
        A: DMatrix::from_fn(m, n, |i, j| rows.a(faces[i].row)[j]),
        b: DVector::from_fn(m, |i, _| faces[i].b),
    };
    Assembled { polyhedron, rows: swept_rows, pairs }
}

/// A face of the final region: a row, perhaps moved inwards.
#[derive(Debug, Clone, Copy)]
struct Face {
    row: usize,
    b: f64,
}

#[derive(Debug, Clone)]
enum Origin {
    Face(u32),
    Implied(Multipliers),
}

/// The faces, without unused cuts and those that others imply, and for each row that is used why it holds on them.
fn faces(rows: &Rows, n_base: usize, limits: &CellBox, is_used: &[bool]) -> (Vec<Face>, Vec<Option<Origin>>) {
    let is_limit = |row: usize| {
        let mut entries = (0..limits.lower.len()).filter(|&j| rows.a(row)[j] != 0.0);
        let (Some(j), None) = (entries.next(), entries.next()) else { return false };
        let (a, b) = (rows.a(row)[j], rows.b[row]);
        if a > 0.0 { b == a * limits.upper[j] } else { b == a * limits.lower[j] }
    };
    // The faces to be: the region's, and the cuts that cells use, moved.
    let mut moved = rows.clone();
    moved.b.iter_mut().skip(n_base).for_each(|b| *b -= CUT_SHIFT);
    let mut faces: Vec<u32> =
        (0..rows.len()).filter(|&row| row < n_base || is_used[row]).map(|row| row as u32).collect();
    let mut program = RowProgram::default();
    let mut implied = |faces: &[u32], row: usize| {
        let minus_a: Vec<f64> = rows.a(row).iter().map(|a| -a).collect();
        let RowBound::Bound { value, multipliers } =
            moved.minimize_over(&mut program, faces, limits, &minus_a, f64::INFINITY)
        else {
            return None;
        };
        // −a·δ ≥ value, so a·q ≤ a·center − value.
        let at_center: f64 = rows.a(row).iter().enumerate().map(|(j, a)| a * limits.center(j)).sum();
        let size: f64 = multipliers.iter().map(|&(face, mu)| mu * (1.0 + moved.b[face as usize].abs())).sum();
        (at_center - value <= rows.b[row] - MARGIN_IMPLIED * (1.0 + size)).then_some(multipliers)
    };
    if rows.len() > n_base {
        // Joint limits stay; of the others the latest are tried first. What has to hold is the row, not the moved face.
        for position in (0..faces.len()).rev() {
            if is_limit(faces[position] as usize) {
                continue;
            }
            let face = faces.remove(position);
            if implied(&faces, face as usize).is_none() {
                faces.insert(position, face);
            }
        }
    }
    let mut faces_by_row: Vec<Face> =
        faces.iter().map(|&row| Face { row: row as usize, b: moved.b[row as usize] }).collect();
    let mut position = vec![None; rows.len()];
    for (face_idx, &row) in faces.iter().enumerate() {
        position[row as usize] = Some(face_idx as u32);
    }
    let mut origins: Vec<Option<Origin>> = vec![None; rows.len()];
    for row in (0..rows.len()).filter(|&row| is_used[row]) {
        origins[row] = match position[row] {
            Some(face_idx) if moved.b[row] == rows.b[row] => Some(Origin::Face(face_idx)),
            _ => implied(&faces, row).map(|multipliers| {
                let mut by_face: Multipliers = multipliers
                    .into_iter()
                    .filter_map(|(row, mu)| position[row as usize].map(|face_idx| (face_idx, mu)))
                    .collect();
                by_face.sort_unstable_by_key(|&(face_idx, _)| face_idx);
                Origin::Implied(by_face)
            }),
        };
        if origins[row].is_none() {
            // Dropped although it cannot be proven superfluous: it is a face after all.
            origins[row] = Some(Origin::Face(faces_by_row.len() as u32));
            faces_by_row.push(Face { row, b: rows.b[row] });
        }
    }
    (faces_by_row, origins)
}

/// The multipliers of a cell.
pub fn multipliers(cell: &Cell) -> &[(u32, f64)] {
    match cell {
        Cell::Split { .. } => &[],
        Cell::Empty { multipliers }
        | Cell::Separated { multipliers, .. }
        | Cell::Corners { multipliers, .. } => multipliers,
    }
}

/// The multipliers of a cell, to be renumbered.
pub fn multipliers_mut(cell: &mut Cell) -> &mut [(u32, f64)] {
    match cell {
        Cell::Split { .. } => &mut [],
        Cell::Empty { multipliers }
        | Cell::Separated { multipliers, .. }
        | Cell::Corners { multipliers, .. } => multipliers,
    }
}
