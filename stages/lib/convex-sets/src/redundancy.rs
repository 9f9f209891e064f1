//! Faces that other faces imply.

use nalgebra::{DMatrix, DVector};

use crate::lp::{LinearProgram, LpOutcome};
use crate::{HPolyhedron, SetError};

/// A face is dropped if the others keep P within this of it, relative to the face's extent over P's box.
/// Erring side: P may grow by this share.
const TOL_REDUNDANT: f64 = 1e-10;

impl HPolyhedron {
    /// P without the faces that the others imply; of equal faces the first stays. The order is kept.
    pub fn remove_redundant(&self) -> Result<Self, SetError> {
        self.remove_redundant_keeping(0)
    }

    /// As [`HPolyhedron::remove_redundant`], but the first `n_kept` faces (the joint limits) stay whatever they
    /// are, and the faces from `n_kept` on that remain follow them in order.
    pub fn remove_redundant_keeping(&self, n_kept: usize) -> Result<Self, SetError> {
        let bounds = self.bounding_box()?;
        // Room for the face under test to be exceeded, were it not there.
        let half = bounds.half_widths();
        let slack = half.map(|h| h.max(f64::MIN_POSITIVE));
        let lower = &bounds.lower - &slack;
        let upper = &bounds.upper + &slack;
        let mut kept: Vec<usize> = (0..self.n_faces()).collect();
        for face_idx in (n_kept.min(self.n_faces())..self.n_faces()).rev() {
            let row: DVector<f64> = self.A.row(face_idx).transpose();
            let extent = row.component_mul(&half).norm();
            // The largest value over the box alone.
            let over_box: f64 =
                (0..row.len()).map(|j| (row[j] * bounds.lower[j]).max(row[j] * bounds.upper[j])).sum();
            let others: Vec<usize> = kept.iter().copied().filter(|&i| i != face_idx).collect();
            let redundant = if over_box <= self.b[face_idx] - 1e-6 * extent {
                // The box touches the other faces, and this face lies beyond the box.
                true
            } else {
                let (A, b) = self.select(&others);
                match LinearProgram::new(&A, &b, &lower, &upper).minimize(&-&row) {
                    LpOutcome::Optimal { value, .. } => -value <= self.b[face_idx] + TOL_REDUNDANT * extent,
                    LpOutcome::Infeasible { .. } => return Err(SetError::Empty),
                    LpOutcome::Undecided { .. } => false,
                }
            };
            if redundant {
                kept = others;
            }
        }
        let (A, b) = self.select(&kept);
        Ok(Self { A, b })
    }

    /// The faces `face_idxs`, in that order.
    pub fn select(&self, face_idxs: &[usize]) -> (DMatrix<f64>, DVector<f64>) {
        let mut A = DMatrix::zeros(face_idxs.len(), self.ambient_dimension());
        let mut b = DVector::zeros(face_idxs.len());
        for (row_idx, &face_idx) in face_idxs.iter().enumerate() {
            A.set_row(row_idx, &self.A.row(face_idx));
            b[row_idx] = self.b[face_idx];
        }
        (A, b)
    }

    /// P with rows scaled to norm 1; rows of norm 0 are left out if they hold, `Err(Empty)` if one does not.
    pub fn with_unit_rows(&self) -> Result<Self, SetError> {
        let mut kept = Vec::new();
        for i in 0..self.n_faces() {
            let norm = self.A.row(i).norm();
            if norm > 0.0 {
                kept.push(i);
            } else if self.b[i] < 0.0 {
                return Err(SetError::Empty);
            }
        }
        let (mut A, mut b) = self.select(&kept);
        for i in 0..kept.len() {
            let norm = A.row(i).norm();
            if norm != 1.0 {
                A.row_mut(i).unscale_mut(norm);
                b[i] /= norm;
            }
        }
        Ok(Self { A, b })
    }
}
