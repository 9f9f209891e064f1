//! Instances whose shortest length follows from a drawing.

use super::{cuboid, found, manipulation, solve, with_faces};
use crate::leaf_frame::LeafFrame;
use crate::segment::{SegmentOutcome, pieces};
use manipulation::PathMode::{Transfer, Transit};
use nalgebra::DVector;

/// Largest difference of a length from that of the drawing: bends stand off corners by the margin.
const TOL_LENGTH: f64 = 1e-7;

fn assert_length(found: &crate::Found, length: f64) {
    let got = found.path.length();
    assert!((got - length).abs() < TOL_LENGTH, "length {got}, expected {length}");
    assert!(found.lower_bound <= length + 1e-12, "bound {} above {length}", found.lower_bound);
    assert!(found.lower_bound > length - 1e-4 * length, "bound {} far below {length}", found.lower_bound);
}

#[test]
fn one_region_is_a_straight_line() {
    let spaces = manipulation(&[cuboid(&[0.0, 0.0], &[3.0, 4.0])], &[], &[]);
    let found = found(&spaces, Transit, &[0.0, 0.0], &[3.0, 4.0]);
    assert_eq!(found.path.regions, [0]);
    assert_eq!(found.path.length(), 5.0);
    assert!(found.lower_bound <= 5.0 && found.lower_bound > 5.0 - 1e-14);
}

#[test]
fn a_line_through_several_regions_stays_straight() {
    let regions: Vec<_> = (0..4).map(|k| cuboid(&[k as f64, 0.0], &[k as f64 + 1.5, 1.0])).collect();
    let spaces = manipulation(&regions, &[], &[]);
    let found = found(&spaces, Transit, &[0.25, 0.5], &[4.25, 0.75]);
    assert_eq!(found.path.regions, [0, 1, 2, 3]);
    assert_eq!(found.n_relaxations, 0);
    assert_length(&found, 4.0_f64.hypot(0.25));
}

/// Two legs of an L meet at the corner (1, 1).
#[test]
fn around_a_corner() {
    let spaces =
        manipulation(&[cuboid(&[0.0, 0.0], &[1.0, 3.0]), cuboid(&[0.0, 0.0], &[3.0, 1.0])], &[], &[]);
    let found = found(&spaces, Transit, &[0.5, 2.5], &[2.5, 0.5]);
    assert_eq!(found.path.regions, [0, 1]);
    assert_length(&found, 2.0 * 0.5_f64.hypot(1.5));
}

/// A ring about the square [1, 2]²: below the way is shorter than above.
#[test]
fn the_shorter_way_round() {
    let regions = [
        cuboid(&[0.0, 0.0], &[1.0, 3.0]),
        cuboid(&[2.0, 0.0], &[3.0, 3.0]),
        cuboid(&[0.0, 0.0], &[3.0, 1.0]),
        cuboid(&[0.0, 2.0], &[3.0, 3.0]),
    ];
    let spaces = manipulation(&regions, &[], &[]);
    let below = found(&spaces, Transit, &[0.5, 1.25], &[2.5, 1.25]);
    assert_eq!(below.path.regions, [0, 2, 1]);
    assert_length(&below, 1.0 + 2.0 * 0.5_f64.hypot(0.25));
    let above = found(&spaces, Transit, &[0.5, 1.75], &[2.5, 1.75]);
    assert_eq!(above.path.regions, [0, 3, 1]);
    assert_length(&above, 1.0 + 2.0 * 0.5_f64.hypot(0.25));
}

/// A corridor with three turns, and regions beside it that lead nowhere.
#[test]
fn a_corridor_with_dead_ends() {
    let regions = [
        cuboid(&[0.0, 0.0], &[1.0, 5.0]),
        cuboid(&[0.0, 4.0], &[5.0, 5.0]),
        cuboid(&[4.0, 0.0], &[5.0, 5.0]),
        cuboid(&[-5.0, 4.5], &[0.5, 6.0]),
        cuboid(&[4.5, 4.5], &[8.0, 8.0]),
    ];
    let spaces = manipulation(&regions, &[], &[]);
    let found = found(&spaces, Transit, &[0.5, 0.5], &[4.5, 0.5]);
    assert_eq!(found.path.regions, [0, 1, 2]);
    assert_length(&found, 2.0 * 0.5_f64.hypot(3.5) + 3.0);
}

