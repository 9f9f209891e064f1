//! Joint kinds, branching and several models become links with one motion each.

use nalgebra::Vector3;
use scene::{CoordinateKind, Motion, RigidTransform, Scene, Shape};

fn scene(models: &[(&str, &str)], rest: &str) -> Scene {
    let mut text = "format = 1\nname = \"rig\"\n".to_owned();
    for (name, urdf) in models {
        text += &format!("[[model]]\nname = \"{name}\"\nrole = \"robot\"\nurdf = \"{urdf}\"\n");
    }
    match Scene::from_text(&(text + rest), &[("arm.urdf", ARM), ("puck.urdf", PUCK)]) {
        Ok(scene) => scene,
        Err(error) => panic!("{error}"),
    }
}

/// A palm with two jaws, and a finger welded on one of them.
const ARM: &str = r#"<robot name="arm">
  <joint name="right" type="prismatic"><parent link="palm"/><child link="right_jaw"/><axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="left" type="prismatic"><parent link="palm"/><child link="left_jaw"/><axis xyz="0 -2 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="weld" type="fixed"><parent link="left_jaw"/><child link="finger"/><origin xyz="0 0 1"/></joint>
  <joint name="yaw" type="continuous"><parent link="base"/><child link="palm"/><axis xyz="0 0 1"/></joint>
  <link name="finger">
    <collision><geometry><capsule radius="0.1" length="0.4"/></geometry></collision>
    <collision><origin xyz="0 0 1"/><geometry><sphere radius="0.2"/></geometry></collision>
  </link>
  <link name="left_jaw"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="right_jaw"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="palm"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="base"/>
</robot>"#;

/// A disc that slides and turns in a plane.
const PUCK: &str = r#"<robot name="puck">
  <link name="table"/>
  <joint name="glide" type="planar"><parent link="table"/><child link="puck"/><origin xyz="1 2 3"/><axis xyz="0 0 1"/></joint>
  <link name="puck"><collision><geometry><cylinder radius="0.1" length="0.1"/></geometry></collision></link>
</robot>"#;

#[test]
fn a_branching_tree_with_welds() {
    let scene = scene(
        &[("arm", "arm.urdf")],
        "[coordinates]\norder = [\"left\", \"yaw\", \"right\"]\nlimits = { yaw = [-3.0, 3.0] }",
    );
    let names: Vec<_> = scene.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(
        names,
        ["world", "arm/base", "arm/palm", "arm/right_jaw", "arm/left_jaw", "arm/finger"],
        "root first, children in the order of the joints"
    );
    let left = &scene.links[4];
    assert_eq!(left.parent, Some(2));
    assert_eq!(left.motion, Motion::Prismatic { axis: -Vector3::y_axis(), coordinate_idx: 0 }, "unit axis");
    assert_eq!(scene.links[5].X_PF, RigidTransform::translation(0.0, 0.0, 1.0));
    let bodies: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
    assert_eq!(bodies[3..], ["arm/finger", "arm/finger#2"]);
    assert_eq!(scene.bodies[3].shape, Shape::Capsule { radius: 0.1, half_length: 0.2 });
    assert_eq!(scene.bodies[4].X_LS, RigidTransform::translation(0.0, 0.0, 1.0));
    // Left out: palm-left, palm-right (joined), left-finger (welded). The finger and the palm, two joints
    // apart, count, and so do both bodies of the finger against the right jaw.
    let pairs: Vec<_> = scene
        .collision_pairs()
        .iter()
        .map(|p| (scene.bodies[p.body_a].name.as_str(), scene.bodies[p.body_b].name.as_str()))
        .collect();
    assert_eq!(
        pairs,
        [
            ("arm/palm", "arm/finger"),
            ("arm/palm", "arm/finger#2"),
            ("arm/right_jaw", "arm/left_jaw"),
            ("arm/right_jaw", "arm/finger"),
            ("arm/right_jaw", "arm/finger#2"),
        ]
    );
}

