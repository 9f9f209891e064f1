//! Links that are held: the scene while a link of an object moves rigidly with a link of a robot.

use crate::{Link, Motion, RigidTransform, Role, Scene};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

/// A link that cannot be held as asked.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum AttachError {
    #[error("there is no link {name}; the links are {known}")]
    UnknownLink { name: String, known: String },
    #[error("{name} is no link of a model with role {role}; an object's link is held by a robot's")]
    Role { name: String, role: &'static str },
    #[error("{gripper} moves with {object}, so it cannot hold it")]
    Cycle { object: String, gripper: String },
}

/// The pose with this rotation, a quaternion (i, j, k, w) of any length but 0, and translation, metres; `None` where these
/// are no finite numbers.
pub fn pose_from_numbers(rotation: [f64; 4], translation: [f64; 3]) -> Option<RigidTransform> {
    let [i, j, k, w] = rotation;
    let quaternion = Quaternion::new(w, i, j, k);
    let is_finite = quaternion.norm().is_finite() && translation.iter().all(|x| x.is_finite());
    let rotation = UnitQuaternion::try_new(quaternion, 1e-6).filter(|_| is_finite)?;
    Some(RigidTransform::from_parts(Translation3::from(translation), rotation))
}

impl Scene {
    /// The scene in which `object` (with all links below it) is rigid on `gripper` at `X_GO`, whatever the object's own
    /// coordinates are; both links by name.
    ///
    /// Bodies, coordinates and tasks keep their positions; links are put in an order in which parents come first.
    /// The pairs that count follow from this scene as from any other: bodies on links that are now rigid to each other
    /// do not count, and links that a joint of the scene joins still do not.
    pub fn with_attached(
        &self,
        object: &str,
        gripper: &str,
        X_GO: &RigidTransform,
    ) -> Result<Scene, AttachError> {
        let object_idx = self.link_with_role(object, Role::Object)?;
        let gripper_idx = self.link_with_role(gripper, Role::Robot)?;
        if self.moves_with(gripper_idx, object_idx) {
            return Err(AttachError::Cycle { object: object.to_owned(), gripper: gripper.to_owned() });
        }
        // All that hangs on the object comes last, in its old order: then parents still come first.
        let (held, others): (Vec<usize>, Vec<usize>) =
            (0..self.links.len()).partition(|&link_idx| self.moves_with(link_idx, object_idx));
        let order: Vec<usize> = others.into_iter().chain(held).collect();
        let mut position = vec![0; order.len()];
        order.iter().enumerate().for_each(|(new, &old)| position[old] = new);
        let links = order.iter().map(|&old| {
            let link = &self.links[old];
            if old == object_idx {
                let (parent, X_PF, motion) = (Some(position[gripper_idx]), *X_GO, Motion::Fixed);
                Link { name: link.name.clone(), role: link.role, parent, X_PF, motion }
            } else {
                Link { parent: link.parent.map(|parent| position[parent]), ..link.clone() }
            }
        });
        let moved = |pairs: &[(usize, usize)]| {
            let both = pairs.iter().map(|&(a, b)| (position[a], position[b]));
            let mut pairs: Vec<(usize, usize)> = both.map(|(a, b)| (a.min(b), a.max(b))).collect();
            pairs.sort_unstable();
            pairs
        };
        let mut scene = Scene {
            links: links.collect(),
            adjacent_links: moved(&self.adjacent_links),
            excluded_links: moved(&self.excluded_links),
            ..self.clone()
        };
        scene.bodies.iter_mut().for_each(|body| body.link_idx = position[body.link_idx]);
        Ok(scene)
    }

    fn link_with_role(&self, name: &str, role: Role) -> Result<usize, AttachError> {
        let link_idx = self.link_idx(name).ok_or_else(|| {
            let known: Vec<&str> = self.links.iter().map(|link| link.name.as_str()).collect();
            AttachError::UnknownLink { name: name.to_owned(), known: known.join(", ") }
        })?;
        if self.links[link_idx].role == role {
            return Ok(link_idx);
        }
        let role = if role == Role::Object { "object" } else { "robot" };
        Err(AttachError::Role { name: name.to_owned(), role })
    }

