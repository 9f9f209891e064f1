//! The box in which a region grows, in units of its own.
//!
//! u = (x - mid) / half takes the box to [-1, 1]^k: a band of a millimetre beside a radian is as round as any other
//! domain, and every tolerance and metric is relative to it.

use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::{DMatrix, DVector};

use crate::coordinates::Coordinates;
use crate::free_space::FreeSpace;
use crate::pairs::Pairs;
use crate::provable::Bodies;

/// A face counts as implied by the unit box if it cuts off less than this, in units of u.
const TOL_IMPLIED: f64 = 1e-12;

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

    /// The pairs of bodies, if the oracle knows them.
    pub(crate) fn pairs(&self) -> Option<&'a dyn Pairs> {
        self.free.pairs()
    }

    /// The bodies, if the oracle knows them.
    pub(crate) fn bodies(&self) -> Option<&'a Bodies<'a>> {
        self.free.bodies()
    }

    /// The box over all coordinates; those that nothing depends on have their whole range.
    pub(crate) fn bounds_of_all(&self) -> Hyperrectangle {
        let mut bounds = self.coordinates.limits.clone();
        for (i, &j) in self.coordinates.relevant.iter().enumerate() {
            (bounds.lower[j], bounds.upper[j]) = (self.bounds.lower[i], self.bounds.upper[i]);
        }
        bounds
    }

    /// The faces of a polyhedron over all coordinates as unit faces over u, without those that the unit box implies.
    pub(crate) fn faces_over_u(&self, P: &HPolyhedron) -> HPolyhedron {
        let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
        for face_idx in 0..P.n_faces() {
            let a: Vec<f64> = P.A.row(face_idx).iter().copied().collect();
            let (row, at_mid) = self.row_over_u(&a);
            let norm = row.norm();
            let b = P.b[face_idx] - at_mid;
            // The most that the unit box allows, with room for rounding.
            if norm > 0.0 && b < row.lp_norm(1) - TOL_IMPLIED * norm {
                rows.push((row / norm, b / norm));
            }
        }
        HPolyhedron {
            A: DMatrix::from_fn(rows.len(), self.dim(), |i, j| rows[i].0[j]),
            b: DVector::from_fn(rows.len(), |i, _| rows[i].1),
        }
    }

    /// The first pair that collides at `u`; `None` also if the oracle knows no pairs.
    pub(crate) fn colliding_pair(&self, u: &DVector<f64>) -> Option<usize> {
        self.pairs()?.first_colliding(&self.q_from_u(u))
    }

    /// Positions in u of the coordinates that a pair depends on.
    pub(crate) fn pair_coordinates(&self, pairs: &dyn Pairs, pair_idx: usize) -> Vec<usize> {
        let of_pair = pairs.coordinates(pair_idx);
        (0..self.dim()).filter(|&i| of_pair.binary_search(&self.coordinates.relevant[i]).is_ok()).collect()
    }

    /// The gap of a pair at `u`, metres, and its gradient over u.
    pub(crate) fn gap(&self, pairs: &dyn Pairs, pair_idx: usize, u: &DVector<f64>) -> (f64, DVector<f64>) {
        let mut gradient_q = vec![0.0; self.coordinates.dim()];
        let gap = pairs.gap(pair_idx, &self.q_from_u(u), &mut gradient_q);
        (gap, self.coordinates.project(&gradient_q).component_mul(&self.half))
    }

    /// The row a·q of all coordinates as a row over u: a·q = (returned row)·u + (returned constant), with the
    /// coordinates that nothing depends on in the middle of their range.
    pub(crate) fn row_over_u(&self, a: &[f64]) -> (DVector<f64>, f64) {
        let a_x = self.coordinates.project(a);
        let at_mid = self.coordinates.lift(self.mid.as_slice()).iter().zip(a).map(|(q, a)| q * a).sum();
        (a_x.component_mul(&self.half), at_mid)
    }

    /// A change of u as a change of q.
    pub(crate) fn dq_from_du(&self, du: &DVector<f64>) -> Vec<f64> {
        let mut dq = vec![0.0; self.coordinates.dim()];
        for (i, &j) in self.coordinates.relevant.iter().enumerate() {
            dq[j] = self.half[i] * du[i];
        }
        dq
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
    /// joint limits do not imply become faces with the exact bounds of the domain, unless a later face is a tighter bound.
    pub(crate) fn region(&self, P: &HPolyhedron) -> HPolyhedron {
        let k = self.dim();
        let limits = self.coordinates.project_box(&self.coordinates.limits);
        let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
        let is_tightened = |side: usize| {
            (2 * k..P.n_faces())
                .any(|face_idx| P.A.row(face_idx) == P.A.row(side) && P.b[face_idx] < P.b[side])
        };
        for j in 0..k {
            let mut unit = DVector::zeros(k);
            unit[j] = 1.0;
            if self.bounds.upper[j] < limits.upper[j] && !is_tightened(j) {
                rows.push((unit.clone(), self.bounds.upper[j]));
            }
            if self.bounds.lower[j] > limits.lower[j] && !is_tightened(k + j) {
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
