//! Regions contain start and goal exactly, not up to rounding.

use convex_sets::HPolyhedron;

/// Loosens faces of `P` by rounding's worth where they need it to contain `q` in any order of summation. Faces over
/// a single coordinate (joint limits, bounds of CG) are exact as they are and stay.
pub(crate) fn contain_exactly(P: &mut HPolyhedron, q: &[f64]) {
    for face_idx in 0..P.n_faces() {
        let products: Vec<f64> = (0..q.len()).map(|j| P.A[(face_idx, j)] * q[j]).collect();
        if P.A.row(face_idx).iter().filter(|v| **v != 0.0).count() <= 1 {
            continue;
        }
        let size: f64 = products.iter().map(|v| v.abs()).sum();
        let needed = products.iter().sum::<f64>() + 4.0 * q.len() as f64 * f64::EPSILON * size;
        P.b[face_idx] = P.b[face_idx].max(needed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn a_face_through_the_point_gives_way_and_a_limit_does_not() {
        let A = DMatrix::from_row_slice(2, 2, &[0.6, 0.8, -1.0, 0.0]);
        let q = [-0.1, 0.3];
        let exact = 0.6 * -0.1 + 0.8 * 0.3;
        let mut P = HPolyhedron { A, b: DVector::from_vec(vec![exact, 0.1]) };
        contain_exactly(&mut P, &q);
        assert!(P.b[0] > exact && P.b[0] < exact + 1e-14);
        assert_eq!(P.b[1], 0.1);
    }
}
