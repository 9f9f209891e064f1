//! Statements about a polytope {x : A x ≤ b, l ≤ x ≤ u} that hold in exact arithmetic.
//!
//! A simplex in floating point proposes multipliers y ≥ 0; the statement is the inequality that they give, evaluated
//! with outward rounding: `max c·x ≤ y·b + max_{l ≤ x ≤ u} (c - Aᵀy)·x`, and *empty* if `min_{l≤x≤u} (Aᵀy)·x > y·b`.

use crate::rounding::Enclosure;
use convex_sets::HPolyhedron;
use convex_sets::lp::{self, LpOutcome};
use nalgebra::DVector;

/// A box that encloses all polytopes of a scene: the joint box.
#[derive(Debug, Clone, PartialEq)]
pub struct Outer {
    /// Lower corner.
    pub lower: DVector<f64>,
    /// Upper corner.
    pub upper: DVector<f64>,
}

/// Whether a polytope has a point.
#[derive(Debug, Clone, PartialEq)]
pub enum Emptiness {
    /// Proven empty.
    Empty,
    /// Not proven empty; a point that satisfies the rows up to the solver's tolerance.
    Point(DVector<f64>),
    /// The solver gave no answer.
    Unknown,
}

/// min c·x over {A x ≤ b} ∩ box in floating point; `None` if the solver ends without a status that can be used.
pub fn solve(c: &DVector<f64>, P: &HPolyhedron, outer: &Outer) -> Option<LpOutcome> {
    Some(lp::minimize(c, &P.A, &P.b, &outer.lower, &outer.upper))
}

/// Whether {A x ≤ b} ∩ box is empty.
pub fn proven_empty(P: &HPolyhedron, outer: &Outer) -> Emptiness {
    match solve(&DVector::zeros(P.ambient_dimension()), P, outer) {
        Some(LpOutcome::Infeasible { farkas }) if farkas_holds(P, outer, farkas.as_slice()) => {
            Emptiness::Empty
        }
        Some(LpOutcome::Optimal { x, .. }) => Emptiness::Point(x),
        _ => Emptiness::Unknown,
    }
}

/// Whether `min_{l≤x≤u} (Aᵀy)·x > y·b` in exact arithmetic. Negative entries of `multipliers` count as zero.
pub fn farkas_holds(P: &HPolyhedron, outer: &Outer, multipliers: &[f64]) -> bool {
    bound_above(&DVector::zeros(P.ambient_dimension()), P, outer, multipliers) < 0.0
}

/// A number that is at least `max c·x` over {A x ≤ b} ∩ box, by LP duality; -∞ if that set is proven empty.
pub fn proven_maximum(c: &DVector<f64>, P: &HPolyhedron, outer: &Outer) -> f64 {
    let trivial = bound_above(c, P, outer, &[]);
    match solve(&-c, P, outer) {
        Some(LpOutcome::Optimal { multipliers, .. }) => {
            trivial.min(bound_above(c, P, outer, multipliers.as_slice()))
        }
        Some(LpOutcome::Infeasible { farkas }) if farkas_holds(P, outer, farkas.as_slice()) => {
            f64::NEG_INFINITY
        }
        _ => trivial,
    }
}

/// `y·b + max_{l≤x≤u} (c - Aᵀy)·x`, rounded up; missing multipliers are zero. A large or non-finite sum is +∞.
pub fn bound_above(c: &DVector<f64>, P: &HPolyhedron, outer: &Outer, multipliers: &[f64]) -> f64 {
    let mut reduced: Vec<Enclosure> = c.iter().map(|&c| Enclosure::exact(c)).collect();
    let mut bound = Enclosure::zero();
    for (row_idx, &multiplier) in multipliers.iter().enumerate().take(P.n_faces()) {
        // A NaN fails this test too.
        if multiplier > 0.0 {
            let y = Enclosure::exact(multiplier);
            bound = bound.plus(y.times(Enclosure::exact(P.b[row_idx])));
            for k in 0..reduced.len() {
                reduced[k] = reduced[k].minus(y.times(Enclosure::exact(P.A[(row_idx, k)])));
            }
        }
    }
    for k in 0..reduced.len() {
        // The product with an interval coordinate takes the larger end by itself.
        bound = bound.plus(reduced[k].times(Enclosure { lower: outer.lower[k], upper: outer.upper[k] }));
    }
    if bound.upper.is_nan() { f64::INFINITY } else { bound.upper }
}

/// The smallest box that is proven to contain {A x ≤ b} ∩ `outer`; `None` if that set is proven empty.
pub fn proven_box(P: &HPolyhedron, outer: &Outer) -> Option<Outer> {
    let mut enclosing = outer.clone();
    for k in 0..P.ambient_dimension() {
        let mut e = DVector::zeros(P.ambient_dimension());
        e[k] = 1.0;
        let upper = proven_maximum(&e, P, outer);
        let lower = -proven_maximum(&-e, P, outer);
        if upper < lower {
            return None;
        }
        enclosing.upper[k] = enclosing.upper[k].min(upper);
        enclosing.lower[k] = enclosing.lower[k].max(lower);
    }
    Some(enclosing)
}

/// Whether {A x ≤ b} ∩ `outer` is proven to lie in `other`.
pub fn proven_contained(P: &HPolyhedron, other: &HPolyhedron, outer: &Outer) -> bool {
    (0..other.n_faces()).all(|face_idx| {
        let face = other.A.row(face_idx).transpose();
        // A row that both share needs no LP.
        let shared = (0..P.n_faces())
            .any(|row_idx| P.b[row_idx] <= other.b[face_idx] && P.A.row(row_idx) == other.A.row(face_idx));
        shared || proven_maximum(&face, P, outer) <= other.b[face_idx]
    })
}

/// Whether `A x ≤ b` in exact arithmetic, judged by outward rounding: `false` may also mean that x lies within
/// rounding of a face that is not a bound on one coordinate.
pub fn contains_exactly(P: &HPolyhedron, x: &DVector<f64>) -> bool {
    (0..P.n_faces()).all(|row_idx| {
        let row = P.A.row(row_idx);
        Enclosure::dot(row.iter(), x.iter().map(|&x| Enclosure::exact(x))).upper <= P.b[row_idx]
    })
}
