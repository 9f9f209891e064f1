//! The scenes of the project load and hold the facts that their files state.
// 3.14 is the thesis' limit of the cap's angle, not an approximation of pi.
#![allow(clippy::approx_constant)]

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use scene::{CollisionPair, CoordinateKind, Motion, RigidTransform, Role, Scene, Shape};
use std::path::{Path, PathBuf};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name)
}

fn load(name: &str) -> Scene {
    let scene = Scene::load(&folder(name)).unwrap();
    assert_eq!(scene.name, name, "folder and name agree");
    scene
}

/// X_WL of every link: the transforms along the tree multiplied, written here independently of kinematics.
fn link_poses(scene: &Scene, q: &[f64]) -> Vec<RigidTransform> {
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
    X_W
}

fn pair_names(scene: &Scene) -> Vec<(&str, &str)> {
    let names =
        |p: &CollisionPair| (scene.bodies[p.body_a].name.as_str(), scene.bodies[p.body_b].name.as_str());
    scene.collision_pairs().iter().map(names).collect()
}

#[test]
fn bottle_cap_3dof_has_the_facts_of_the_thesis() {
    let scene = load("bottle-cap-3dof");
    let names: Vec<_> = scene.coordinates.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["cap", "gripper", "left_finger"]);
    assert_eq!(scene.lower().as_slice(), [-3.14, -1.0, -0.055]);
    assert_eq!(scene.upper().as_slice(), [3.14, 1.0, 0.0]);
    assert_eq!(scene.coordinates[2].kind, CoordinateKind::Prismatic);
    assert_eq!(scene.collision_pairs().len(), 15);
    assert!(scene.collision_pairs().is_sorted());

    let task = scene.task(None).unwrap();
    assert_eq!(task, scene.task(Some("open")).unwrap());
    assert_eq!(task.start.as_slice(), [-3.14, -0.78, -0.025]);
    assert_eq!(task.goal.as_slice(), [3.14, -0.78, -0.03]);
    assert_eq!((task.grasp.lower[2], task.grasp.upper[2]), (-0.025, -0.024));
    assert_eq!((task.placement.lower.clone(), task.placement.upper.clone()), (scene.lower(), scene.upper()));
    let forms = |forms: &[nalgebra::DVector<f64>]| -> Vec<Vec<f64>> {
        forms.iter().map(|form| form.as_slice().to_vec()).collect()
    };
    assert_eq!(forms(&task.transfer_keep), [[-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(forms(&task.transit_keep), [[1.0, 0.0, 0.0]]);
}

#[test]
fn bottle_cap_gripper_turns_about_world_minus_z_as_the_cap_does() {
    let scene = load("bottle-cap-3dof");
    let (turned, rest) = (link_poses(&scene, &[0.3, 0.3, 0.0]), link_poses(&scene, &[0.0; 3]));
    for name in ["cap/cap", "gripper/wsg_body"] {
        let link = scene.link_idx(name).unwrap();
        let axis_angle = (turned[link].rotation * rest[link].rotation.inverse()).scaled_axis();
        assert!((axis_angle - Vector3::new(0.0, 0.0, -0.3)).norm() < 1e-12, "{name}: {axis_angle}");
    }
}

#[test]
fn bottle_cap_finger_touches_the_cap_at_24_millimetres() {
    let scene = load("bottle-cap-4dof");
    assert_eq!(scene.collision_pairs().len(), 15);
    let poses = link_poses(&scene, &[0.0, 0.0, -0.024, 0.024]);
    for (name, side) in [("gripper/left_finger", -1.0), ("gripper/right_finger", 1.0)] {
        let body = &scene.bodies[scene.body_idx(name).unwrap()];
        let Shape::Box { half_extents } = &body.shape else { panic!("{name} is a box") };
        let center = poses[body.link_idx] * Point3::origin();
        // The face towards the cap's axis is at its radius.
        assert!((center.x.abs() - half_extents.x - 0.024).abs() < 1e-12, "{name}: {center}");
        assert!(center.x * side > 0.0);
        assert!((center.z - 0.037).abs() < 1e-12);
    }
}

#[test]
fn bottle_cap_pairs_leave_out_joined_and_welded_links() {
    let scene = load("bottle-cap-3dof");
    let pairs = pair_names(&scene);
    for (a, b) in [
        ("cap/cap_base", "cap/cap"),
        ("gripper/wsg_body", "gripper/left_finger"),
        ("gripper/wsg_body", "gripper/right_finger"),
        ("cap/cap_base", "obstacle_1"),
        ("obstacle_1", "obstacle_2"),
    ] {
        assert!(!pairs.contains(&(a, b)) && !pairs.contains(&(b, a)), "{a} {b}");
    }
    assert!(pairs.contains(&("gripper/left_finger", "gripper/right_finger")));
    assert!(pairs.contains(&("gripper/left_finger", "cap/cap")));
}

#[test]
fn clearance_is_not_asked_of_robot_and_object() {
    let scene = load("bottle-cap-3dof");
    let mut task = scene.task(None).unwrap().clone();
    task.clearance = 0.001;
    for (pair, (a, b)) in scene.collision_pairs().into_iter().zip(pair_names(&scene)) {
        let contact = a.starts_with("gripper/") && b.starts_with("cap/");
        assert_eq!(scene.required_clearance(&task, pair), if contact { 0.0 } else { 0.001 }, "{a} {b}");
    }
}

#[test]
fn iiwa14_shelf_has_324_pairs_and_its_kinematics() {
    let scene = load("iiwa14-shelf");
    assert_eq!(scene.dim(), 7);
    assert!(scene.tasks.is_empty() && scene.task(None).is_err());
    assert_eq!(scene.collision_pairs().len(), 324);
    assert_eq!(scene.bodies.len(), 16 + 16);
    let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7];
    let p_WG = link_poses(&scene, &q)[scene.link_idx("iiwa14/wsg").unwrap()] * Point3::origin();
    // Given in scenes.md to six digits, from an independent engine.
    assert!((p_WG - Point3::new(0.055576, 0.017814, 1.342534)).norm() < 1e-6, "{p_WG}");
    assert!(!pair_names(&scene).iter().any(|(a, b)| *a == "iiwa14/link_5" && *b == "iiwa14/link_7"));
}

#[test]
fn iiwa14_tool_reaches_the_milestones() {
    let scene = load("iiwa14-shelf");
    // Milestones and tool targets of scenes.md; the tool point is a constant offset from the gripper's origin.
    let milestones = [
        ([-0.301024, 0.523691, 0.224335, -0.598516, 0.226598, 0.481853, 1.257369], [0.75, -0.12, 0.9]),
        ([0.616013, 0.485002, -0.612152, -1.323945, 0.377728, -0.155048, 1.468885], [0.75, 0.12, 0.67]),
        ([1.205705, 0.795638, 0.357506, -1.47261, -0.31593, 0.93008, 1.654183], [0.08, 0.6, 0.22]),
        ([-1.468807, 0.796227, -0.360682, -1.472515, 0.318728, 0.930758, 1.220615], [-0.08, -0.6, 0.22]),
    ];
    let gripper = scene.link_idx("iiwa14/wsg").unwrap();
    let p_GT: Vec<Point3<f64>> = milestones
        .iter()
        .map(|(q, target)| link_poses(&scene, q)[gripper].inverse() * Point3::from(*target))
        .collect();
    for p in &p_GT {
        assert!((p - p_GT[0]).norm() < 1e-3, "{p_GT:?}");
    }
}

#[test]
fn tiny_scenes_have_the_stated_pairs() {
    for (name, n_pairs) in [("slider-gap", 2), ("hinge", 2), ("two-rooms", 3), ("two-rooms-closed", 3)] {
        assert_eq!(load(name).collision_pairs().len(), n_pairs, "{name}");
    }
}

#[test]
fn tiny_scenes_have_their_free_share() {
    // All bodies are axis-aligned boxes that only translate: interval overlap in each axis is the truth. The
    // cells are such that every face of the free space lies between cells: the count is exact.
    let cases: [(&str, &[usize], f64); 2] =
        [("slider-gap", &[200, 100], 0.84), ("two-rooms", &[30, 80, 35], 33.0 / 35.0)];
    for (name, steps, expected) in cases {
        let scene = load(name);
        let total: usize = steps.iter().product();
        let free = (0..total).filter(|&cell| {
            let mut rest = cell;
            let q: Vec<f64> = (0..scene.dim())
                .map(|k| {
                    let share = ((rest % steps[k]) as f64 + 0.5) / steps[k] as f64;
                    rest /= steps[k];
                    scene.coordinates[k].lower
                        + (scene.coordinates[k].upper - scene.coordinates[k].lower) * share
                })
                .collect();
            boxes_are_free(&scene, &q)
        });
        let share = free.count() as f64 / total as f64;
        assert!((share - expected).abs() < 1e-12, "{name}: {share}");
    }
}

fn boxes_are_free(scene: &Scene, q: &[f64]) -> bool {
    let poses = link_poses(scene, q);
    let sides = |body_idx: usize| {
        let body = &scene.bodies[body_idx];
        let Shape::Box { half_extents } = &body.shape else { panic!("{} is a box", body.name) };
        ((poses[body.link_idx] * body.X_LS).translation.vector, *half_extents)
    };
    scene.collision_pairs().iter().all(|pair| {
        let ((p_a, h_a), (p_b, h_b)) = (sides(pair.body_a), sides(pair.body_b));
        (0..3).any(|k| (p_a[k] - p_b[k]).abs() >= h_a[k] + h_b[k])
    })
}

#[test]
fn two_rooms_is_solved_by_the_stated_plan_and_its_twin_is_cut_in_two() {
    let (open, closed) = (load("two-rooms"), load("two-rooms-closed"));
    let waypoints: [[f64; 3]; 4] =
        [[-0.25, -0.25, 0.3], [-0.25, -0.25, 0.075], [0.25, 0.25, 0.075], [0.25, 0.25, 0.3]];
    let mut length = 0.0_f64;
    for edge in waypoints.windows(2) {
        length += (0..3).map(|k| (edge[1][k] - edge[0][k]).powi(2)).sum::<f64>().sqrt();
        for step in 0..=100 {
            let q: Vec<f64> =
                (0..3).map(|k| edge[0][k] + (edge[1][k] - edge[0][k]) * f64::from(step) / 100.0).collect();
            assert!(boxes_are_free(&open, &q), "{q:?}");
        }
    }
    assert!((length - 1.1571068).abs() < 1e-7);
    let task = open.task(Some("carry")).unwrap();
    assert_eq!(task.transit_keep[0].as_slice(), [1.0, 0.0, 0.0], "the default: the object rests");
    assert_eq!((task.grasp.rows[0].lower, task.grasp.rows[0].upper), (-0.02, 0.02));
    // Across the wall of the twin nothing passes, wherever the block is.
    for block in 0..=60 {
        for y in 0..=100 {
            let q = [-0.3 + 0.01 * f64::from(block), 0.0, 0.05 + 0.0035 * f64::from(y)];
            assert!(!boxes_are_free(&closed, &q));
        }
    }
    assert!(boxes_are_free(&closed, &[-0.25, -0.25, 0.3]) && boxes_are_free(&closed, &[0.25, 0.25, 0.3]));
}

#[test]
fn hinge_touches_the_wall_at_pi_over_6() {
    let scene = load("hinge");
    assert_eq!(scene.collision_pairs().len(), 2);
    let wall = &scene.bodies[scene.body_idx("wall").unwrap()];
    let Shape::Box { half_extents } = &wall.shape else { panic!("the wall is a box") };
    let face = scene.links[wall.link_idx].X_PF.translation.y - half_extents.y;
    let tip = &scene.bodies[scene.body_idx("hinge/arm").unwrap()];
    let Shape::Sphere { radius } = tip.shape else { panic!("the tip is a ball") };
    let q = [std::f64::consts::FRAC_PI_6];
    let p_WT = link_poses(&scene, &q)[tip.link_idx] * tip.X_LS * Point3::origin();
    assert!((p_WT.y + radius - face).abs() < 1e-12);
}

#[test]
fn roles_and_parents_of_links() {
    for name in ["bottle-cap-3dof", "bottle-cap-4dof", "iiwa14-shelf", "two-rooms", "hinge", "slider-gap"] {
        let scene = load(name);
        assert_eq!((scene.links[0].name.as_str(), scene.links[0].parent), ("world", None));
        for (link_idx, link) in scene.links.iter().enumerate().skip(1) {
            assert!(link.parent.unwrap() < link_idx);
            let role = match link.name.split('/').next().unwrap() {
                "gripper" | "iiwa14" | "pusher" | "hinge" | "slider" => Role::Robot,
                "cap" | "block" => Role::Object,
                _ => Role::Obstacle,
            };
            assert_eq!(link.role, role, "{}", link.name);
        }
    }
}

#[test]
fn digest_is_blake3_of_names_lengths_and_bytes() {
    let scene = load("bottle-cap-3dof");
    let names: Vec<_> = scene.files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["cap.urdf", "gripper.urdf", "scene.toml"]);
    let mut bytes = Vec::new();
    for name in names {
        let content = std::fs::read(folder("bottle-cap-3dof").join(name)).unwrap();
        bytes.extend(name.as_bytes());
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(content);
    }
    assert_eq!(scene.digest, *blake3::hash(&bytes).as_bytes());
}

#[test]
fn folder_and_file_are_the_same_scene_and_so_are_copies_of_its_files() {
    let scene = load("two-rooms");
    assert_eq!(scene, Scene::load(&folder("two-rooms").join("scene.toml")).unwrap());
    let copy = tempfile::tempdir().unwrap();
    for file in &scene.files {
        std::fs::write(copy.path().join(&file.name), &file.bytes).unwrap();
    }
    assert_eq!(scene, Scene::load(copy.path()).unwrap());
    std::fs::rename(copy.path().join("scene.toml"), copy.path().join("other.toml")).unwrap();
    assert_eq!(scene.digest, Scene::load(&copy.path().join("other.toml")).unwrap().digest);
    std::fs::write(copy.path().join("block.urdf"), [&scene.files[0].bytes[..], b"\n"].concat()).unwrap();
    assert_ne!(scene.digest, Scene::load(&copy.path().join("other.toml")).unwrap().digest);
}
