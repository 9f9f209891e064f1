//! `CG` and `CP` as polytopes (thesis 2, section 5.3.1).

use convex_sets::HPolyhedron;
use nalgebra::{DMatrix, DVector};
use scene::Space;

/// The polytope {q : l ≤ q ≤ u, rows}: box rows first, upper faces before lower ones, then the finite sides of the
/// space's rows. The rows are those of the scene file, not scaled: scaling would move faces by rounding.
pub fn polytope_of_space(space: &Space) -> HPolyhedron {
    let sides: Vec<(DVector<f64>, f64)> = space
        .rows
        .iter()
        .flat_map(|row| [(row.form.clone(), row.upper), (-row.form.clone(), -row.lower)])
        .filter(|(_, offset)| offset.is_finite())
        .collect();
    let mut A = DMatrix::zeros(sides.len(), space.lower.len());
    let mut b = DVector::zeros(sides.len());
    for (row_idx, (form, offset)) in sides.iter().enumerate() {
        A.row_mut(row_idx).copy_from(&form.transpose());
        b[row_idx] = *offset;
    }
    HPolyhedron::from_box(&space.lower, &space.upper).intersection(&HPolyhedron { A, b })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::BoundedRow;

    #[test]
    fn rows_and_bounds_become_faces() {
        let row =
            BoundedRow { form: DVector::from_vec(vec![1.0, -1.0]), lower: f64::NEG_INFINITY, upper: 0.25 };
        let space = Space {
            lower: DVector::from_vec(vec![0.0, 0.0]),
            upper: DVector::from_vec(vec![1.0, 1.0]),
            rows: vec![row],
        };
        let P = polytope_of_space(&space);
        assert_eq!(P.n_faces(), 5);
        assert!(P.contains(&DVector::from_vec(vec![0.5, 0.25]), 0.0));
        assert!(!P.contains(&DVector::from_vec(vec![0.51, 0.25]), 0.0));
        assert!(!P.contains(&DVector::from_vec(vec![0.5, 1.01]), 0.0));
    }
}
