//! Boxes, balls, ellipsoids, redundancy, walks and volumes on sets known by hand.

use convex_sets::{HPolyhedron, HitAndRun, Hyperellipsoid, SetError, min_enclosing_ellipsoid};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

fn boxed(lower: &[f64], upper: &[f64]) -> HPolyhedron {
    HPolyhedron::from_box(&vector(lower), &vector(upper))
}

/// The grasp band of the bottle cap: radians beside a millimetre.
fn band() -> HPolyhedron {
    boxed(&[-1.0, -0.025], &[1.0, -0.024])
}

/// {x + y ≤ 1, x ≥ 0, y ≥ 0} without explicit upper bounds.
fn triangle() -> HPolyhedron {
    HPolyhedron {
        A: DMatrix::from_row_slice(3, 2, &[1.0, 1.0, -1.0, 0.0, 0.0, -1.0]),
        b: vector(&[1.0, 0.0, 0.0]),
    }
}

#[test]
fn bounding_box_of_a_triangle_and_of_what_is_no_bounded_set() {
    let bounds = triangle().bounding_box().unwrap();
    assert!((bounds.lower - vector(&[0.0, 0.0])).norm() < 1e-9);
    assert!((bounds.upper - vector(&[1.0, 1.0])).norm() < 1e-9);
    let half_plane = HPolyhedron { A: DMatrix::from_row_slice(1, 2, &[1.0, 1.0]), b: vector(&[1.0]) };
    assert!(matches!(half_plane.bounding_box(), Err(SetError::Unbounded { .. })));
    let nothing = triangle().intersection(&boxed(&[0.9, 0.9], &[2.0, 2.0]));
    assert_eq!(nothing.bounding_box(), Err(SetError::Empty));
    assert!(nothing.is_empty() && !triangle().is_empty());
}

#[test]
fn boyd_8_5_1_chebyshev_ball_of_a_triangle() {
    let ball = triangle().chebyshev_center().unwrap();
    let radius = 1.0 / (2.0 + 2.0_f64.sqrt());
    assert!((ball.radius - radius).abs() < 1e-9);
    assert!((ball.center - vector(&[radius, radius])).norm() < 1e-8);
}

#[test]
fn interior_point_is_in_units_of_the_set() {
    let inside = band().interior_point().unwrap();
    assert!((inside.radius - 1.0).abs() < 1e-9);
    assert!((inside.center[1] + 0.0245).abs() < 1e-12);
    assert_eq!(boxed(&[0.0, 1.0], &[1.0, 1.0]).interior_point(), Err(SetError::NoInterior));
}

#[test]
fn overlap_has_interior_or_not() {
    let left = boxed(&[0.0, -0.025], &[0.5, -0.024]);
    for (start, expected) in [(0.4999, true), (0.5, false), (0.5001, false)] {
        let right = boxed(&[start, -0.025], &[1.0, -0.024]);
        assert_eq!(left.interior_intersects(&right), expected, "from {start}");
        assert_eq!(right.interior_intersects(&left), expected, "from {start}");
    }
    // A layer of 1 µm shared with the band.
    assert!(band().interior_intersects(&boxed(&[-1.0, -0.055], &[1.0, -0.024999])));
    assert!(!band().interior_intersects(&boxed(&[-1.0, -0.055], &[1.0, -0.025])));
}

#[test]
fn redundant_faces_go_and_the_set_stays() {
    let P = boxed(&[0.0, 0.0], &[1.0, 1.0]);
    let more = HPolyhedron {
        A: DMatrix::from_row_slice(5, 2, &[1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0]),
        b: vector(&[1.5, 1.6, 1.0, 2.0, 2.0]),
    };
    let kept = P.intersection(&more).remove_redundant().unwrap();
    assert_eq!(kept.n_faces(), 5, "{kept:?}");
    assert_eq!(P.intersection(&more).remove_redundant_keeping(4).unwrap().n_faces(), 5);
    assert!(!kept.contains(&vector(&[0.9, 0.9]), 0.0));
    assert!(kept.contains(&vector(&[0.9, 0.55]), 0.0));
    // All four limits stay although the added row implies one of them.
    let tight =
        P.intersection(&HPolyhedron { A: DMatrix::from_row_slice(1, 2, &[1.0, 0.0]), b: vector(&[0.5]) });
    assert_eq!(tight.remove_redundant().unwrap().n_faces(), 4);
    assert_eq!(tight.remove_redundant_keeping(4).unwrap().n_faces(), 5);
}

#[test]
fn boyd_8_4_2_ellipsoid_in_box_and_triangle() {
    let E = band().max_inscribed_ellipsoid().unwrap();
    assert!((&E.center - vector(&[0.0, -0.0245])).norm() < 1e-4);
    let C = E.image_of_ball().unwrap();
    let semi_axes = (&C * C.transpose()).map(f64::sqrt);
    assert!((semi_axes[(0, 0)] - 1.0).abs() < 2e-3, "{semi_axes}");
    assert!((semi_axes[(1, 1)] - 0.0005).abs() < 1e-6, "{semi_axes}");
    // Steiner's inellipse: area π / (3 √3) of the triangle's, center at the centroid.
    let E = triangle().max_inscribed_ellipsoid().unwrap();
    assert!((&E.center - vector(&[1.0 / 3.0, 1.0 / 3.0])).norm() < 1e-3);
    assert!((E.relative_volume() - 0.5 / (3.0 * 3.0_f64.sqrt())).abs() < 1e-4, "{}", E.relative_volume());
}

