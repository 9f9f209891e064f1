//! Kinematics of the project's scenes.

use kinematics::{Chain, Kinematics, PairChain, Reach, Support, relevant_coordinates};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use scene::{CollisionPair, RigidTransform, Scene};
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name)).unwrap()
}

fn pair(scene: &Scene, a: &str, b: &str) -> CollisionPair {
    let (a, b) = (scene.body_idx(a).unwrap(), scene.body_idx(b).unwrap());
    CollisionPair { body_a: a.min(b), body_b: a.max(b) }
}

fn names(scene: &Scene, pair: &PairChain) -> Vec<String> {
    pair.joints.iter().map(|joint| scene.coordinates[joint.coordinate_idx].name.clone()).collect()
}

/// Point of the joint box at the fractions `unit` of its sides.
fn at(scene: &Scene, unit: &[f64]) -> Vec<f64> {
    scene.coordinates.iter().zip(unit).map(|(c, u)| c.lower + u * (c.upper - c.lower)).collect()
}

#[test]
fn iiwa14_gripper_is_where_an_independent_program_puts_it() {
    let scene = load("iiwa14-shelf");
    let kinematics = Kinematics::new(&scene);
    let mut poses = Vec::new();
    kinematics.link_poses(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], &mut poses);
    let wsg = scene.links.iter().position(|link| link.name.contains("wsg")).unwrap();
    let expected = Vector3::new(0.055576, 0.017814, 1.342534);
    assert!((poses[wsg].translation.vector - expected).norm() < 2e-6, "{}", poses[wsg]);
}

/// Seen from the gripper the cap turns about its own axis only, so the gap of a finger depends on that finger alone.
#[test]
fn cap_and_gripper_angles_drop_out_between_finger_and_cap() {
    let scene = load("bottle-cap-4dof");
    let left = PairChain::new(&scene, pair(&scene, "gripper/left_finger", "cap/cap"));
    assert_eq!(names(&scene, &left), ["left_finger"]);
    assert_eq!((left.n_dropped_a, left.n_dropped_b), (0, 2));
    assert!(left.inflation < 1e-13, "{:e}", left.inflation);
    let links: Vec<_> = left.frames.iter().map(|f| scene.links[f.link_idx].name.as_str()).collect();
    assert_eq!(links, ["gripper/left_finger", "gripper/wsg_body"]);
    // An obstacle is off the gripper's axis, so the gripper's angle stays.
    let obstacle = PairChain::new(&scene, pair(&scene, "gripper/left_finger", "obstacle_1"));
    assert_eq!(names(&scene, &obstacle), ["left_finger", "gripper"]);
    assert_eq!(obstacle.frames.last().map(|f| f.link_idx), Some(0));
    let body = PairChain::new(&scene, pair(&scene, "gripper/wsg_body", "cap/cap"));
    assert!(body.joints.is_empty());
    assert_eq!(body.frames.len(), 1);
}

#[test]
fn only_the_caps_own_angle_is_irrelevant() {
    for name in ["bottle-cap-3dof", "bottle-cap-4dof"] {
        let scene = load(name);
        let relevant = relevant_coordinates(&scene, &scene.collision_pairs());
        let expected: Vec<bool> = scene.coordinates.iter().map(|c| c.name != "cap").collect();
        assert_eq!(relevant, expected);
    }
    let arm = load("iiwa14-shelf");
    assert_eq!(relevant_coordinates(&arm, &arm.collision_pairs()), [true; 7]);
}

/// The obstacles' frame is the world, also where they are links of their own.
#[test]
fn frame_links_are_nearest_to_the_world() {
    let scene = load("iiwa14-shelf");
    let table = scene.body_idx("table").unwrap();
    let hand = scene.bodies.len() - 1;
    for pair in scene.collision_pairs().into_iter().filter(|p| p.body_b == table || p.body_a == table) {
        let chain = PairChain::new(&scene, pair);
        let world = if pair.body_b == table { chain.frames.last() } else { chain.frames.first() };
        assert_eq!(world.map(|frame| frame.link_idx), Some(0));
        assert!(hand >= pair.body_a);
    }
}

fn close(a: &RigidTransform, b: &RigidTransform, tol: f64) -> bool {
    (a.to_homogeneous() - b.to_homogeneous()).amax() < tol
}

