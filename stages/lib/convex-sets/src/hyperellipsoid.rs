//! Ellipsoids.

use nalgebra::{Cholesky, DMatrix, DVector};

/// {x : ‖A (x - c)‖ ≤ 1}.
#[derive(Debug, Clone, PartialEq)]
pub struct Hyperellipsoid {
    /// Shape [n × n], invertible.
    pub A: DMatrix<f64>,
    /// Center c [n].
    pub center: DVector<f64>,
}

impl Hyperellipsoid {
    /// The ball of `radius` > 0.
    pub fn ball(center: DVector<f64>, radius: f64) -> Self {
        let n = center.len();
        Self { A: DMatrix::identity(n, n) / radius, center }
    }

    /// {C u + d : ‖u‖ ≤ 1}, `None` if C is not invertible.
    pub fn from_image_of_ball(C: &DMatrix<f64>, d: DVector<f64>) -> Option<Self> {
        Some(Self { A: C.clone().try_inverse()?, center: d })
    }

    /// Dimension n.
    pub fn ambient_dimension(&self) -> usize {
        self.center.len()
    }

    /// ‖A (x - c)‖: the factor by which the ellipsoid must grow to reach `x`.
    pub fn distance(&self, x: &DVector<f64>) -> f64 {
        (&self.A * (x - &self.center)).norm()
    }

    /// The metric AᵀA, in which the ellipsoid is the unit ball.
    pub fn metric(&self) -> DMatrix<f64> {
        self.A.transpose() * &self.A
    }

    /// Volume relative to that of the unit ball: 1 / |det A|.
    pub fn relative_volume(&self) -> f64 {
        1.0 / self.A.determinant().abs()
    }

    /// C with the ellipsoid = {C u + c : ‖u‖ ≤ 1}.
    pub fn image_of_ball(&self) -> Option<DMatrix<f64>> {
        self.A.clone().try_inverse()
    }
}

/// Upper triangular R with RᵀR = `metric`.
pub(crate) fn square_root(metric: DMatrix<f64>) -> Option<DMatrix<f64>> {
    Cholesky::new(metric).map(|cholesky| cholesky.l().transpose())
}
