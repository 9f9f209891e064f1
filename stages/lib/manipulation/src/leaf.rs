//! Leaves: what a path of one mode can reach while its kept forms stay constant.
//!
//! A transit lives in {q ∈ CP_free : F_transit q = λ}, a transfer in {q ∈ CG_free : F_transfer q = λ}. Two
//! configurations of one connected region need not be connected inside the leaf (thesis 2, remark 5).

use crate::overlap::Overlaps;
use crate::proof::{Emptiness, Outer, proven_empty};
use convex_sets::HPolyhedron;
use nalgebra::{DMatrix, DVector};

/// Whether the robot moves alone or holds the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PathMode {
    /// The robot alone, the object rests.
    Transit,
    /// The robot holds the object.
    Transfer,
}

/// The leaf {q : F q = λ}.
#[derive(Debug, Clone, PartialEq)]
pub struct Leaf {
    /// Kept forms, one a row [k × n].
    pub F: DMatrix<f64>,
    /// Their values λ [k].
    pub values: DVector<f64>,
}

impl Leaf {
    /// The leaf of `F` through `q`.
    pub fn through(F: &DMatrix<f64>, q: &DVector<f64>) -> Self {
        Self { F: F.clone(), values: F * q }
    }

    /// Half-spaces `λ - tol ≤ F q ≤ λ + tol`. λ computed in floating point is not exact for a form of several
    /// coordinates; a `tol` of a few units in the last place keeps the true leaf inside.
    pub fn slab(&self, tol: f64) -> HPolyhedron {
        let (k, n) = self.F.shape();
        let mut A = DMatrix::zeros(2 * k, n);
        A.rows_mut(0, k).copy_from(&self.F);
        A.rows_mut(k, k).copy_from(&-&self.F);
        let mut b = DVector::zeros(2 * k);
        for row_idx in 0..k {
            b[row_idx] = self.values[row_idx] + tol;
            b[k + row_idx] = -self.values[row_idx] + tol;
        }
        HPolyhedron { A, b }
    }
}

/// Polytopes that are reached from those of `starts` through overlaps that meet the leaf; sorted.
///
/// `polytopes` are CG ∩ P_j or CP ∩ P_j (`None`: proven empty), `overlaps` theirs. An overlap is passed unless its
/// intersection with the slab of width `tol` about the leaf is proven empty, so the set is never too small: what is
/// not reached cannot be reached.
pub fn reached_in_leaf(
    polytopes: &[Option<HPolyhedron>],
    overlaps: &Overlaps,
    leaf: &Leaf,
    tol: f64,
    starts: &[usize],
    outer: &Outer,
) -> Vec<usize> {
    let slab = leaf.slab(tol);
    let mut reached = vec![false; polytopes.len()];
    let mut queue: Vec<usize> = starts.to_vec();
    queue.iter().for_each(|&start| reached[start] = true);
    while let Some(a) = queue.pop() {
        for b in 0..polytopes.len() {
            if reached[b] || !overlaps.get(a, b).is_open() {
                continue;
            }
            if let (Some(P), Some(other)) = (&polytopes[a], &polytopes[b])
                && proven_empty(&P.intersection(other).intersection(&slab), outer) != Emptiness::Empty
            {
                reached[b] = true;
                queue.push(b);
            }
        }
    }
    (0..polytopes.len()).filter(|&idx| reached[idx]).collect()
}
