//! Whole segments and plans on instances made by hand, and against brute force.

mod brute_force;
mod hand_instances;
mod leaf_cuts;

use crate::options::Options;
use crate::search::Found;
use crate::segment::{SegmentOutcome, solve_segment};
use convex_sets::HPolyhedron;
use manipulation::{Manipulation, Outer, PathMode};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::{Space, Task};

/// {q : lower ≤ q ≤ upper}.
fn cuboid(lower: &[f64], upper: &[f64]) -> HPolyhedron {
    HPolyhedron::from_box(&DVector::from_column_slice(lower), &DVector::from_column_slice(upper))
}

/// `P` with further faces `a·q ≤ b`, scaled to unit normals.
fn with_faces(P: HPolyhedron, faces: &[(&[f64], f64)]) -> HPolyhedron {
    let mut A = DMatrix::zeros(faces.len(), P.ambient_dimension());
    let mut b = DVector::zeros(faces.len());
    for (row_idx, (a, offset)) in faces.iter().enumerate() {
        let a = DVector::from_column_slice(a);
        A.set_row(row_idx, &(&a / a.norm()).transpose());
        b[row_idx] = offset / a.norm();
    }
    P.intersection(&HPolyhedron { A, b })
}

/// Spaces over `regions` in the box [-10, 10]^n, CG = CP = the box, with these kept forms.
fn manipulation(regions: &[HPolyhedron], transit: &[&[f64]], transfer: &[&[f64]]) -> Manipulation {
    let n = regions[0].ambient_dimension();
    let bounds = Outer { lower: DVector::repeat(n, -10.0), upper: DVector::repeat(n, 10.0) };
    let space = Space { lower: bounds.lower.clone(), upper: bounds.upper.clone(), rows: Vec::new() };
    let forms = |forms: &[&[f64]]| forms.iter().map(|form| DVector::from_column_slice(form)).collect();
    let task = Task {
        name: "task".into(),
        start: DVector::zeros(n),
        goal: DVector::zeros(n),
        max_grasps: 1,
        clearance: 0.0,
        grasp: space.clone(),
        placement: space,
        transfer_keep: forms(transfer),
        transit_keep: forms(transit),
    };
    Manipulation::from_parts(bounds, &task, regions).unwrap()
}

/// Options that close the gap of small instances.
fn thorough() -> Options {
    Options { tol_gap: 1e-5, max_nodes: 60, ..Options::default() }
}

fn solve(manipulation: &Manipulation, mode: PathMode, s: &[f64], g: &[f64]) -> SegmentOutcome {
    let (s, g) = (DVector::from_column_slice(s), DVector::from_column_slice(g));
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    solve_segment(manipulation, mode, &s, &g, &thorough(), &mut rng, &|| false)
}

/// The path of a segment that has one, checked: ends, faces, kept forms, bound.
fn found(manipulation: &Manipulation, mode: PathMode, s: &[f64], g: &[f64]) -> Found {
    let outcome = solve(manipulation, mode, s, g);
    let SegmentOutcome::Found(found) = outcome else { panic!("{outcome:?}") };
    assert_eq!(found.path.points[0].as_slice(), s);
    assert_eq!(found.path.points.last().unwrap().as_slice(), g);
    let frame =
        crate::leaf_frame::LeafFrame::new(manipulation.kept_forms(mode), &DVector::from_column_slice(s));
    assert!(found.path.is_verified(manipulation.free(mode), &frame));
    assert!(found.lower_bound <= found.path.length());
    found
}
