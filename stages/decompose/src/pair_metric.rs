//! The metric of an ellipsoid over the coordinates that one pair depends on.
//!
//! What a pair blocks is a cylinder over its coordinates J: the others are free to be what is nearest. With the shape
//! matrix C = A⁻¹ A⁻ᵀ of the metric M = AᵀA, the least distance over the others is that of the metric
//! S = (C_JJ)⁻¹ (the Schur complement of M). So the search for the nearest collision is in |J| dimensions, asks one
//! pair, and the face's normal is exactly 0 over the other coordinates: the face is a prism over them.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::domain::Domain;
use crate::pairs::Pairs;

/// Distances as one pair sees them, or, without a pair, all of them.
#[derive(Debug, Clone)]
pub(crate) struct PairMetric {
    /// The pair.
    pub(crate) pair_idx: Option<usize>,
    /// Positions in u of the coordinates J.
    coordinates: Vec<usize>,
    /// R with RᵀR = S [|J| × |J|].
    R: DMatrix<f64>,
    /// R⁻¹; `None` if the ellipsoid is flat.
    inverse: Option<DMatrix<f64>>,
}

impl PairMetric {
    /// The metric ‖A u‖ over all coordinates, for what no pair is known of.
    pub(crate) fn of_all(A: &DMatrix<f64>) -> Self {
        let coordinates = (0..A.ncols()).collect();
        Self { pair_idx: None, coordinates, R: A.clone(), inverse: A.clone().try_inverse() }
    }

    /// The metric of a pair.
    pub(crate) fn of_pair(domain: &Domain<'_>, pairs: &dyn Pairs, pair_idx: usize, A: &DMatrix<f64>) -> Self {
        let coordinates = domain.pair_coordinates(pairs, pair_idx);
        let all = Self { pair_idx: Some(pair_idx), ..Self::of_all(A) };
        if coordinates.len() == domain.dim() {
            return all;
        }
        let Some(inverse) = &all.inverse else { return all };
        let C = inverse * inverse.transpose();
        let j = coordinates.len();
        let C_JJ = DMatrix::from_fn(j, j, |s, t| C[(coordinates[s], coordinates[t])]);
        // C_JJ = L Lᵀ, so S = L⁻ᵀ L⁻¹ and R = L⁻¹.
        let Some(L) = Cholesky::new(C_JJ).map(|cholesky| cholesky.l()) else { return all };
        let Some(R) = L.clone().try_inverse() else { return all };
        Self { pair_idx: Some(pair_idx), coordinates, R, inverse: Some(L) }
    }

    /// Number of coordinates J.
    pub(crate) fn dim(&self) -> usize {
        self.coordinates.len()
    }

    /// Whether distances can be turned into coordinates.
    pub(crate) fn is_regular(&self) -> bool {
        self.inverse.is_some()
    }

    /// w = R (u - y)_J.
    pub(crate) fn w_from_u(&self, u: &DVector<f64>, y: &DVector<f64>) -> DVector<f64> {
        &self.R * self.restrict(&(u - y))
    }

    /// y, with the coordinates J moved by R⁻¹ w.
    pub(crate) fn u_from_w(&self, w: &DVector<f64>, y: &DVector<f64>) -> DVector<f64> {
        let mut u = y.clone();
        if let Some(inverse) = &self.inverse {
            let moved = inverse * w;
            for (s, &j) in self.coordinates.iter().enumerate() {
                u[j] += moved[s];
            }
        }
        u
    }

    /// S (u - y)_J, with 0 for the other coordinates: the gradient of half the squared distance from y.
    pub(crate) fn normal(&self, u: &DVector<f64>, y: &DVector<f64>) -> DVector<f64> {
        let normal_J = self.R.transpose() * (&self.R * self.restrict(&(u - y)));
        let mut normal = DVector::zeros(u.len());
        for (s, &j) in self.coordinates.iter().enumerate() {
            normal[j] = normal_J[s];
        }
        normal
    }

    /// Whether u lies in the unit box, as far as J says.
    pub(crate) fn is_inside(&self, u: &DVector<f64>) -> bool {
        self.coordinates.iter().all(|&j| u[j].abs() <= 1.0)
    }

    /// Whether the pair, or without one any, blocks `u`.
    pub(crate) fn blocks(&self, domain: &Domain<'_>, u: &DVector<f64>) -> bool {
        match (self.pair_idx, domain.pairs()) {
            (Some(pair_idx), Some(pairs)) => !pairs.pair_is_free(pair_idx, &domain.q_from_u(u)),
            _ => !domain.is_free(u),
        }
    }

    /// The pair's gap at w and its gradient over w; `None` without a pair.
    pub(crate) fn gap(
        &self,
        domain: &Domain<'_>,
        w: &DVector<f64>,
        y: &DVector<f64>,
    ) -> Option<(f64, DVector<f64>)> {
        let (pair_idx, pairs, inverse) = (self.pair_idx?, domain.pairs()?, self.inverse.as_ref()?);
        let (gap, gradient) = domain.gap(pairs, pair_idx, &self.u_from_w(w, y));
        Some((gap, inverse.tr_mul(&self.restrict(&gradient))))
    }

    /// The unit box around as rows G w ≤ h.
    pub(crate) fn box_over_w(&self, y: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let j = self.dim();
        let inverse = self.inverse.clone().unwrap_or_else(|| DMatrix::zeros(j, j));
        let G = DMatrix::from_fn(2 * j, j, |i, t| if i < j { inverse[(i, t)] } else { -inverse[(i - j, t)] });
        let h = DVector::from_fn(2 * j, |i, _| {
            if i < j { 1.0 - y[self.coordinates[i]] } else { 1.0 + y[self.coordinates[i - j]] }
        });
        (G, h)
    }

    fn restrict(&self, u: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.dim(), self.coordinates.iter().map(|&j| u[j]))
    }
}
