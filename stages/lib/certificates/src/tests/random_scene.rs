//! Small scenes at random: two arms with turning and sliding joints and bodies of all kinds, and an obstacle.

use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{Body, Coordinate, CoordinateKind, Link, Motion, RigidTransform, Role, Scene, Shape};

fn vector(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * rng.random::<f64>() - 1.0))
}

fn pose(rng: &mut ChaCha8Rng, size: f64) -> RigidTransform {
    let turn = UnitQuaternion::from_scaled_axis(vector(rng, 2.0));
    RigidTransform::from_parts(Translation3::from(vector(rng, size)), turn)
}

fn shape(rng: &mut ChaCha8Rng) -> Shape {
    let mut size = || 0.02 + 0.08 * rng.random::<f64>();
    let (a, b, c) = (size(), size(), size());
    match rng.random_range(0..4) {
        0 => Shape::Box { half_extents: Vector3::new(a, b, c) },
        1 => Shape::Cylinder { radius: a, half_length: b },
        2 => Shape::Sphere { radius: a },
        _ => Shape::Capsule { radius: a, half_length: b },
    }
}

/// Two arms on the world, each of one to three joints and a body at its end, and a fixed body.
pub fn random_scene(seed: u64) -> Scene {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rng = &mut rng;
    let mut scene = Scene {
        name: format!("random-{seed}"),
        description: String::new(),
        coordinates: Vec::new(),
        links: vec![link("world", None, RigidTransform::identity(), Motion::Fixed)],
        bodies: Vec::new(),
        adjacent_links: Vec::new(),
        excluded_links: Vec::new(),
        tasks: Default::default(),
        files: Vec::new(),
        digest: [0; 32],
    };
    for arm in 0..2 {
        let mut parent = 0;
        for joint in 0..rng.random_range(1..=3) {
            let coordinate_idx = scene.coordinates.len();
            let axis = Unit::new_normalize(vector(rng, 1.0) + Vector3::new(0.0, 0.0, 1e-3));
            let is_angle = rng.random::<f64>() < 0.7;
            let (kind, motion, reach) = if is_angle {
                (CoordinateKind::Revolute, Motion::Revolute { axis, coordinate_idx }, 2.5)
            } else {
                (CoordinateKind::Prismatic, Motion::Prismatic { axis, coordinate_idx }, 0.2)
            };
            let name = format!("joint_{arm}_{joint}");
            scene.coordinates.push(Coordinate { name, kind, lower: -reach, upper: reach });
            let X_PF = pose(rng, 0.3);
            scene.links.push(link(&format!("link_{arm}_{joint}"), Some(parent), X_PF, motion));
            parent = scene.links.len() - 1;
        }
        let (X_LS, shape) = (pose(rng, 0.1), shape(rng));
        scene.bodies.push(Body { name: format!("body_{arm}"), link_idx: parent, X_LS, shape });
    }
    let X_PF = pose(rng, 0.5);
    scene.links.push(link("obstacle", Some(0), X_PF, Motion::Fixed));
    let link_idx = scene.links.len() - 1;
    let (X_LS, shape) = (RigidTransform::identity(), shape(rng));
    scene.bodies.push(Body { name: "obstacle".to_owned(), link_idx, X_LS, shape });
    scene
}

/// The scene with cylinders, capsules and balls at the ends of its arms, about whose axes the last joints turn: exactly, or
/// off by less than what counts as symmetric.
pub fn with_symmetric_ends(mut scene: Scene, seed: u64) -> Scene {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
    for body in &mut scene.bodies {
        let Motion::Revolute { axis, .. } = &scene.links[body.link_idx].motion else { continue };
        let size = 0.02 + 0.08 * rng.random::<f64>();
        body.shape = match rng.random_range(0..3) {
            0 => Shape::Cylinder { radius: size, half_length: 0.05 },
            1 => Shape::Sphere { radius: size },
            _ => Shape::Capsule { radius: size, half_length: 0.05 },
        };
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), axis)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let off = if rng.random::<bool>() { 2e-10 } else { 0.0 };
        let tilt = UnitQuaternion::from_scaled_axis(vector(&mut rng, off));
        let along = axis.into_inner() * (0.2 * rng.random::<f64>() - 0.1) + vector(&mut rng, off);
        body.X_LS = RigidTransform::from_parts(Translation3::from(along), tilt * turn);
    }
    scene
}

fn link(name: &str, parent: Option<usize>, X_PF: RigidTransform, motion: Motion) -> Link {
    Link { name: name.to_owned(), role: Role::Robot, parent, X_PF, motion }
}