/// Thesis 2, eq. 5.5: (cap, gripper, left_finger); the transfer turns cap and gripper together, the transit turns the
/// gripper and must open the finger between -1 and 1.
#[test]
fn eq_5_5_modes_hold_at_every_control_point() {
    let open = cuboid(&[-3.0, -2.0, -0.05], &[3.0, 2.0, -0.04]);
    let left = cuboid(&[-3.0, -2.0, -0.05], &[3.0, -1.0, -0.02]);
    let right = cuboid(&[-3.0, 1.0, -0.05], &[3.0, 2.0, -0.02]);
    let spaces =
        manipulation(&[open, left, right], &[&[1.0, 0.0, 0.0]], &[&[-1.0, 1.0, 0.0], &[0.0, 0.0, 1.0]]);
    let (s, g) = ([-2.7, -1.5, -0.0245], [-2.7, 1.5, -0.0245]);
    let transit = found(&spaces, Transit, &s, &g);
    assert_length(&transit, 2.0 + 2.0 * 0.5_f64.hypot(0.0155));
    assert!(transit.path.points.iter().all(|q| q[0] == -2.7));
    for order in 1..=4 {
        let curves = pieces(&transit.path, &spaces, Transit, order);
        assert!(curves.iter().all(|piece| piece.len() == order + 1));
        assert!(curves.windows(2).all(|pair| pair[0].last() == pair[1].first()));
        assert!(curves.iter().flatten().all(|q| q[0] == -2.7));
        assert_eq!((&curves[0][0][..], &curves.last().unwrap()[order][..]), (&s[..], &g[..]));
    }
    // gripper - cap = 1.25 and the finger at -0.045, in the open region.
    let transfer = found(&spaces, Transfer, &[-2.5, -1.25, -0.045], &[-0.5, 0.75, -0.045]);
    assert_length(&transfer, 8.0_f64.sqrt());
    let frame = LeafFrame::new(spaces.kept_forms(Transfer), &transfer.path.points[0]);
    assert!(transfer.path.points.iter().all(|q| frame.keeps_forms(q)));
}

/// In three dimensions the shortest way over an edge is found by unfolding: both walls meet at x = 1, the bend lies
/// half way in z.
#[test]
fn over_an_edge_in_three_dimensions() {
    let regions = [cuboid(&[0.0, 0.0, 0.0], &[1.0, 3.0, 4.0]), cuboid(&[0.0, 0.0, 0.0], &[3.0, 1.0, 4.0])];
    let spaces = manipulation(&regions, &[], &[]);
    let found = found(&spaces, Transit, &[0.5, 2.5, 1.0], &[2.5, 0.5, 3.0]);
    assert_length(&found, (2.0 * 0.5_f64.hypot(1.5)).hypot(2.0));
    assert!((found.path.points[1][2] - 2.0).abs() < 1e-3);
}

/// Regions that overlap many times over: the straight line is blocked by a triangle whose tip is at (2, 1).
#[test]
fn over_a_tip_with_many_regions() {
    // Above the triangle (0, 0), (4, 0), (2, 1): left half-plane y ≥ x / 2, right half-plane y ≥ 2 − x / 2.
    let ceiling = cuboid(&[0.0, 0.0], &[4.0, 3.0]);
    let left = with_faces(ceiling.clone(), &[(&[0.5, -1.0], 0.0)]);
    let right = with_faces(ceiling.clone(), &[(&[-0.5, -1.0], -2.0)]);
    let mut regions = vec![left, right];
    for k in 0..8 {
        regions.push(cuboid(&[0.3 * k as f64, 1.0], &[1.5 + 0.3 * k as f64, 3.0]));
    }
    let spaces = manipulation(&regions, &[], &[]);
    let found = found(&spaces, Transit, &[0.5, 0.3], &[3.5, 0.3]);
    assert_length(&found, 2.0 * 1.5_f64.hypot(0.7));
}

#[test]
fn no_motion_is_a_path_of_no_length() {
    let spaces = manipulation(&[cuboid(&[0.0], &[1.0])], &[&[1.0]], &[]);
    let found = found(&spaces, Transit, &[0.5], &[0.5]);
    assert_eq!((found.path.length(), found.lower_bound), (0.0, 0.0));
}

/// Forms that no elimination keeps exact: the leaf is kept by rows.
#[test]
fn forms_with_coefficients_that_round() {
    let regions = [cuboid(&[0.0, 0.0, 0.0], &[1.0, 3.0, 3.0]), cuboid(&[0.0, 0.0, 0.0], &[3.0, 1.0, 3.0])];
    let form = [0.3, 0.3, 0.7];
    let spaces = manipulation(&regions, &[&form], &[]);
    let s = [0.5, 2.5, 1.0];
    let found = found(&spaces, Transit, &s, &[2.5, 0.5, 1.0]);
    let value = |q: &DVector<f64>| q.iter().zip(&form).map(|(q, f)| q * f).sum::<f64>();
    let kept = value(&DVector::from_column_slice(&s));
    assert!(found.path.points.iter().all(|q| (value(q) - kept).abs() < 1e-12));
    // Without the form the bend would be (1, 1, 1); with it z rises by 0.3 (2.5 + 0.5 − 2) / 0.7 = 3/7 there.
    let expected = 2.0 * 0.5_f64.hypot(1.5).hypot(3.0 / 7.0);
    assert!((found.path.length() - expected).abs() < 1e-6, "{}", found.path.length());
    assert!(found.lower_bound <= expected && found.lower_bound > 0.99 * expected);
}

#[test]
fn a_configuration_outside_of_all_regions_is_named() {
    let spaces = manipulation(&[cuboid(&[0.0, 0.0], &[1.0, 1.0])], &[], &[]);
    assert_eq!(solve(&spaces, Transit, &[1.5, 0.5], &[0.5, 0.5]), SegmentOutcome::StartOutside);
    assert_eq!(solve(&spaces, Transit, &[0.5, 0.5], &[0.5, -0.5]), SegmentOutcome::GoalOutside);
}
