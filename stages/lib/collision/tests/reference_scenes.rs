//! What is true of the project's scenes (facts of the scenes, from an independent engine or by hand).

use collision::{CollisionChecker, EdgeOutcome};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name)).unwrap()
}

/// Uniform samples of the joint box.
fn samples(scene: &Scene, n: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| scene.coordinates.iter().map(|c| rng.random_range(c.lower..c.upper)).collect()).collect()
}

fn free_share(scene: &Scene, n: usize) -> f64 {
    let checker = CollisionChecker::new(scene);
    samples(scene, n, 7).iter().filter(|q| checker.is_free(q)).count() as f64 / n as f64
}

/// Standard error of 200,000 samples: 0.0011.
#[test]
fn free_shares_of_the_bottle_caps() {
    let share = free_share(&load("bottle-cap-3dof"), 200_000);
    assert!((share - 0.362).abs() < 0.004, "{share}");
    let share = free_share(&load("bottle-cap-4dof"), 200_000);
    assert!((share - 0.219).abs() < 0.004, "{share}");
}

#[test]
fn free_shares_known_by_hand() {
    for (name, expected) in [("hinge", 0.674533), ("slider-gap", 0.84), ("two-rooms", 0.9428571)] {
        let share = free_share(&load(name), 100_000);
        assert!((share - expected).abs() < 0.006, "{name}: {share}");
    }
}

/// Where the predicate changes between a free `inside` and a colliding `outside`.
fn boundary(is_free: impl Fn(f64) -> bool, mut inside: f64, mut outside: f64) -> f64 {
    assert!(is_free(inside) && !is_free(outside));
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if is_free(middle) { inside = middle } else { outside = middle }
    }
    0.5 * (inside + outside)
}

#[test]
fn free_gripper_intervals_of_the_grasp_band() {
    for (name, right) in [("bottle-cap-3dof", None), ("bottle-cap-4dof", Some(0.0245))] {
        let checker = CollisionChecker::new(&load(name));
        let q = |gripper: f64, finger: f64| {
            let mut q = vec![0.3, gripper, finger];
            q.extend(right);
            q
        };
        let at = |gripper: f64| checker.is_free(&q(gripper, -0.0245));
        let ends = [
            (boundary(at, -0.7, -0.95), -0.8065),
            (boundary(at, -0.7, -0.3), -0.6436),
            (boundary(at, 0.7, 0.1), 0.3598),
        ];
        for (found, expected) in ends {
            assert!((found - expected).abs() < 6e-4, "{name}: {found}, expected {expected}");
        }
        assert!(at(1.0));
        // No other interval, and the same at both ends of the band but for contact itself.
        for k in 0..=2000 {
            let gripper = -1.0 + 0.001 * f64::from(k);
            let expected = (ends[0].0..ends[1].0).contains(&gripper) || gripper > ends[2].0;
            assert_eq!(at(gripper), expected, "{name}: {gripper}");
        }
        assert!(checker.is_free(&q(0.7, -0.024 - 1e-9)));
        assert!(!checker.is_free(&q(0.7, -0.024)), "contact is not free");
        assert!(!checker.is_free(&q(0.7, -0.024 + 1e-9)));
        // The two intervals meet where the finger opens beyond 0.0424.
        let joined =
            |finger: f64| (0..=1000).all(|k| checker.is_free(&q(-0.7 + 1.2e-3 * f64::from(k), finger)));
        let opening = boundary(joined, -0.045, -0.03);
        assert!((opening + 0.0424).abs() < 1e-4, "{name}: {opening}");
    }
}

#[test]
fn starts_and_goals_are_free() {
    for name in ["bottle-cap-3dof", "bottle-cap-4dof", "two-rooms", "two-rooms-closed"] {
        let scene = load(name);
        let task = scene.task(None).unwrap();
        let checker = CollisionChecker::for_task(&scene, task);
        assert_eq!(checker.colliding_pair(task.start.as_slice()), None, "{name}");
        assert_eq!(checker.colliding_pair(task.goal.as_slice()), None, "{name}");
    }
}

#[test]
fn the_caps_angle_changes_nothing() {
    let scene = load("bottle-cap-3dof");
    let checker = CollisionChecker::new(&scene);
    assert_eq!(checker.relevant_coordinates(), [false, true, true]);
    for mut q in samples(&scene, 500, 3) {
        let distance = checker.min_distance(&q);
        q[0] = -q[0];
        assert_eq!(checker.min_distance(&q), distance);
    }
}

/// Rows: IRIS seed, task milestone.
const IIWA14: [[f64; 7]; 10] = [
    [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692],
    [-0.301024, 0.523691, 0.224335, -0.598516, 0.226598, 0.481853, 1.257369],
    [-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469],
    [0.616013, 0.485002, -0.612152, -1.323945, 0.377728, -0.155048, 1.468885],
    [-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626],
    [0.303097, 0.709188, -0.128449, -1.604965, 0.303884, -0.744345, 1.42963],
    [1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119],
    [1.205705, 0.795638, 0.357506, -1.47261, -0.31593, 0.93008, 1.654183],
    [-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209],
    [-1.468807, 0.796227, -0.360682, -1.472515, 0.318728, 0.930758, 1.220615],
];