#[test]
fn a_planar_joint_is_two_slides_and_a_turn() {
    let scene = scene(
        &[("puck", "puck.urdf")],
        "[coordinates]\norder = [\"glide_theta\", \"glide_x\", \"glide_y\"]\n\
         limits = { glide_x = [-1, 1], glide_y = [-2, 2], glide_theta = [-3, 3] }",
    );
    let kinds: Vec<_> = scene.coordinates.iter().map(|c| c.kind).collect();
    use CoordinateKind::{Prismatic, Revolute};
    assert_eq!(kinds, [Revolute, Prismatic, Prismatic]);
    let motions: Vec<_> = scene.links[2..].iter().map(|link| link.motion.clone()).collect();
    assert_eq!(
        motions,
        [
            Motion::Prismatic { axis: Vector3::x_axis(), coordinate_idx: 1 },
            Motion::Prismatic { axis: Vector3::y_axis(), coordinate_idx: 2 },
            Motion::Revolute { axis: Vector3::z_axis(), coordinate_idx: 0 },
        ]
    );
    assert_eq!(scene.links[2].X_PF, RigidTransform::translation(1.0, 2.0, 3.0));
    assert_eq!(scene.links[4].name, "puck/puck");
    assert_eq!(scene.adjacent_links, [(1, 4)], "the joint of the model joins table and puck");
}

#[test]
fn the_axes_of_a_planar_joint_span_its_plane() {
    for normal in ["0 0 -1", "1 0 0", "0.3 -0.4 0.5", "0 1e-9 -1"] {
        let urdf = PUCK.replace("<axis xyz=\"0 0 1\"/>", &format!("<axis xyz=\"{normal}\"/>"));
        let text = "format = 1\nname = \"rig\"\n[[model]]\nname = \"p\"\nrole = \"object\"\nurdf = \"p.urdf\"\n\
            [coordinates]\norder = [\"glide_x\", \"glide_y\", \"glide_theta\"]\n\
            limits = { glide_x = [-1, 1], glide_y = [-2, 2], glide_theta = [-3, 3] }";
        let scene = Scene::from_text(text, &[("p.urdf", &urdf)]).unwrap();
        let axes: Vec<Vector3<f64>> = scene.links[2..]
            .iter()
            .map(|link| match &link.motion {
                Motion::Prismatic { axis, .. } | Motion::Revolute { axis, .. } => axis.into_inner(),
                Motion::Fixed => panic!("{} moves", link.name),
            })
            .collect();
        assert!((axes[0].cross(&axes[1]) - axes[2]).norm() < 1e-12, "right-handed for {normal}: {axes:?}");
    }
}

#[test]
fn planar_joints_need_limits() {
    let text = "format = 1\nname = \"rig\"\n[[model]]\nname = \"p\"\nrole = \"object\"\nurdf = \"p.urdf\"\n\
        [coordinates]\norder = [\"glide_x\", \"glide_y\", \"glide_theta\"]\n\
        limits = { glide_x = [-1, 1], glide_y = [-2, 2] }";
    let message = Scene::from_text(text, &[("p.urdf", PUCK)]).unwrap_err().to_string();
    assert!(message.contains("planar joint `glide_theta` has no range"), "{message}");
}

#[test]
fn two_arms_share_a_urdf_and_their_joints_are_told_apart() {
    let arms = [("first", "arm.urdf"), ("second", "arm.urdf")];
    let order = "[coordinates]\norder = [\"first/yaw\", \"first/left\", \"first/right\", \"second/yaw\", \
                 \"second/left\", \"second/right\"]\n\
                 limits = { \"first/yaw\" = [-3, 3], \"second/yaw\" = [-1, 1] }";
    let scene = scene(&arms, order);
    assert_eq!((scene.dim(), scene.bodies.len(), scene.files.len()), (6, 10, 2));
    assert_eq!(scene.coordinate_idx("second/yaw"), Some(3));
    assert_eq!(scene.upper()[3], 1.0);
    // 5 pairs within each arm; between them all 25.
    assert_eq!(scene.collision_pairs().len(), 35);

    let ambiguous = order.replace("\"first/yaw\", ", "\"yaw\", ");
    let mut text = "format = 1\nname = \"rig\"\n".to_owned();
    for (name, urdf) in arms {
        text += &format!("[[model]]\nname = \"{name}\"\nrole = \"robot\"\nurdf = \"{urdf}\"\n");
    }
    let message = Scene::from_text(&(text + &ambiguous), &[("arm.urdf", ARM)]).unwrap_err().to_string();
    assert!(
        message.contains("coordinates.order[0] = yaw: several joints")
            && message.contains("first/yaw, second/yaw"),
        "{message}"
    );
}
