//! Polyhedra by their faces: P = {x : A x ≤ b}.

use nalgebra::{DMatrix, DVector};

/// P = {x : A x ≤ b}; may be unbounded.
#[derive(Debug, Clone, PartialEq)]
pub struct HPolyhedron {
    /// Face normals [m × n].
    pub A: DMatrix<f64>,
    /// Face offsets [m].
    pub b: DVector<f64>,
}

impl HPolyhedron {
    /// The box `lower ≤ x ≤ upper`; rows `x_0 ≤ u_0, …, x_{n-1} ≤ u_{n-1}, -x_0 ≤ -l_0, …`.
    pub fn from_box(lower: &DVector<f64>, upper: &DVector<f64>) -> Self {
        let n = lower.len();
        let mut A = DMatrix::zeros(2 * n, n);
        let mut b = DVector::zeros(2 * n);
        for i in 0..n {
            A[(i, i)] = 1.0;
            b[i] = upper[i];
            A[(n + i, i)] = -1.0;
            b[n + i] = -lower[i];
        }
        Self { A, b }
    }

    /// Dimension n of the space that P lives in.
    pub fn ambient_dimension(&self) -> usize {
        self.A.ncols()
    }

    /// Number m of faces.
    pub fn n_faces(&self) -> usize {
        self.A.nrows()
    }

    /// Whether `A x ≤ b + tol` in every row.
    pub fn contains(&self, x: &DVector<f64>, tol: f64) -> bool {
        (0..self.n_faces()).all(|i| self.A.row(i).transpose().dot(x) <= self.b[i] + tol)
    }

    /// P ∩ `other`: the rows of both, those of P first.
    pub fn intersection(&self, other: &Self) -> Self {
        let (m1, m2, n) = (self.n_faces(), other.n_faces(), self.ambient_dimension());
        let mut A = DMatrix::zeros(m1 + m2, n);
        A.rows_mut(0, m1).copy_from(&self.A);
        A.rows_mut(m1, m2).copy_from(&other.A);
        let mut b = DVector::zeros(m1 + m2);
        b.rows_mut(0, m1).copy_from(&self.b);
        b.rows_mut(m1, m2).copy_from(&other.b);
        Self { A, b }
    }
}