#[test]
fn iiwa14_configurations_keep_their_distance() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    assert_eq!(checker.n_pairs(), 324);
    let distances: Vec<f64> = IIWA14.iter().map(|q| checker.min_distance(q).unwrap().0).collect();
    assert!(distances.iter().all(|d| (0.0585..=0.0805).contains(d)), "{distances:?}");
    let half_pi = std::f64::consts::FRAC_PI_2;
    for q in [
        [0.0, 0.2, 0.0, -2.09, 0.0, -0.3, half_pi],
        [0.8, 0.7, 0.0, -1.6, 0.0, 0.0, half_pi],
        [-0.8, 0.7, 0.0, -1.6, 0.0, 0.0, half_pi],
    ] {
        assert!(checker.is_free(&q), "{q:?}: {:?}", checker.min_distance(&q));
    }
}

#[test]
fn iiwa14_free_share() {
    let share = free_share(&load("iiwa14-shelf"), 20_000);
    assert!((share - 0.75).abs() < 0.02, "{share}");
}

/// The gripper meets the top board within 0.05 rad of the seed above the shelf, nothing does within 0.02.
#[test]
fn iiwa14_boxes_around_the_seed_above_the_shelf() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    let corners = |half: f64| {
        (0..128).map(move |bits: u32| -> Vec<f64> {
            let sign = |j: usize| if bits >> j & 1 == 0 { -half } else { half };
            (0..7).map(|j| IIWA14[0][j] + sign(j)).collect()
        })
    };
    assert!(corners(0.02).all(|q| checker.is_free(&q)));
    let colliding: std::collections::BTreeSet<(&str, &str)> = corners(0.05)
        .flat_map(|q| checker.colliding_pairs(&q))
        .map(|pair| (scene.bodies[pair.body_a].name.as_str(), scene.bodies[pair.body_b].name.as_str()))
        .collect();
    // The whole hand reaches the board at some corner, nothing else reaches anything.
    let hand = ["iiwa14/link_7", "iiwa14/wsg", "iiwa14/wsg#2", "iiwa14/wsg#3"];
    assert_eq!(colliding, hand.map(|name| (name, "shelves_top_board")).into());
}

fn mix(q_0: &[f64], q_1: &[f64], t: f64) -> Vec<f64> {
    q_0.iter().zip(q_1).map(|(a, b)| a + t * (b - a)).collect()
}

/// Edges of random directions; `length` in the norm of the coordinates' ranges.
fn edges(scene: &Scene, n: usize, seed: u64, length: f64) -> Vec<(Vec<f64>, Vec<f64>)> {
    let (from, to) = (samples(scene, n, seed), samples(scene, n, seed + 1));
    from.into_iter()
        .zip(to)
        .map(|(a, b)| {
            let b = mix(&a, &b, length);
            (a, b)
        })
        .collect()
}

/// Free edges have no colliding sample; colliding ones collide where they say; few stay undecided.
#[test]
fn edges_agree_with_dense_sampling() {
    for (name, n, length) in [
        ("bottle-cap-3dof", 3000, 1.0),
        ("bottle-cap-4dof", 3000, 0.5),
        ("iiwa14-shelf", 1000, 0.3),
        ("two-rooms", 3000, 1.0),
        ("hinge", 500, 1.0),
    ] {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        let (mut n_free, mut n_undecided) = (0, 0);
        for (q_0, q_1) in edges(&scene, n, 11, length) {
            match checker.edge_is_free(&q_0, &q_1) {
                EdgeOutcome::Free => {
                    n_free += 1;
                    for k in 0..=400 {
                        let q = mix(&q_0, &q_1, f64::from(k) / 400.0);
                        assert_eq!(
                            checker.colliding_pair(&q),
                            None,
                            "{name}: {q_0:?} to {q_1:?}, sample {k}"
                        );
                    }
                }
                EdgeOutcome::Colliding { t, pair } => {
                    assert!(checker.colliding_pairs(&mix(&q_0, &q_1, t)).contains(&pair), "{name}");
                }
                EdgeOutcome::Undecided => n_undecided += 1,
            }
        }
        assert!(n_free > n / 20, "{name}: {n_free} free");
        assert!(n_undecided * 500 <= n, "{name}: {n_undecided} of {n} undecided");
    }
}

/// By hand: the hinge's tip touches the wall at π/6.
#[test]
fn hinge_edges_on_both_sides_of_contact() {
    let checker = CollisionChecker::new(&load("hinge"));
    let contact = std::f64::consts::FRAC_PI_6;
    assert_eq!(checker.edge_is_free(&[-1.5], &[contact - 1e-6]), EdgeOutcome::Free);
    assert!(matches!(checker.edge_is_free(&[-1.5], &[contact + 1e-6]), EdgeOutcome::Colliding { .. }));
    assert_eq!(checker.edge_is_free(&[0.2], &[0.2]), EdgeOutcome::Free);
    let path = |end: f64| [vec![-1.5], vec![0.0], vec![end]];
    assert_eq!(checker.path_first_collision(&path(contact - 1e-9), 1e-3), None);
    let found = checker.path_first_collision(&path(1.0), 1e-3).unwrap();
    assert_eq!(found.piece_idx, 1);
    assert!((found.q[0] - contact).abs() < 1.1e-3 && found.q[0] >= contact, "{found:?}");
}

