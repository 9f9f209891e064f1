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

/// Joins the proofs, one for each of `models`, over the region with the rows `base`.
pub fn assemble(base: &Rows, limits: &CellBox, models: &[PairModel], proofs: Vec<PairProof>) -> Assembled {
    // Global rows: those of the region, then each pair's cuts.
    let mut rows = base.clone();
    let mut offsets = Vec::with_capacity(proofs.len());
    for proof in &proofs {
        offsets.push(rows.len() - base.len());
        for (a, b) in &proof.cuts {
            rows.push(a.clone(), *b, None);
        }
    }
    let n_base = base.len();
    let global = |pair_idx: usize, row: u32| {
        if (row as usize) < n_base { row as usize } else { row as usize + offsets[pair_idx] }
    };
    let mut is_used = vec![false; rows.len()];
    for (pair_idx, proof) in proofs.iter().enumerate() {
        for (row, _) in proof.cells.iter().flat_map(multipliers) {
            is_used[global(pair_idx, *row)] = true;
        }
    }
    let (faces, origins) = faces(&rows, n_base, limits, &is_used);
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
        swept_rows.push(SweptRow { a: rows.a[row].clone(), b: rows.b[row], origin });
    }
    let pairs = proofs
        .into_iter()
        .zip(models)
        .enumerate()
        .map(|(pair_idx, (proof, model))| {
            let mut cells = proof.cells;
            for cell in &mut cells {
                for (row, _) in multipliers_mut(cell) {
                    *row = position[global(pair_idx, *row)];
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
        A: DMatrix::from_fn(m, n, |i, j| rows.a[faces[i].row][j]),
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

/// The faces, without those that others imply, and for each row that is used why it holds on them.
fn faces(rows: &Rows, n_base: usize, limits: &CellBox, is_used: &[bool]) -> (Vec<Face>, Vec<Option<Origin>>) {
    let is_limit = |row: usize| {
        let mut entries = (0..limits.lower.len()).filter(|&j| rows.a[row][j] != 0.0);
        let (Some(j), None) = (entries.next(), entries.next()) else { return false };
        let (a, b) = (rows.a[row][j], rows.b[row]);
        if a > 0.0 { b == a * limits.upper[j] } else { b == a * limits.lower[j] }
    };
    let mut faces: Vec<Face> = (0..rows.len())
        .map(|row| Face { row, b: if row < n_base { rows.b[row] } else { rows.b[row] - CUT_SHIFT } })
        .collect();
    if rows.len() > n_base {
        // Joint limits stay; of the others the latest are tried first. What has to hold is the row, not the moved face.
        let mut at = faces.len();
        while at > 0 {
            at -= 1;
            if is_limit(faces[at].row) {
                continue;
            }
            let face = faces.remove(at);
            if implied(rows, &faces, limits, &rows.a[face.row], rows.b[face.row]).is_none() {
                faces.insert(at, face);
            }
        }
    }
    let mut origins: Vec<Option<Origin>> = vec![None; rows.len()];
    for row in (0..rows.len()).filter(|&row| is_used[row]) {
        let unmoved = faces.iter().position(|face| face.row == row && face.b == rows.b[row]);
        origins[row] = match unmoved {
            Some(face_idx) => Some(Origin::Face(face_idx as u32)),
            None => implied(rows, &faces, limits, &rows.a[row], rows.b[row]).map(Origin::Implied),
        };
        if origins[row].is_none() {
            // Dropped although it cannot be proven superfluous: it is a face after all.
            origins[row] = Some(Origin::Face(faces.len() as u32));
            faces.push(Face { row, b: rows.b[row] });
        }
    }
    (faces, origins)
}

/// Multipliers (face, μ) by which a·q ≤ b follows from the faces on the box of joint limits, with a margin.
fn implied(rows: &Rows, faces: &[Face], limits: &CellBox, a: &[f64], b: f64) -> Option<Multipliers> {
    let (m, n) = (faces.len(), a.len());
    let polyhedron = HPolyhedron {
        A: DMatrix::from_fn(m, n, |i, j| rows.a[faces[i].row][j]),
        b: DVector::from_fn(m, |i, _| faces[i].b),
    };
    let faces = Rows::new(&polyhedron);
    let minus_a: Vec<f64> = a.iter().map(|a| -a).collect();
    let RowBound::Bound { value, multipliers } =
        faces.minimize(&mut RowProgram::default(), limits, &minus_a, f64::INFINITY)
    else {
        return None;
    };
    // −a·δ ≥ value, so a·q ≤ a·center − value.
    let at_center: f64 = a.iter().enumerate().map(|(j, a)| a * limits.center(j)).sum();
    let size: f64 = multipliers.iter().map(|&(face, mu)| mu * (1.0 + faces.b[face as usize].abs())).sum();
    (at_center - value <= b - MARGIN_IMPLIED * (1.0 + size)).then_some(multipliers)
}

/// The multipliers of a cell.
pub fn multipliers(cell: &Cell) -> &[(u32, f64)] {
    match cell {
        Cell::Split { .. } => &[],
        Cell::Empty { multipliers } | Cell::Separated { multipliers, .. } => multipliers,
    }
}

fn multipliers_mut(cell: &mut Cell) -> &mut [(u32, f64)] {
    match cell {
        Cell::Split { .. } => &mut [],
        Cell::Empty { multipliers } | Cell::Separated { multipliers, .. } => multipliers,
    }
}
