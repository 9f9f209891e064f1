//! The free space of the bottle-cap scenes is that of the facts: shares, intervals and the opening that joins them.
//!
//! Every body of these scenes is upright: a vertical cylinder, or a box with one axis along world z. So two
//! bodies overlap if their heights do and their outlines in the plane, circles and rectangles, do. This is exact
//! and shares nothing with the collision crate.

use nalgebra::{Translation3, UnitQuaternion, Vector2};
use scene::{Motion, RigidTransform, Scene, Shape};
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name)).unwrap()
}

/// An upright body: its outline seen from above, and its height.
struct Upright {
    center: Vector2<f64>,
    outline: Outline,
    z: (f64, f64),
}

enum Outline {
    Circle(f64),
    Rectangle([(Vector2<f64>, f64); 2]),
}

fn upright(X_WS: &RigidTransform, shape: &Shape) -> Upright {
    let p = X_WS.translation.vector;
    let R = X_WS.rotation.to_rotation_matrix();
    let (outline, half_height) = match shape {
        Shape::Cylinder { radius, half_length } => {
            assert!(R[(2, 2)].abs() > 1.0 - 1e-12);
            (Outline::Circle(*radius), *half_length)
        }
        Shape::Box { half_extents } => {
            let vertical = (0..3).find(|&k| R[(2, k)].abs() > 1.0 - 1e-12).unwrap();
            let side = |k: usize| (Vector2::new(R[(0, k)], R[(1, k)]), half_extents[k]);
            let sides = [side((vertical + 1) % 3), side((vertical + 2) % 3)];
            (Outline::Rectangle(sides), half_extents[vertical])
        }
        other => panic!("{other:?} is not in these scenes"),
    };
    Upright { center: p.xy(), outline, z: (p.z - half_height, p.z + half_height) }
}

fn overlap(a: &Upright, b: &Upright) -> bool {
    let d = b.center - a.center;
    if a.z.1 <= b.z.0 || b.z.1 <= a.z.0 {
        return false;
    }
    match (&a.outline, &b.outline) {
        (Outline::Circle(r_a), Outline::Circle(r_b)) => d.norm() < r_a + r_b,
        (Outline::Circle(r), Outline::Rectangle(sides)) | (Outline::Rectangle(sides), Outline::Circle(r)) => {
            let outside = |(axis, half): &(Vector2<f64>, f64)| (axis.dot(&d).abs() - half).max(0.0);
            outside(&sides[0]).hypot(outside(&sides[1])) < *r
        }
        (Outline::Rectangle(sides_a), Outline::Rectangle(sides_b)) => {
            let reach = |sides: &[(Vector2<f64>, f64); 2], n: &Vector2<f64>| -> f64 {
                sides.iter().map(|(axis, half)| axis.dot(n).abs() * half).sum()
            };
            sides_a
                .iter()
                .chain(sides_b)
                .all(|(n, _)| n.dot(&d).abs() < reach(sides_a, n) + reach(sides_b, n))
        }
    }
}

fn is_free(scene: &Scene, q: &[f64]) -> bool {
    let mut X_W: Vec<RigidTransform> = Vec::new();
    for link in &scene.links {
        let X_FL = match &link.motion {
            Motion::Fixed => RigidTransform::identity(),
            Motion::Revolute { axis, coordinate_idx } => RigidTransform::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(axis, q[*coordinate_idx]),
            ),
            Motion::Prismatic { axis, coordinate_idx } => RigidTransform::from_parts(
                Translation3::from(axis.into_inner() * q[*coordinate_idx]),
                UnitQuaternion::identity(),
            ),
        };
        let X_WP = link.parent.map_or(RigidTransform::identity(), |parent| X_W[parent]);
        X_W.push(X_WP * link.X_PF * X_FL);
    }
    let bodies: Vec<Upright> =
        scene.bodies.iter().map(|body| upright(&(X_W[body.link_idx] * body.X_LS), &body.shape)).collect();
    !scene.collision_pairs().iter().any(|pair| overlap(&bodies[pair.body_a], &bodies[pair.body_b]))
}

/// Share of free cell centres of a grid over all coordinates but the cap's, on which collision does not depend.
fn free_share(scene: &Scene, steps: usize) -> f64 {
    let moving = scene.dim() - 1;
    let total = steps.pow(moving as u32);
    let free = (0..total).filter(|cell| {
        let mut q = vec![0.5];
        for k in 0..moving {
            let c = &scene.coordinates[k + 1];
            let share = ((cell / steps.pow(k as u32)) % steps) as f64 + 0.5;
            q.push(c.lower + (c.upper - c.lower) * share / steps as f64);
        }
        is_free(scene, &q)
    });
    free.count() as f64 / total as f64
}

#[test]
fn free_shares() {
    let (three, four) = (free_share(&load("bottle-cap-3dof"), 200), free_share(&load("bottle-cap-4dof"), 44));
    assert!((three - 0.362).abs() < 2e-3, "{three}");
    assert!((four - 0.219).abs() < 4e-3, "{four}");
}

/// Ends of the free intervals of the gripper's angle, at a step of 1e-4 rad.
fn free_intervals(free: impl Fn(f64) -> bool) -> Vec<(f64, f64)> {
    let mut intervals: Vec<(f64, f64)> = Vec::new();
    let mut inside = false;
    for step in -10_000..=10_000 {
        let angle = f64::from(step) * 1e-4;
        let now = free(angle);
        match (inside, now, intervals.last_mut()) {
            (false, true, _) => intervals.push((angle, angle)),
            (true, true, Some(interval)) => interval.1 = angle,
            _ => {}
        }
        inside = now;
    }
    intervals
}

#[test]
fn free_intervals_in_the_grasp_band() {
    let (three, four) = (load("bottle-cap-3dof"), load("bottle-cap-4dof"));
    for finger in [-0.024_000_001, -0.0245, -0.025] {
        for intervals in [
            free_intervals(|angle| is_free(&three, &[0.0, angle, finger])),
            free_intervals(|angle| is_free(&four, &[0.0, angle, finger, 0.025])),
        ] {
            assert_eq!(intervals.len(), 2, "{intervals:?}");
            // Found at a step of 1e-4, stated to four digits.
            for (found, stated) in intervals.iter().zip([(-0.8065, -0.6436), (0.3598, 1.0)]) {
                assert!(
                    (found.0 - stated.0).abs() < 1.5e-4 && (found.1 - stated.1).abs() < 1.5e-4,
                    "{found:?} {stated:?}"
                );
            }
        }
    }
    assert!(!is_free(&three, &[0.0, 0.5, -0.023_999]), "the finger is in the cap");
}

#[test]
fn intervals_join_where_the_finger_is_open() {
    let scene = load("bottle-cap-3dof");
    let joined = |finger: f64| free_intervals(|angle| is_free(&scene, &[0.0, angle, finger])).len() == 1;
    assert!(!joined(-0.0423) && joined(-0.0425));
}

#[test]
fn start_and_goal_are_free() {
    for name in ["bottle-cap-3dof", "bottle-cap-4dof"] {
        let scene = load(name);
        let task = scene.task(None).unwrap();
        assert!(is_free(&scene, task.start.as_slice()) && is_free(&scene, task.goal.as_slice()), "{name}");
    }
}
