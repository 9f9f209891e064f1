//! The coordinates that collisions depend on.
//!
//! A coordinate that no pair depends on (the angle of a round cap) is not sampled: regions are prisms over its whole
//! range. Symbols: q all coordinates [n], x the relevant ones [k], in order.

use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::{DMatrix, DVector};

/// Which coordinates matter, and the joint box.
#[derive(Debug, Clone)]
pub(crate) struct Coordinates {
    /// Positions of the relevant coordinates.
    pub(crate) relevant: Vec<usize>,
    /// Joint limits of all coordinates.
    pub(crate) limits: Hyperrectangle,
    middle: Vec<f64>,
}

impl Coordinates {
    pub(crate) fn new(limits: Hyperrectangle, is_relevant: &[bool]) -> Self {
        let relevant = (0..is_relevant.len()).filter(|&j| is_relevant[j]).collect();
        let middle = limits.center().iter().copied().collect();
        Self { relevant, limits, middle }
    }

    /// n.
    pub(crate) fn dim(&self) -> usize {
        self.middle.len()
    }

    /// k.
    pub(crate) fn n_relevant(&self) -> usize {
        self.relevant.len()
    }

    /// The configuration with relevant coordinates `x` and the others in the middle of their range.
    pub(crate) fn lift(&self, x: &[f64]) -> Vec<f64> {
        let mut q = self.middle.clone();
        for (&j, &value) in self.relevant.iter().zip(x) {
            q[j] = value;
        }
        q
    }

    /// The relevant coordinates of `q`.
    pub(crate) fn project(&self, q: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.relevant.len(), self.relevant.iter().map(|&j| q[j]))
    }

    /// The shadow of a box of all coordinates.
    pub(crate) fn project_box(&self, bounds: &Hyperrectangle) -> Hyperrectangle {
        Hyperrectangle {
            lower: self.project(bounds.lower.as_slice()),
            upper: self.project(bounds.upper.as_slice()),
        }
    }

    /// The prism over `P`, a polyhedron in x: the joint limits (upper ones first, then lower ones), then the faces
    /// of P, unit.
    pub(crate) fn prism(&self, P: &HPolyhedron) -> HPolyhedron {
        let mut A = DMatrix::zeros(P.n_faces(), self.dim());
        let mut b = P.b.clone();
        for face_idx in 0..P.n_faces() {
            let norm = P.A.row(face_idx).norm();
            for (column, &j) in self.relevant.iter().enumerate() {
                A[(face_idx, j)] = P.A[(face_idx, column)] / norm;
            }
            b[face_idx] /= norm;
        }
        self.limits.to_polyhedron().intersection(&HPolyhedron { A, b })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prism_has_the_limits_exactly() {
        let limits = Hyperrectangle {
            lower: DVector::from_vec(vec![-3.1, -1.0, -0.055]),
            upper: DVector::from_vec(vec![3.1, 1.0, 0.0]),
        };
        let coordinates = Coordinates::new(limits, &[false, true, true]);
        let P =
            HPolyhedron { A: DMatrix::from_row_slice(1, 2, &[3.0, 4.0]), b: DVector::from_vec(vec![1.0]) };
        let prism = coordinates.prism(&P);
        assert_eq!(prism.n_faces(), 7);
        assert_eq!(prism.b.as_slice()[..6], [3.1, 1.0, 0.0, 3.1, 1.0, 0.055]);
        assert_eq!(prism.A.row(6).transpose().as_slice(), [0.0, 0.6, 0.8]);
        assert!(prism.contains(&DVector::from_vec(vec![3.1, -1.0, 0.0]), 0.0));
        assert_eq!(coordinates.lift(&[0.5, -0.01]), vec![0.0, 0.5, -0.01]);
        assert_eq!(coordinates.project(&[7.0, 0.5, -0.01]).as_slice(), [0.5, -0.01]);
    }
}