proptest! {
    /// A chain is the product of the link poses at its ends, from every frame, in both directions.
    #[test]
    fn chains_agree_with_forward_kinematics(unit in prop::collection::vec(0.0..1.0_f64, 7), pick in 0..10_000_usize) {
        for name in ["iiwa14-shelf", "bottle-cap-4dof", "two-rooms"] {
            let scene = load(name);
            let q = at(&scene, &unit);
            let kinematics = Kinematics::new(&scene);
            let mut poses = Vec::new();
            kinematics.link_poses(&q, &mut poses);
            let pairs = scene.collision_pairs();
            let pair = pairs[pick % pairs.len()];
            let X_WA = kinematics.body_pose(&poses, pair.body_a);
            let X_WB = kinematics.body_pose(&poses, pair.body_b);
            let chain = Chain::between_bodies(&scene, pair.body_a, pair.body_b);
            prop_assert!(close(&chain.pose(&q), &(X_WA.inverse() * X_WB), 1e-12));
            prop_assert!(close(&chain.reversed().pose(&q), &(X_WB.inverse() * X_WA), 1e-12));
            prop_assert_eq!(chain.frame_links.len(), chain.joints.len() + 1);
            for &link_idx in &chain.frame_links {
                let X_FA = Chain::to_body(&scene, link_idx, pair.body_a).pose(&q);
                prop_assert!(close(&X_FA, &(poses[link_idx].inverse() * X_WA), 1e-12));
            }
        }
    }

    /// Without the dropped rotations each body occupies the same points, so it has the same support function.
    #[test]
    fn dropped_rotations_move_no_body(unit in prop::collection::vec(0.0..1.0_f64, 4), w in prop::array::uniform3(-1.0..1.0_f64)) {
        let scene = load("bottle-cap-4dof");
        let q = at(&scene, &unit);
        let w = Vector3::from(w);
        for pair in scene.collision_pairs() {
            let chain = PairChain::new(&scene, pair);
            for frame in &chain.frames {
                prop_assert_eq!(frame.to_a.joints.len() + frame.to_b.joints.len(), chain.joints.len());
                for (side, body_idx) in [(&frame.to_a, pair.body_a), (&frame.to_b, pair.body_b)] {
                    let whole = Chain::to_body(&scene, frame.link_idx, body_idx).pose(&q);
                    let short = side.pose(&q);
                    let shape = &scene.bodies[body_idx].shape;
                    let value = |X: &RigidTransform| {
                        w.dot(&X.translation.vector) + shape.core_support_value(&(X.rotation.inverse() * w))
                    };
                    prop_assert!((value(&whole) - value(&short)).abs() <= chain.inflation + 1e-14);
                }
            }
        }
    }

    /// Gradients against central differences.
    #[test]
    fn gradients_agree_with_differences(unit in prop::collection::vec(0.05..0.95_f64, 7), p in prop::array::uniform3(-1.0..1.0_f64), n in prop::array::uniform3(-1.0..1.0_f64)) {
        let scene = load("iiwa14-shelf");
        let q = at(&scene, &unit);
        let (p, n) = (Vector3::from(p), Vector3::from(n));
        let kinematics = Kinematics::new(&scene);
        let link_idx = scene.links.iter().rposition(|link| link.name.starts_with("iiwa14")).unwrap();
        let value = |q: &[f64]| {
            let mut poses = Vec::new();
            kinematics.link_poses(q, &mut poses);
            n.dot(&(poses[link_idx] * Point3::from(p)).coords)
        };
        let mut poses = Vec::new();
        kinematics.link_poses(&q, &mut poses);
        let mut gradient = [0.0; 7];
        kinematics.gradient(&poses, link_idx, &(poses[link_idx] * Point3::from(p)).coords, &n, &mut gradient);
        let chain = Chain::between_links(&scene, 0, link_idx);
        let of_chain = chain.gradient(&q, &p, &n);
        for j in 0..7 {
            let step = |sign: f64| { let mut q = q.clone(); q[j] += sign * 1e-6; value(&q) };
            let difference = (step(1.0) - step(-1.0)) / 2e-6;
            prop_assert!((gradient[j] - difference).abs() < 1e-8);
            prop_assert!((of_chain[j] - difference).abs() < 1e-8);
        }
    }

    /// No point of a body moves or accelerates more than its reach allows, seen from any frame.
    #[test]
    fn reach_bounds_speed_and_acceleration(
        unit in prop::collection::vec(0.05..0.95_f64, 7),
        d in prop::collection::vec(-1.0..1.0_f64, 7),
        w in prop::array::uniform3(-1.0..1.0_f64),
        pick in 0..10_000_usize,
    ) {
        for name in ["iiwa14-shelf", "bottle-cap-4dof", "two-rooms", "hinge"] {
            let scene = load(name);
            let q = at(&scene, &unit);
            let pairs = scene.collision_pairs();
            let chain = PairChain::new(&scene, pairs[pick % pairs.len()]);
            for frame in &chain.frames {
                for (side, body_idx) in [(&frame.to_a, chain.pair.body_a), (&frame.to_b, chain.pair.body_b)] {
                    let shape = &scene.bodies[body_idx].shape;
                    let reach = Reach::new(side, shape, &scene.coordinates);
                    let x = Point3::from(shape.core_support_point(&Vector3::from(w)));
                    let point = |t: f64| {
                        let q: Vec<f64> = q.iter().zip(&d).map(|(q, d)| q + t * d).collect();
                        (side.pose(&q) * x).coords
                    };
                    let h = 1e-4;
                    let speed = ((point(h) - point(-h)) / (2.0 * h)).norm();
                    let acceleration = ((point(h) - point(0.0) * 2.0 + point(-h)) / (h * h)).norm();
                    prop_assert!(speed <= reach.speed_bound(&d) * (1.0 + 1e-6) + 1e-9);
                    prop_assert!(acceleration <= reach.acceleration_bound(&d) * (1.0 + 1e-5) + 1e-6);
                }
            }
        }
    }
}

/// A ball at distance 1 from the hinge: it takes the bounds.
#[test]
fn reach_of_the_hinges_tip_is_one() {
    let scene = load("hinge");
    let tip = scene.bodies.iter().position(|body| body.X_LS.translation.x == 1.0).unwrap();
    let chain = Chain::to_body(&scene, 0, tip);
    let reach = Reach::new(&chain, &scene.bodies[tip].shape, &scene.coordinates);
    assert!((reach.reach(0) - 1.0).abs() < 1e-11);
    assert!((reach.acceleration_bound(&[2.0]) - 4.0).abs() < 1e-10);
}
