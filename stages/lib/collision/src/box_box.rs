//! Two boxes by the separating axis theorem: if they are apart, then along one of the 6 normals of their faces or the 9
//! products of their edges (Gottschalk 1996).

use crate::placement::Placement;
use crate::separation::Separation;
use nalgebra::{Matrix3, Vector3};

/// Products of edges that are shorter than this are nearly parallel and say nothing that the faces do not say.
const TOL_PARALLEL: f64 = 1e-9;

/// The boxes' relative pose: C = R_Aᵀ R_B, its absolute values, and the way from B to A in A and in B.
struct Relative {
    C: Matrix3<f64>,
    absC: Matrix3<f64>,
    d_A: Vector3<f64>,
    d_B: Vector3<f64>,
}

impl Relative {
    #[inline]
    fn new(X_a: &Placement, X_b: &Placement) -> Self {
        let d = X_a.p - X_b.p;
        let C = X_a.R.tr_mul(&X_b.R);
        Self { C, absC: C.abs(), d_A: X_a.R.tr_mul(&d), d_B: X_b.R.tr_mul(&d) }
    }

    /// Gap along the normal of face `i` of A.
    #[inline]
    fn face_a(&self, i: usize, h_a: &Vector3<f64>, h_b: &Vector3<f64>) -> f64 {
        let reach_b = self.absC[(i, 0)] * h_b[0] + self.absC[(i, 1)] * h_b[1] + self.absC[(i, 2)] * h_b[2];
        self.d_A[i].abs() - h_a[i] - reach_b
    }

    /// Gap along the normal of face `j` of B.
    #[inline]
    fn face_b(&self, j: usize, h_a: &Vector3<f64>, h_b: &Vector3<f64>) -> f64 {
        let reach_a = self.absC[(0, j)] * h_a[0] + self.absC[(1, j)] * h_a[1] + self.absC[(2, j)] * h_a[2];
        self.d_B[j].abs() - h_b[j] - reach_a
    }

    /// Gap along the product of edge `i` of A with edge `j` of B, times the product's length, and the square of the
    /// latter; with the signed offset of the centres.
    #[inline]
    fn edges(&self, i: usize, j: usize, h_a: &Vector3<f64>, h_b: &Vector3<f64>) -> (f64, f64, f64) {
        let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        let offset = self.d_A[i2] * self.C[(i1, j)] - self.d_A[i1] * self.C[(i2, j)];
        let reach_a = h_a[i1] * self.absC[(i2, j)] + h_a[i2] * self.absC[(i1, j)];
        let reach_b = h_b[j1] * self.absC[(i, j2)] + h_b[j2] * self.absC[(i, j1)];
        let length_squared = 1.0 - self.C[(i, j)] * self.C[(i, j)];
        (offset.abs() - reach_a - reach_b, length_squared, offset)
    }
}

/// The direction among the 15 with the largest gap.
pub fn separation(X_a: &Placement, h_a: &Vector3<f64>, X_b: &Placement, h_b: &Vector3<f64>) -> Separation {
    let relative = Relative::new(X_a, X_b);
    let mut best = Separation { gap: f64::NEG_INFINITY, normal: Vector3::z() };
    for i in 0..3 {
        let gap = relative.face_a(i, h_a, h_b);
        if gap > best.gap {
            best = Separation { gap, normal: X_a.R.column(i) * 1.0_f64.copysign(relative.d_A[i]) };
        }
    }
    for j in 0..3 {
        let gap = relative.face_b(j, h_a, h_b);
        if gap > best.gap {
            best = Separation { gap, normal: X_b.R.column(j) * 1.0_f64.copysign(relative.d_B[j]) };
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            let (scaled_gap, length_squared, offset) = relative.edges(i, j, h_a, h_b);
            if length_squared < TOL_PARALLEL {
                continue;
            }
            let gap = scaled_gap / length_squared.sqrt();
            if gap > best.gap {
                let product = X_a.R.column(i).cross(&X_b.R.column(j));
                // Their length is known, but normalising again keeps n a unit vector for nearly parallel edges.
                let normal = product.normalize() * 1.0_f64.copysign(offset);
                best = Separation { gap, normal };
            }
        }
    }
    best
}

/// Whether some of the 15 directions has a gap of more than `needed`.
pub fn are_apart(
    X_a: &Placement,
    h_a: &Vector3<f64>,
    X_b: &Placement,
    h_b: &Vector3<f64>,
    needed: f64,
) -> bool {
    let relative = Relative::new(X_a, X_b);
    if (0..3).any(|i| relative.face_a(i, h_a, h_b) > needed || relative.face_b(i, h_a, h_b) > needed) {
        return true;
    }
    for i in 0..3 {
        for j in 0..3 {
            let (scaled_gap, length_squared, _) = relative.edges(i, j, h_a, h_b);
            if length_squared >= TOL_PARALLEL && scaled_gap > needed * length_squared.sqrt() {
                return true;
            }
        }
    }
    false
}
