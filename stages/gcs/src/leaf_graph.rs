//! The graph of convex sets of one segment: polytopes restricted to the leaf, and which of them overlap there.
//!
//! In the coordinates u of the leaf (q = s + B u) the polytope {q : A q ≤ b} is {u : (A B) u ≤ b − A s}. The rows are
//! rounded such that they hold on the whole exact set: what is proven empty here has no point on the leaf, and a
//! programme over these rows bounds from below. Paths are verified against the original rows.

use crate::leaf_frame::LeafFrame;
use conic::RoundedSum;
use convex_sets::HPolyhedron;
use convex_sets::lp::{self, LpOutcome};
use manipulation::{Enclosure, Manipulation, Outer, PathMode, contains_exactly, proven_box};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// A ball of this radius, in units of u, must fit into an overlap that a path uses. Erring side: a larger value
/// misses thin overlaps, a smaller one leaves no room to round bends into the inside.
pub const TOL_USABLE: f64 = 4e-9;

/// Where a configuration lies relative to a polytope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// Proven inside (the faces included).
    Inside,
    /// Within rounding of a face.
    Undecided,
    /// Proven outside.
    Outside,
}

/// A polytope restricted to the leaf.
#[derive(Debug, Clone)]
pub struct LeafVertex {
    /// Position of the region in the list of regions.
    pub region_idx: usize,
    /// {u : A u ≤ b}, without redundant rows.
    pub polytope: HPolyhedron,
    /// Where the start lies.
    pub start: Contact,
    /// Where the goal lies.
    pub goal: Contact,
}

/// Overlap of two vertices inside the leaf. Pairs that are proven empty are not listed.
#[derive(Debug, Clone, PartialEq)]
pub enum LeafOverlap {
    /// Not proven empty, but too thin for a path.
    Undecided,
    /// A path may pass: a ball about this u lies in both.
    Usable(DVector<f64>),
}

/// Vertices and overlaps inside the leaf of one segment.
#[derive(Debug, Clone)]
pub struct LeafGraph {
    /// Coordinates of the leaf.
    pub frame: LeafFrame,
    /// Goal of the segment in these coordinates [d].
    pub u_goal: DVector<f64>,
    /// g − s [n].
    pub shift_to_goal: DVector<f64>,
    /// Box that holds u of every configuration within the joint limits.
    pub u_lower: DVector<f64>,
    /// Upper corner of that box.
    pub u_upper: DVector<f64>,
    /// {u : F B u = 0 within rounding} if the frame could not eliminate the kept forms; else without rows.
    pub slab: HPolyhedron,
    /// Vertices, by position of their region; polytopes proven empty are left out.
    pub vertices: Vec<LeafVertex>,
    /// Overlaps of vertices (a, b), a < b, by position in `vertices`.
    pub overlaps: BTreeMap<(usize, usize), LeafOverlap>,
}

impl LeafGraph {
    /// The graph of the leaf of `mode` through `s`, with goal `g`. The kept forms of both agree.
    pub fn new(manipulation: &Manipulation, mode: PathMode, frame: LeafFrame, g: &DVector<f64>) -> Self {
        let (u_lower, u_upper) = u_box(&frame, manipulation, g);
        let slab = slab(&frame, g);
        let mut vertices = Vec::new();
        for (region_idx, P) in manipulation.free(mode).iter().enumerate() {
            let Some(P) = P else { continue };
            let Some(polytope) = restricted(P, &frame, &u_lower, &u_upper) else { continue };
            if proven_empty(&polytope.intersection(&slab), &u_lower, &u_upper) {
                continue;
            }
            let polytope = polytope.remove_redundant().unwrap_or(polytope);
            vertices.push(LeafVertex {
                region_idx,
                polytope,
                start: contact(P, &frame.s),
                goal: contact(P, g),
            });
        }
        let global = manipulation.overlaps(mode);
        let mut overlaps = BTreeMap::new();
        for a in 0..vertices.len() {
            for b in a + 1..vertices.len() {
                if !global.get(vertices[a].region_idx, vertices[b].region_idx).is_open() {
                    continue;
                }
                let both = vertices[a].polytope.intersection(&vertices[b].polytope);
                if let Some(overlap) = overlap(&both, &slab, &u_lower, &u_upper) {
                    overlaps.insert((a, b), overlap);
                }
            }
        }
        let (u_goal, shift_to_goal) = (frame.u_of(g), g - &frame.s);
        Self { frame, u_goal, shift_to_goal, u_lower, u_upper, slab, vertices, overlaps }
    }