    /// Whether `link_idx` is `ancestor_idx` or hangs on it.
    pub fn moves_with(&self, link_idx: usize, ancestor_idx: usize) -> bool {
        let mut at = Some(link_idx);
        while let Some(link_idx) = at {
            if link_idx == ancestor_idx {
                return true;
            }
            at = self.links[link_idx].parent;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: &str = r#"<robot name="arm"><link name="base"/><link name="hand"><collision><geometry><box size="0.1 0.1 0.1"/>
        </geometry></collision></link><joint name="slide" type="prismatic"><parent link="base"/><child link="hand"/>
        <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"#;
    const OBJECT: &str = r#"<robot name="box"><link name="rail"/><link name="box"><collision><geometry><box size="0.2 0.2 0.2"/>
        </geometry></collision></link><link name="lid"><collision><geometry><sphere radius="0.05"/></geometry></collision>
        </link><joint name="push" type="prismatic"><parent link="rail"/><child link="box"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint><joint name="open" type="revolute">
        <parent link="box"/><child link="lid"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
        </joint></robot>"#;
    /// The object's links come before the robot's.
    const SCENE: &str = r#"
format = 1
name = "held"
[[model]]
name = "box"
role = "object"
urdf = "box.urdf"
[[model]]
name = "arm"
role = "robot"
urdf = "arm.urdf"
[[obstacle]]
name = "wall"
box = { size = [0.1, 1.0, 1.0] }
xyz = [3.0, 0.0, 0.0]
[coordinates]
order = ["slide", "push", "open"]
"#;

    fn scene() -> Scene {
        Scene::from_text(SCENE, &[("box.urdf", OBJECT), ("arm.urdf", ROBOT)]).expect("a scene")
    }

    fn names(scene: &Scene) -> Vec<(String, String)> {
        let body = |body: usize| scene.bodies[body].name.clone();
        scene.collision_pairs().iter().map(|pair| (body(pair.body_a), body(pair.body_b))).collect()
    }

    #[test]
    fn the_held_link_hangs_on_the_gripper_and_its_own_links_on_it() {
        let scene = scene();
        let X_GO = RigidTransform::from_parts(Translation3::new(0.2, 0.0, 0.0), UnitQuaternion::identity());
        let held = scene.with_attached("box/box", "arm/hand", &X_GO).expect("it can be held");
        let link = |name: &str| &held.links[held.link_idx(name).expect("a link")];
        let parent = |name: &str| held.links[link(name).parent.expect("a parent")].name.clone();
        assert_eq!((parent("box/box"), parent("box/lid")), ("arm/hand".into(), "box/box".into()));
        assert_eq!((&link("box/box").motion, link("box/box").X_PF), (&Motion::Fixed, X_GO));
        assert!(
            held.links.iter().enumerate().all(|(idx, link)| link.parent.is_none_or(|parent| parent < idx))
        );
        assert_eq!(held.coordinates, scene.coordinates);
        for (before, after) in scene.bodies.iter().zip(&held.bodies) {
            assert_eq!(before.name, after.name);
            assert_eq!(scene.links[before.link_idx].name, held.links[after.link_idx].name);
        }
    }

    #[test]
    fn what_is_held_counts_against_all_but_its_gripper_and_what_its_joints_join() {
        let scene = scene();
        let held = scene.with_attached("box/box", "arm/hand", &RigidTransform::identity()).expect("held");
        let has = |scene: &Scene, a: &str, b: &str| {
            names(scene).iter().any(|(x, y)| (x == a && y == b) || (x == b && y == a))
        };
        assert!(has(&scene, "box/box", "arm/hand") && !has(&held, "box/box", "arm/hand"));
        assert!(
            has(&held, "box/lid", "arm/hand")
                && has(&held, "box/box", "wall")
                && has(&held, "arm/hand", "wall")
        );
        assert!(!has(&held, "box/box", "box/lid"));
    }

    #[test]
    fn poses_from_numbers() {
        let X = pose_from_numbers([0.0, 0.0, 2.0, 2.0], [1.0, 2.0, 3.0]).expect("a pose");
        assert!((X.rotation.angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert_eq!(X.translation.vector.as_slice(), [1.0, 2.0, 3.0]);
        assert_eq!(pose_from_numbers([0.0; 4], [0.0; 3]), None);
        assert_eq!(pose_from_numbers([0.0, 0.0, 0.0, f64::NAN], [0.0; 3]), None);
        assert_eq!(pose_from_numbers([0.0, 0.0, 0.0, 1.0], [0.0, f64::INFINITY, 0.0]), None);
    }

    #[test]
    fn links_that_cannot_hold_or_be_held_are_refused_by_name() {
        let scene = scene();
        let refused = |object: &str, gripper: &str| {
            let outcome = scene.with_attached(object, gripper, &RigidTransform::identity());
            outcome.expect_err("it cannot be held").to_string()
        };
        assert!(refused("box/bux", "arm/hand").contains("no link box/bux; the links are world, box/rail"));
        assert!(refused("arm/hand", "arm/base").contains("role object"));
        assert!(refused("box/box", "wall").contains("role robot"));
        assert!(refused("box/box", "box/lid").contains("role robot"));
    }
}
