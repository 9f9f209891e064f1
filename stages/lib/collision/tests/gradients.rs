//! Gradients of gaps against differences, and convex obstacles against the checker.

use collision::CollisionChecker;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name)).unwrap()
}

fn sample(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<f64> {
    scene.coordinates.iter().map(|c| c.lower + (c.upper - c.lower) * rng.random::<f64>()).collect()
}

/// The share of (configuration, pair, coordinate) at which the gradient is that of differences, among those where
/// differences on both sides agree.
fn share_right(name: &str, n_configurations: usize, max_gap: f64) -> f64 {
    let scene = load(name);
    let checker = CollisionChecker::new(&scene);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut n_right, mut n_all) = (0, 0);
    for _ in 0..n_configurations {
        let q = sample(&scene, &mut rng);
        for pair_idx in 0..checker.n_pairs() {
            let mut gradient = vec![f64::NAN; scene.dim()];
            let gap = checker.pair_gap(pair_idx, &q, &mut gradient);
            assert_eq!(gap, checker.pair_distance(pair_idx, &q));
            if gap.abs() > max_gap {
                continue;
            }
            for j in 0..scene.dim() {
                let step = 1e-5;
                let at = |d: f64| {
                    let mut moved = q.clone();
                    moved[j] += d;
                    checker.pair_distance(pair_idx, &moved)
                };
                let (up, down) = ((at(step) - gap) / step, (gap - at(-step)) / step);
                if !checker.pair_coordinates(pair_idx).contains(&j) {
                    assert_eq!(gradient[j], 0.0);
                    continue;
                }
                if (up - down).abs() > 1e-3 {
                    continue;
                }
                n_all += 1;
                n_right += usize::from((gradient[j] - 0.5 * (up + down)).abs() < 2e-3);
            }
        }
    }
    assert!(n_all > 50, "{name}: only {n_all} comparisons");
    n_right as f64 / n_all as f64
}

#[test]
fn gradients_agree_with_differences() {
    for (name, n_configurations) in [
        ("hinge", 200),
        ("slider-gap", 200),
        ("two-rooms", 200),
        ("bottle-cap-4dof", 200),
        ("iiwa14-shelf", 30),
    ] {
        let share = share_right(name, n_configurations, 0.3);
        assert!(share > 0.99, "{name}: {share}");
    }
}

/// Where a pair only translates, it is free exactly where some plane says so.
#[test]
fn convex_obstacles_are_what_the_checker_says() {
    for name in ["slider-gap", "two-rooms", "two-rooms-closed"] {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        let (mut n_free, mut n_colliding) = (0, 0);
        for _ in 0..4000 {
            let q = sample(&scene, &mut rng);
            for pair_idx in 0..checker.n_pairs() {
                let obstacle = checker.translating_pair(pair_idx).unwrap();
                let y = &obstacle.D * nalgebra::DVector::from_column_slice(&q);
                let gap_along = |n: &Vector3<f64>| n.dot(&y) - obstacle.support_value(n);
                let normal = checker.pair_separation(pair_idx, &q).normal;
                let free = checker.pair_is_free(pair_idx, &q);
                // The checker's direction separates y from the obstacle if it is free; otherwise none does.
                if free {
                    n_free += 1;
                    assert!(gap_along(&normal) > -1e-9, "{name} {q:?}");
                } else {
                    n_colliding += 1;
                    for _ in 0..10 {
                        let n = Vector3::from_fn(|_, _| rng.random::<f64>() - 0.5).normalize();
                        assert!(gap_along(&n) < 1e-9, "{name} {q:?} {n}");
                    }
                }
            }
        }
        assert!(n_free > 100 && n_colliding > 100, "{name}: {n_free} {n_colliding}");
    }
}

#[test]
fn a_revolute_joint_has_no_convex_obstacle() {
    let scene = load("hinge");
    let checker = CollisionChecker::new(&scene);
    assert_eq!(checker.translating_pair(0).err(), Some(0));
}
