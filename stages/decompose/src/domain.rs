//! The box in which a region grows, in units of its own.
//!
//! u = (x - mid) / half takes the box to [-1, 1]^k: a band of a millimetre beside a radian is as round as any other
//! domain, and every tolerance and metric is relative to it.

use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::{DMatrix, DVector};

use crate::coordinates::Coordinates;
use crate::free_space::FreeSpace;

/// A box of relevant coordinates with what is free in it.
#[derive(Clone)]
pub(crate) struct Domain<'a> {
    coordinates: &'a Coordinates,
    free: &'a dyn FreeSpace,
    /// The box in x.
    pub(crate) bounds: Hyperrectangle,
    mid: DVector<f64>,
    half: DVector<f64>,
    /// Metres of displacement for each unit of u.
    displacement: DVector<f64>,
}

impl<'a> Domain<'a> {
    /// `displacement`: metres for each unit of every coordinate of q. A flat side of `bounds` is widened to a
    /// hundredth of the joint range, so that regions in it have an interior.
    pub(crate) fn new(
        coordinates: &'a Coordinates,
        free: &'a dyn FreeSpace,
        displacement: &DVector<f64>,
        bounds: &Hyperrectangle,
    ) -> Self {
        let limits = coordinates.project_box(&coordinates.limits);
        let mut bounds = bounds.clone();
        for j in 0..bounds.lower.len() {
            let range = limits.upper[j] - limits.lower[j];
            if bounds.upper[j] - bounds.lower[j] < 1e-9 * range {
                bounds.lower[j] = (bounds.lower[j] - 0.005 * range).max(limits.lower[j]);
                bounds.upper[j] = (bounds.upper[j] + 0.005 * range).min(limits.upper[j]);
            }
        }
        let (mid, half) = (bounds.center(), bounds.half_widths());
        let displacement = coordinates.project(displacement.as_slice()).component_mul(&half);
        Self { coordinates, free, bounds, mid, half, displacement }
    }

    pub(crate) fn dim(&self) -> usize {
        self.mid.len()
    }

    pub(crate) fn x_from_u(&self, u: &DVector<f64>) -> DVector<f64> {
        &self.mid + self.half.component_mul(u)
    }

    pub(crate) fn u_from_x(&self, x: &DVector<f64>) -> DVector<f64> {
        (x - &self.mid).component_div(&self.half)
    }

    pub(crate) fn u_from_q(&self, q: &[f64]) -> DVector<f64> {
        self.u_from_x(&self.coordinates.project(q))
    }

    pub(crate) fn q_from_u(&self, u: &DVector<f64>) -> Vec<f64> {
        self.coordinates.lift(self.x_from_u(u).as_slice())
    }

    pub(crate) fn is_free(&self, u: &DVector<f64>) -> bool {
        self.free.is_free(&self.q_from_u(u))
    }

    pub(crate) fn edge_is_free(&self, u_0: &DVector<f64>, u_1: &DVector<f64>) -> bool {
        self.free.edge_is_free(&self.q_from_u(u_0), &self.q_from_u(u_1))
    }

    /// Metres that the bodies move at most when u changes by `du`, to first order.
    pub(crate) fn displacement(&self, du: &DVector<f64>) -> f64 {
        self.displacement.component_mul(du).norm()
    }

    /// [-1, 1]^k.
    pub(crate) fn unit_box(&self) -> HPolyhedron {
        let k = self.dim();
        HPolyhedron::from_box(&DVector::from_element(k, -1.0), &DVector::from_element(k, 1.0))
    }

    /// The region {q : u(q) ∈ P} as a prism. The first 2k faces of `P` are the unit box; of those the ones that the
    /// joint limits do not imply become faces with the exact bounds of the domain.
    pub(crate) fn region(&self, P: &HPolyhedron) -> HPolyhedron {
        let k = self.dim();
        let limits = self.coordinates.project_box(&self.coordinates.limits);
        let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
        for j in 0..k {
            let mut unit = DVector::zeros(k);
            unit[j] = 1.0;
            if self.bounds.upper[j] < limits.upper[j] {
                rows.push((unit.clone(), self.bounds.upper[j]));
            }
            if self.bounds.lower[j] > limits.lower[j] {
                rows.push((-unit, -self.bounds.lower[j]));
            }
        }
        for face_idx in 2 * k..P.n_faces() {
            let a = P.A.row(face_idx).transpose().component_div(&self.half);
            let b = P.b[face_idx] + a.dot(&self.mid);
            rows.push((a, b));
        }
        let A = DMatrix::from_fn(rows.len(), k, |i, j| rows[i].0[j]);
        let b = DVector::from_fn(rows.len(), |i, _| rows[i].1);
        self.coordinates.prism(&HPolyhedron { A, b })
    }
}