/// An edge through the gap touches nothing; one at contact height slides along an edge and is not free.
#[test]
fn slider_edges_through_the_gap() {
    let checker = CollisionChecker::new(&load("slider-gap"));
    assert_eq!(checker.edge_is_free(&[-1.0, 0.0999], &[1.0, 0.0999]), EdgeOutcome::Free);
    assert!(matches!(checker.edge_is_free(&[-1.0, 0.1], &[1.0, 0.1]), EdgeOutcome::Colliding { .. }));
    assert_eq!(checker.edge_is_free(&[-0.21, 0.5], &[-0.21, -0.5]), EdgeOutcome::Free);
}

/// A grasp's long transfer inside the 1 mm band, cap and gripper together, is one free edge.
#[test]
fn a_transfer_in_the_grasp_band_is_free() {
    let checker = CollisionChecker::new(&load("bottle-cap-3dof"));
    let outcome = checker.edge_is_free(&[-3.0, 0.3599, -0.024 - 1e-7], &[-2.3599, 0.9999, -0.024 - 1e-7]);
    assert_eq!(outcome, EdgeOutcome::Free);
}

#[test]
fn clearance_spares_robot_with_object_only() {
    let scene = load("bottle-cap-3dof");
    let mut task = scene.task(None).unwrap().clone();
    task.clearance = 1e-3;
    let (touching, keeping) = (CollisionChecker::new(&scene), CollisionChecker::for_task(&scene, &task));
    for pair_idx in 0..keeping.n_pairs() {
        let names = [keeping.pair(pair_idx).body_a, keeping.pair(pair_idx).body_b];
        let names = names.map(|body_idx| scene.bodies[body_idx].name.as_str());
        let contact =
            names.iter().any(|n| n.starts_with("gripper/")) && names.iter().any(|n| n.starts_with("cap/"));
        assert_eq!(keeping.clearance(pair_idx), if contact { 0.0 } else { 1e-3 }, "{names:?}");
    }
    for q in samples(&scene, 20_000, 5) {
        let expected = (0..touching.n_pairs())
            .all(|pair_idx| touching.pair_distance(pair_idx, &q) > keeping.clearance(pair_idx));
        assert_eq!(keeping.is_free(&q), expected, "{q:?}");
    }
    let at = |gripper: f64| keeping.is_free(&[0.0, gripper, -0.0245]);
    assert!(at(0.7));
    let narrowed = boundary(at, 0.7, 0.1);
    assert!(narrowed > 0.37, "the obstacle is kept further away: {narrowed}");
}

/// Boolean answers, signed distances and lists say the same.
#[test]
fn answers_agree() {
    for name in ["bottle-cap-4dof", "iiwa14-shelf", "two-rooms", "hinge"] {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        for q in samples(&scene, 1500, 9) {
            let (least, pair_idx) = checker.min_distance(&q).unwrap();
            let colliding = checker.colliding_pairs(&q);
            assert_eq!(checker.is_free(&q), least > 0.0, "{name} {q:?} {least}");
            assert_eq!(checker.colliding_pair(&q), colliding.first().copied());
            assert_eq!(checker.pair_distance(pair_idx, &q), least);
            for k in 0..checker.n_pairs() {
                let distance = checker.pair_distance(k, &q);
                assert!(distance >= least - 1e-12, "{name} {k} {distance} {least}");
                assert_eq!(distance > 0.0, checker.pair_is_free(k, &q), "{name} {k} {distance}");
            }
        }
    }
}

proptest! {
    /// Edges short enough to graze, between nearby configurations: a free one has no colliding sample.
    #[test]
    fn short_edges_are_never_wrongly_free(
        unit in prop::collection::vec(0.0..1.0_f64, 4),
        step in prop::collection::vec(-0.1..0.1_f64, 4),
    ) {
        let scene = load("bottle-cap-4dof");
        let checker = CollisionChecker::new(&scene);
        let at = |unit: &[f64]| -> Vec<f64> {
            scene.coordinates.iter().zip(unit).map(|(c, u)| c.lower + u.clamp(0.0, 1.0) * (c.upper - c.lower)).collect()
        };
        let q_0 = at(&unit);
        let q_1 = at(&unit.iter().zip(&step).map(|(u, s)| u + s).collect::<Vec<_>>());
        if checker.edge_is_free(&q_0, &q_1) == EdgeOutcome::Free {
            for k in 0..=200 {
                prop_assert!(checker.is_free(&mix(&q_0, &q_1, f64::from(k) / 200.0)));
            }
        }
    }
}