    /// What is known of the overlap of vertices `a` and `b`; `None` if it is proven empty.
    pub fn overlap(&self, a: usize, b: usize) -> Option<&LeafOverlap> {
        self.overlaps.get(&(a.min(b), a.max(b)))
    }

    /// A point of the overlap's inside, if a path may use it.
    pub fn usable(&self, a: usize, b: usize) -> Option<&DVector<f64>> {
        match self.overlap(a, b) {
            Some(LeafOverlap::Usable(center)) => Some(center),
            Some(LeafOverlap::Undecided) | None => None,
        }
    }

    /// Vertices that cannot be excluded to be reached from the start; sorted.
    pub fn reached(&self) -> Vec<usize> {
        let from_start = |v: &usize| self.vertices[*v].start != Contact::Outside;
        let mut queue: Vec<usize> = (0..self.vertices.len()).filter(from_start).collect();
        let mut reached = vec![false; self.vertices.len()];
        queue.iter().for_each(|&v| reached[v] = true);
        while let Some(a) = queue.pop() {
            for b in 0..self.vertices.len() {
                if !reached[b] && self.overlap(a, b).is_some() {
                    reached[b] = true;
                    queue.push(b);
                }
            }
        }
        (0..self.vertices.len()).filter(|&v| reached[v]).collect()
    }
}

/// Box of u for q in the joint box, rounded outward; it holds the goal too.
fn u_box(frame: &LeafFrame, manipulation: &Manipulation, g: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
    let joint_box = &manipulation.joint_box;
    let side = |bound: &DVector<f64>, outward: fn(f64) -> f64, widest: fn(f64, f64) -> f64| {
        DVector::from_fn(frame.dimension(), |k, _| {
            let j = frame.free_coordinate(k);
            let to_bound = outward(bound[j] - frame.s[j]);
            widest(widest(to_bound, outward(g[j] - frame.s[j])), 0.0)
        })
    };
    (side(&joint_box.lower, f64::next_down, f64::min), side(&joint_box.upper, f64::next_up, f64::max))
}

/// ±F u ≤ the difference that start and goal have by rounding.
fn slab(frame: &LeafFrame, g: &DVector<f64>) -> HPolyhedron {
    let d = frame.dimension();
    if frame.eliminated {
        return HPolyhedron { A: DMatrix::zeros(0, d), b: DVector::zeros(0) };
    }
    let k = frame.F.nrows();
    let mut A = DMatrix::zeros(2 * k, d);
    A.rows_mut(0, k).copy_from(&frame.F);
    A.rows_mut(k, k).copy_from(&-&frame.F);
    let difference = &frame.F * (g - &frame.s);
    let b = DVector::from_fn(2 * k, |row_idx, _| 2.0 * difference[row_idx % k].abs() + 1e-15);
    HPolyhedron { A, b }
}

/// {u : A (s + B u) ≤ b}, rounded outward over the box of u; `None` if a row is proven to exclude all of the leaf.
fn restricted(
    P: &HPolyhedron,
    frame: &LeafFrame,
    u_lower: &DVector<f64>,
    u_upper: &DVector<f64>,
) -> Option<HPolyhedron> {
    let (n, d) = (P.ambient_dimension(), frame.dimension());
    let mut rows: Vec<DVector<f64>> = Vec::new();
    let mut offsets = Vec::new();
    for row_idx in 0..P.n_faces() {
        let mut offset = RoundedSum::default();
        offset.add(P.b[row_idx]);
        for j in 0..n {
            if P.A[(row_idx, j)] != 0.0 {
                offset.add_product(-P.A[(row_idx, j)], frame.s[j]);
            }
        }
        let mut row = DVector::zeros(d);
        for k in 0..d {
            let mut coefficient = RoundedSum::default();
            for j in 0..n {
                if P.A[(row_idx, j)] != 0.0 && frame.B[(j, k)] != 0.0 {
                    coefficient.add_product(P.A[(row_idx, j)], frame.B[(j, k)]);
                }
            }
            if coefficient == RoundedSum::default() {
                continue;
            }
            // What the rounded coefficient may be off by, times the largest |u_k|, goes into the offset; a
            // coefficient that may be zero is taken to be.
            let (low, high) = (coefficient.lower(), coefficient.upper());
            row[k] = if low <= 0.0 && 0.0 <= high { 0.0 } else { coefficient.value() };
            let error = (high - row[k]).max(row[k] - low).next_up();
            offset.add_product(error, u_lower[k].abs().max(u_upper[k].abs()));
        }
        let offset = offset.upper();
        if row.iter().all(|&c| c == 0.0) {
            if offset < 0.0 {
                return None;
            }
            continue;
        }
        rows.push(row);
        offsets.push(offset);
    }
    let mut A = DMatrix::zeros(rows.len(), d);
    for (row_idx, row) in rows.iter().enumerate() {
        A.set_row(row_idx, &row.transpose());
    }
    Some(HPolyhedron { A, b: DVector::from_vec(offsets) })
}

