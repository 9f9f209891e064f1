//! Which polytopes of a list overlap, and how much is proven of it.

use crate::proof::{Outer, contains_exactly, farkas_holds, proven_box, solve};
use convex_sets::HPolyhedron;
use convex_sets::lp::LpOutcome;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Radius of the ball that both polytopes must hold for [`Overlap::Interior`], in units of C-space. Erring side: a
/// smaller overlap is not used for paths.
const TOL_INTERIOR: f64 = 1e-7;

/// What is known of the closed intersection of two polytopes.
#[derive(Debug, Clone, PartialEq)]
pub enum Overlap {
    /// Proven empty.
    Empty,
    /// Neither proven empty nor known to have an interior: they touch, or nearly.
    Undecided,
    /// A ball about this point lies in both.
    Interior(DVector<f64>),
}

impl Overlap {
    /// Whether the intersection is not proven empty: the relation for proofs of infeasibility.
    pub fn is_open(&self) -> bool {
        !matches!(self, Self::Empty)
    }

    /// Whether a path may go through the interior of the intersection.
    pub fn is_interior(&self) -> bool {
        matches!(self, Self::Interior(_))
    }
}

/// Overlaps of a list of polytopes. Only pairs that are not proven empty are stored.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Overlaps {
    pairs: BTreeMap<(usize, usize), Overlap>,
}

impl Overlaps {
    /// What is known of polytopes `a` and `b`, in any order. A polytope with itself is not listed.
    pub fn get(&self, a: usize, b: usize) -> &Overlap {
        self.pairs.get(&(a.min(b), a.max(b))).unwrap_or(&Overlap::Empty)
    }

    /// Pairs `(a, b)`, a < b, that are not proven empty, sorted.
    pub fn open_pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.pairs.keys().copied()
    }

    /// Pairs `(a, b)`, a < b, with common interior, sorted.
    pub fn interior_pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.pairs.iter().filter(|(_, overlap)| overlap.is_interior()).map(|(&pair, _)| pair)
    }

    /// All pairs `(a, b)` with a in `inside`, b not in it and an overlap that is not proven empty: the ways out of a
    /// set of polytopes. `inside` is sorted.
    pub fn exits(&self, inside: &[usize]) -> Vec<(usize, usize)> {
        let is_inside = |idx: &usize| inside.binary_search(idx).is_ok();
        let mut exits: Vec<(usize, usize)> = self
            .open_pairs()
            .filter_map(|(a, b)| match (is_inside(&a), is_inside(&b)) {
                (true, false) => Some((a, b)),
                (false, true) => Some((b, a)),
                _ => None,
            })
            .collect();
        exits.sort_unstable();
        exits
    }
}

/// What is known of the closed intersection of `P` and `other` within `outer`.
///
/// max r  s.t. a_i·x + ‖a_i‖ r ≤ b_i over the rows of both, l ≤ x ≤ u, r ≥ 0: the largest ball. With r = 0 its
/// Farkas vector is one for the rows themselves.
pub fn overlap_of(P: &HPolyhedron, other: &HPolyhedron, outer: &Outer) -> Overlap {
    largest_ball(&P.intersection(other), outer)
}

/// [`overlap_of`] with the whole `outer` for a single polytope: whether it has an interior.
pub fn largest_ball(P: &HPolyhedron, outer: &Outer) -> Overlap {
    let (m, n) = (P.n_faces(), P.ambient_dimension());
    let mut A = DMatrix::zeros(m, n + 1);
    A.view_mut((0, 0), (m, n)).copy_from(&P.A);
    for row_idx in 0..m {
        A[(row_idx, n)] = P.A.row(row_idx).norm();
    }
    let widest = (0..n).map(|k| outer.upper[k] - outer.lower[k]).fold(0.0, f64::max);
    let with_radius = Outer {
        lower: outer.lower.clone().push(0.0),
        upper: outer.upper.clone().push(widest.max(TOL_INTERIOR)),
    };
    let mut c = DVector::zeros(n + 1);
    c[n] = -1.0;
    match solve(&c, &HPolyhedron { A, b: P.b.clone() }, &with_radius) {
        Some(LpOutcome::Infeasible { farkas }) if farkas_holds(P, outer, farkas.as_slice()) => Overlap::Empty,
        Some(LpOutcome::Optimal { x, .. }) => {
            let center = x.rows(0, n).clone_owned();
            if x[n] > TOL_INTERIOR && contains_exactly(P, &center) {
                Overlap::Interior(center)
            } else {
                Overlap::Undecided
            }
        }
        _ => Overlap::Undecided,
    }
}

/// Overlaps of all pairs; `None` in the list stands for a polytope proven empty. One LP a pair, none where the
/// proven boxes are disjoint.
pub fn overlap_of_all(polytopes: &[Option<HPolyhedron>], outer: &Outer) -> Overlaps {
    let boxes: Vec<Option<Outer>> =
        polytopes.iter().map(|P| P.as_ref().and_then(|P| proven_box(P, outer))).collect();
    let mut pairs = BTreeMap::new();
    for a in 0..polytopes.len() {
        for b in a + 1..polytopes.len() {
            let (Some(P), Some(other), Some(box_a), Some(box_b)) =
                (&polytopes[a], &polytopes[b], &boxes[a], &boxes[b])
            else {
                continue;
            };
            if boxes_disjoint(box_a, box_b) {
                continue;
            }
            let overlap = overlap_of(P, other, outer);
            if overlap.is_open() {
                pairs.insert((a, b), overlap);
            }
        }
    }
    Overlaps { pairs }
}

fn boxes_disjoint(a: &Outer, b: &Outer) -> bool {
    (0..a.lower.len()).any(|k| a.upper[k] < b.lower[k] || b.upper[k] < a.lower[k])
}
