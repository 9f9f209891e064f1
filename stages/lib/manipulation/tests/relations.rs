//! Overlaps, leaves and containment on polytopes known by hand.

use convex_sets::HPolyhedron;
use manipulation::{
    Emptiness, Leaf, Manipulation, ManipulationError, Outer, Overlap, PathMode, contains_exactly, overlap_of,
    overlap_of_all, proven_box, proven_contained, proven_empty, proven_maximum, reached_in_leaf,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use scene::{BoundedRow, Space, Task};

fn vector(x: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(x)
}

fn outer(n: usize) -> Outer {
    Outer { lower: DVector::zeros(n), upper: DVector::repeat(n, 1.0) }
}

fn half_space(a: &[f64], b: f64) -> HPolyhedron {
    HPolyhedron { A: DMatrix::from_row_slice(1, a.len(), a), b: vector(&[b]) }
}

#[test]
fn overlaps_are_interior_undecided_or_empty() {
    let left = half_space(&[1.0, 0.0], 0.5);
    let right = |from: f64| half_space(&[-1.0, 0.0], -from);
    assert!(overlap_of(&left, &right(0.4), &outer(2)).is_interior());
    assert_eq!(overlap_of(&left, &right(0.5), &outer(2)), Overlap::Undecided);
    assert_eq!(overlap_of(&left, &right(0.5 + 1e-7), &outer(2)), Overlap::Empty);
}

#[test]
fn emptiness_is_claimed_with_proof_only() {
    let touching = half_space(&[1.0, 1.0], 0.0);
    assert_ne!(proven_empty(&touching, &outer(2)), Emptiness::Empty);
    assert_eq!(proven_empty(&half_space(&[1.0, 1.0], -1e-9), &outer(2)), Emptiness::Empty);
}

#[test]
fn proven_maxima_are_not_below_the_truth_and_close_to_it() {
    let P = half_space(&[3.0, 1.0], 1.0);
    let maximum = proven_maximum(&vector(&[1.0, 1.0]), &P, &outer(2));
    // x = 0, y = 1.
    assert!((1.0..1.0 + 1e-9).contains(&maximum), "{maximum}");
    let enclosing = proven_box(&P, &outer(2)).unwrap();
    assert!(enclosing.upper[0] >= 1.0 / 3.0 && enclosing.upper[0] < 0.34);
    assert!(proven_box(&half_space(&[1.0, 0.0], -0.1), &outer(2)).is_none());
}

#[test]
fn containment_both_ways() {
    let small = half_space(&[1.0, 1.0], 0.5);
    let large = half_space(&[1.0, 0.0], 0.6);
    assert!(proven_contained(&small, &large, &outer(2)));
    assert!(!proven_contained(&large, &small, &outer(2)));
    assert!(contains_exactly(&large, &vector(&[0.6, 1.0])));
    assert!(!contains_exactly(&large, &vector(&[0.6f64.next_up(), 1.0])));
}

/// A and B overlap, but in the leaf c = const only for c ≤ 0.3.
#[test]
fn a_leaf_reaches_less_than_the_connected_region() {
    let polytopes = [Some(half_space(&[1.0, 1.0], 0.6)), Some(half_space(&[1.0, -1.0], 0.0)), None];
    let overlaps = overlap_of_all(&polytopes, &outer(2));
    let F = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
    let reached = |c: f64| {
        let leaf = Leaf::through(&F, &vector(&[c, 0.1]));
        reached_in_leaf(&polytopes, &overlaps, &leaf, 0.0, &[0], &outer(2))
    };
    assert_eq!(reached(0.29), [0, 1]);
    assert_eq!(reached(0.31), [0]);
    assert_eq!(overlaps.exits(&[0]), [(0, 1)]);
    assert_eq!(overlaps.exits(&[1]), [(1, 0)]);
    assert!(overlaps.exits(&[0, 1]).is_empty());
}

fn slider_task() -> Task {
    let whole = Space { lower: vector(&[0.0, 0.0]), upper: vector(&[1.0, 1.0]), rows: Vec::new() };
    let mut grasp = whole.clone();
    grasp.rows.push(BoundedRow { form: vector(&[1.0, -1.0]), lower: -0.1, upper: 0.1 });
    Task {
        name: "push".to_owned(),
        start: vector(&[0.1, 0.5]),
        goal: vector(&[0.9, 0.5]),
        max_grasps: 2,
        clearance: 0.0,
        grasp,
        placement: whole,
        transfer_keep: vec![vector(&[1.0, -1.0])],
        transit_keep: vec![vector(&[1.0, 0.0])],
    }
}

#[test]
fn eq_5_2_5_3_intersections_with_the_regions() {
    let box_of = |lower: &[f64], upper: &[f64]| HPolyhedron::from_box(&vector(lower), &vector(upper));
    let regions = [
        box_of(&[0.0, 0.0], &[0.5, 0.5]),
        box_of(&[0.4, 0.0], &[1.0, 0.2]),
        box_of(&[0.9, 0.1], &[1.0, 1.0]),
        box_of(&[0.0, 0.8], &[0.2, 1.0]),
    ];
    let sets = Manipulation::from_parts(outer(2), &slider_task(), &regions).unwrap();
    let present: Vec<bool> = sets.grasp_free.iter().map(Option::is_some).collect();
    // |c - r| ≤ 0.1 meets the first and the third region.
    assert_eq!(present, [true, false, true, false]);
    assert!(sets.placement_free.iter().all(Option::is_some));
    assert_eq!(sets.placement_regions.members, [vec![0, 1, 2], vec![3]]);
    assert_eq!(sets.grasp_regions.members, [vec![0], vec![2]]);
    assert_eq!(sets.interior_regions(PathMode::Transit).members, [vec![0, 1, 2], vec![3]]);
    assert_eq!(sets.kept_forms(PathMode::Transfer), &DMatrix::from_row_slice(1, 2, &[1.0, -1.0]));
    assert_eq!(sets.leaf(PathMode::Transit, &vector(&[0.25, 0.5])).values, vector(&[0.25]));
}

#[test]
fn regions_of_another_scene_are_refused() {
    let cube = HPolyhedron::from_box(&DVector::zeros(3), &DVector::repeat(3, 1.0));
    let error = Manipulation::from_parts(outer(2), &slider_task(), &[cube]).unwrap_err();
    assert_eq!(error, ManipulationError::RegionDimension { region_idx: 0, found: 3, expected: 2 });
    let broken = half_space(&[f64::NAN, 0.0], 1.0);
    let error = Manipulation::from_parts(outer(2), &slider_task(), &[broken]).unwrap_err();
    assert!(matches!(error, ManipulationError::RegionMalformed { region_idx: 0, .. }));
}

proptest! {
    /// Two polytopes with a common point are never called disjoint, and the point is reached in its leaf.
    #[test]
    fn a_common_point_is_never_proven_away(
        point in proptest::collection::vec(0.0..1.0_f64, 3),
        rows in proptest::collection::vec(proptest::collection::vec(-1.0..1.0_f64, 3), 2..10),
        slack in 0.0..1e-6_f64,
    ) {
        let x = vector(&point);
        let faces = |rows: &[Vec<f64>]| {
            let A = DMatrix::from_fn(rows.len(), 3, |row, k| rows[row][k]);
            let b = (&A * &x).add_scalar(slack + 1e-12);
            HPolyhedron { A, b }
        };
        let (first, second) = rows.split_at(rows.len() / 2);
        let polytopes = [Some(faces(first)), Some(faces(second))];
        let overlaps = overlap_of_all(&polytopes, &outer(3));
        prop_assert!(overlaps.get(0, 1).is_open());
        let leaf = Leaf::through(&DMatrix::from_row_slice(1, 3, &[1.0, 0.0, 0.0]), &x);
        prop_assert_eq!(reached_in_leaf(&polytopes, &overlaps, &leaf, 0.0, &[0], &outer(3)), vec![0, 1]);
    }

    /// The center of an interior overlap lies in both, with room.
    #[test]
    fn interior_centers_are_inside_both(
        rows in proptest::collection::vec(proptest::collection::vec(-1.0..1.0_f64, 3), 4),
        offsets in proptest::collection::vec(-0.2..0.8_f64, 4),
    ) {
        let faces = |from: usize| HPolyhedron {
            A: DMatrix::from_fn(2, 3, |row, k| rows[from + row][k]),
            b: vector(&offsets[from..from + 2]),
        };
        let (P, other) = (faces(0), faces(2));
        if let Overlap::Interior(center) = overlap_of(&P, &other, &outer(3)) {
            prop_assert!(P.contains(&center, 0.0) && other.contains(&center, 0.0));
            prop_assert!(center.iter().all(|x| (0.0..=1.0).contains(x)));
        }
    }
}