fn proven_empty(P: &HPolyhedron, u_lower: &DVector<f64>, u_upper: &DVector<f64>) -> bool {
    if u_lower.is_empty() {
        return false;
    }
    lp::minimize(&DVector::zeros(u_lower.len()), &P.A, &P.b, u_lower, u_upper).is_infeasible()
}

/// max r  s.t. a_i·u + ‖a_i‖ r ≤ b_i, F u = 0, r ≥ 0; `None` if even r = 0 is proven infeasible.
fn overlap(
    both: &HPolyhedron,
    slab: &HPolyhedron,
    u_lower: &DVector<f64>,
    u_upper: &DVector<f64>,
) -> Option<LeafOverlap> {
    let d = u_lower.len();
    if d == 0 {
        return Some(LeafOverlap::Undecided);
    }
    let m = both.n_faces();
    let rows = both.intersection(slab);
    let mut A = rows.A.clone().insert_column(d, 0.0);
    for row_idx in 0..m {
        A[(row_idx, d)] = both.A.row(row_idx).norm();
    }
    let widest = (u_upper - u_lower).amax().max(TOL_USABLE);
    let (lower, upper) = (u_lower.clone().push(0.0), u_upper.clone().push(widest));
    let mut c = DVector::zeros(d + 1);
    c[d] = -1.0;
    match lp::minimize(&c, &A, &rows.b, &lower, &upper) {
        LpOutcome::Infeasible { .. } => None,
        LpOutcome::Optimal { x, .. } if x[d] > TOL_USABLE => {
            Some(LeafOverlap::Usable(x.rows(0, d).into_owned()))
        }
        LpOutcome::Optimal { .. } | LpOutcome::Undecided { .. } => {
            (!proven_empty_closely(&rows, u_lower, u_upper)).then_some(LeafOverlap::Undecided)
        }
    }
}

/// Looks for a proof of emptiness in the smallest box about the rows, where the simplex method, whose tolerances are
/// relative to the box, sees smaller gaps. Rows that the box already contradicts are found on the way.
fn proven_empty_closely(rows: &HPolyhedron, u_lower: &DVector<f64>, u_upper: &DVector<f64>) -> bool {
    let mut within = Outer { lower: u_lower.clone(), upper: u_upper.clone() };
    // Bounds by single rows first: a gap in one coordinate is seen exactly.
    for row_idx in 0..rows.n_faces() {
        let mut entries = (0..u_lower.len()).filter(|&k| rows.A[(row_idx, k)] != 0.0);
        if let (Some(k), None) = (entries.next(), entries.next()) {
            let a = rows.A[(row_idx, k)];
            let bound = rows.b[row_idx] / a;
            if a > 0.0 {
                within.upper[k] = within.upper[k].min(bound.next_up());
            } else {
                within.lower[k] = within.lower[k].max(bound.next_down());
            }
        }
    }
    if (0..u_lower.len()).any(|k| within.lower[k] > within.upper[k]) {
        return true;
    }
    match proven_box(rows, &within) {
        None => true,
        Some(within) => proven_empty(rows, &within.lower, &within.upper),
    }
}

fn contact(P: &HPolyhedron, q: &DVector<f64>) -> Contact {
    if contains_exactly(P, q) {
        return Contact::Inside;
    }
    let outside = (0..P.n_faces()).any(|row_idx| {
        let row = P.A.row(row_idx);
        Enclosure::dot(row.iter(), q.iter().map(|&x| Enclosure::exact(x))).lower > P.b[row_idx]
    });
    if outside { Contact::Outside } else { Contact::Undecided }
}