#[test]
fn khachiyan_ellipse_around_a_square_and_around_two_points() {
    let square: Vec<_> =
        [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].iter().map(|p| vector(p)).collect();
    let E = min_enclosing_ellipsoid(&square, 1e-6).unwrap();
    assert!(E.center.norm() < 0.05);
    assert!((E.relative_volume() - 2.0).abs() < 0.05, "{}", E.relative_volume());
    let segment = [vector(&[0.0, 0.0]), vector(&[1.0, 0.0])];
    let E = min_enclosing_ellipsoid(&segment, 0.01).unwrap();
    assert!(segment.iter().all(|p| E.distance(p) <= 1.0 + 1e-9));
    assert!(E.relative_volume() < 0.02, "{}", E.relative_volume());
    assert!(min_enclosing_ellipsoid(&[], 0.01).is_none());
}

#[test]
fn walk_is_nearly_uniform_in_a_thin_triangle() {
    let mut A = triangle().A;
    A.column_mut(1).unscale_mut(1e-3);
    let thin = HPolyhedron { A, b: triangle().b };
    let E = thin.max_inscribed_ellipsoid().unwrap();
    let mut walk = HitAndRun::new(&thin, &E.center, E.image_of_ball().unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (n, mut mean, mut n_near) = (40_000, vector(&[0.0, 0.0]), 0);
    for _ in 0..n {
        let chord = walk.step(&mut rng);
        assert!(chord.t_min <= 0.0 && chord.t_max >= 0.0);
        let x = vector(walk.point());
        assert!(thin.contains(&x, 1e-9));
        n_near += usize::from(x[0] < 0.5);
        mean += x / n as f64;
    }
    assert!((mean - vector(&[1.0 / 3.0, 1e-3 / 3.0])).norm() < 0.01);
    assert!((n_near as f64 / n as f64 - 0.75).abs() < 0.02);
}

#[test]
fn volume_of_a_triangle() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let estimate = triangle().estimate_volume(20_000, &mut rng).unwrap();
    assert!((estimate.volume - 0.5).abs() < 5.0 * estimate.standard_error);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    /// Random cuts through a box in mixed units: what each operation promises, by sampling.
    #[test]
    fn random_polyhedra_in_mixed_units(seed in 0_u64..100_000, n in 2_usize..5, n_cuts in 0_usize..25) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let units = [1.0, 1e-3, 3.0, 0.05];
        let lower = DVector::from_fn(n, |j, _| -units[j] + 0.1);
        let upper = DVector::from_fn(n, |j, _| units[j] + 0.1);
        let cuts = HPolyhedron {
            A: DMatrix::from_fn(n_cuts, n, |_, j| (rng.random::<f64>() - 0.5) / units[j]),
            b: DVector::zeros(n_cuts),
        };
        let b = DVector::from_fn(n_cuts, |i, _| {
            cuts.A.row(i).iter().sum::<f64>() * 0.1 + 0.05 + 0.6 * rng.random::<f64>()
        });
        let P = HPolyhedron::from_box(&lower, &upper)
            .intersection(&HPolyhedron { A: cuts.A, b })
            .with_unit_rows()
            .unwrap();
        let reduced = P.remove_redundant().unwrap();
        prop_assert!(reduced.n_faces() <= P.n_faces());
        let bounds = P.bounding_box().unwrap();
        let inside = P.interior_point().unwrap();
        prop_assert!(P.contains(&inside.center, 0.0));
        let E: Hyperellipsoid = P.max_inscribed_ellipsoid().unwrap();
        let C = E.image_of_ball().unwrap();
        for i in 0..P.n_faces() {
            let a = P.A.row(i).transpose();
            prop_assert!(a.dot(&E.center) + (C.transpose() * &a).norm() <= P.b[i] + 1e-12);
        }
        let mut n_inside = 0;
        for _ in 0..400 {
            let x = DVector::from_fn(n, |j, _| lower[j] + (upper[j] - lower[j]) * rng.random::<f64>());
            let contained = P.contains(&x, 0.0);
            n_inside += usize::from(contained);
            if contained {
                prop_assert!((0..n).all(|j| bounds.lower[j] - 1e-9 <= x[j] && x[j] <= bounds.upper[j] + 1e-9));
            }
            if reduced.contains(&x, 0.0) != contained {
                // Only a point on the face may differ.
                prop_assert!((&P.A * &x - &P.b).max() < 1e-9);
            }
        }
        prop_assert!(n_inside == 0 || !P.is_empty());
        // John's theorem: P lies in the ellipsoid grown n times about its center.
        let grown = HitAndRun::new(&P, &E.center, C);
        let mut walk = grown;
        for _ in 0..200 {
            walk.step(&mut rng);
            prop_assert!(E.distance(&vector(walk.point())) <= 1.05 * n as f64);
        }
    }
}
