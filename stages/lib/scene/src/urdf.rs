//! A URDF file as links with shapes and joints; the only module that names urdf-rs.

use crate::error::{Place, SceneError};
use crate::numbers::{finite, pose, positive};
use crate::{RigidTransform, Shape};
use nalgebra::{Unit, Vector3};
use std::collections::BTreeSet;
use urdf_rs::{Geometry, JointType};

/// A kinematic tree; links in the order in which a parent precedes its children, the root first.
#[derive(Debug)]
pub struct UrdfTree {
    pub links: Vec<UrdfLink>,
}

/// A link and the joint that holds it.
#[derive(Debug)]
pub struct UrdfLink {
    pub name: String,
    pub shapes: Vec<(RigidTransform, Shape)>,
    /// `None` for the root.
    pub joint: Option<UrdfJoint>,
}

/// A joint, seen from its child link.
#[derive(Debug)]
pub struct UrdfJoint {
    pub name: String,
    /// Position of the parent link in `UrdfTree::links`.
    pub parent: usize,
    /// Pose of the joint's frame F in the parent link P.
    pub X_PF: RigidTransform,
    pub kind: UrdfJointKind,
}

/// The supported kinds. `limits` are those of the file, `None` where it gives no range.
#[derive(Debug)]
pub enum UrdfJointKind {
    Fixed,
    Revolute { axis: Unit<Vector3<f64>>, limits: Option<(f64, f64)> },
    Continuous { axis: Unit<Vector3<f64>> },
    Prismatic { axis: Unit<Vector3<f64>>, limits: Option<(f64, f64)> },
    Planar { normal: Unit<Vector3<f64>> },
}

/// Parses `bytes`, the content of `file`, as the model called `model`.
pub fn parse(file: &str, model: &str, bytes: &[u8]) -> Result<UrdfTree, SceneError> {
    let text = std::str::from_utf8(bytes)
        .map_err(|error| SceneError::NotUtf8 { file: file.to_owned(), offset: error.valid_up_to() })?;
    let refuse = |message: String| SceneError::Urdf { file: file.to_owned(), message };
    crate::xml_guard::check(text).map_err(refuse)?;
    let robot = urdf_rs::read_from_string(text).map_err(|error| {
        let message = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        // The prefix is the XML reader's name for errors that urdf-rs raises.
        refuse(message.trim_start_matches("custom: ").to_owned())
    })?;
    let reader = Reader { file, model };
    reader.check_names(&robot)?;
    reader.tree(&robot)
}

struct Reader<'a> {
    file: &'a str,
    model: &'a str,
}

impl Reader<'_> {
    fn at(&self, field: impl Into<String>) -> Place {
        Place { file: self.file.to_owned(), field: field.into() }
    }

    fn check_names(&self, robot: &urdf_rs::Robot) -> Result<(), SceneError> {
        let names = [
            ("link", robot.links.iter().map(|link| &link.name).collect::<Vec<_>>()),
            ("joint", robot.joints.iter().map(|joint| &joint.name).collect()),
        ];
        for (element, names) in names {
            let mut seen = BTreeSet::new();
            for name in names {
                let at = self.at(format!("{element} name"));
                if name.trim().is_empty() || name.chars().any(char::is_control) {
                    return Err(SceneError::BadName { at, value: name.clone() });
                }
                if !seen.insert(name) {
                    return Err(SceneError::DuplicateName { at, value: name.clone() });
                }
            }
        }
        Ok(())
    }

    /// Orders the links from the root outwards, depth first, children in the order of the file's joints.
    fn tree(&self, robot: &urdf_rs::Robot) -> Result<UrdfTree, SceneError> {
        let link_idx = |element: String, name: &str| {
            robot.links.iter().position(|link| link.name == name).ok_or_else(|| SceneError::UnknownUrdfLink {
                at: self.at(element),
                value: name.to_owned(),
                remedy: "add the link or correct the name",
            })
        };
        // For each link the joints it is parent of; whether it is a child.
        let mut child_joints: Vec<Vec<(usize, usize)>> = vec![Vec::new(); robot.links.len()];
        let mut has_parent = vec![false; robot.links.len()];
        for (joint_idx, joint) in robot.joints.iter().enumerate() {
            let parent = link_idx(format!("joint \"{}\" parent", joint.name), &joint.parent.link)?;
            let child = link_idx(format!("joint \"{}\" child", joint.name), &joint.child.link)?;
            if std::mem::replace(&mut has_parent[child], true) {
                let at = self.at(format!("joint \"{}\" child", joint.name));
                return Err(SceneError::TwoParents { at, value: joint.child.link.clone() });
            }
            child_joints[parent].push((joint_idx, child));
        }
        let roots: Vec<usize> = (0..robot.links.len()).filter(|&link| !has_parent[link]).collect();
        let [root] = roots[..] else {
            let names = crate::error::listed(roots.iter().map(|&link| &robot.links[link].name));
            return Err(SceneError::Roots { at: self.at("links"), found: roots.len(), names });
        };
        let mut tree = UrdfTree { links: Vec::new() };
        let mut placed = vec![false; robot.links.len()];
        let mut stack: Vec<(usize, Option<(usize, usize)>)> = vec![(root, None)];
        while let Some((link, from)) = stack.pop() {
            placed[link] = true;
            let joint = match from {
                Some((joint_idx, parent)) => Some(self.joint(&robot.joints[joint_idx], parent)?),
                None => None,
            };
            let tree_idx = tree.links.len();
            let shapes = self.shapes(&robot.links[link])?;
            tree.links.push(UrdfLink { name: robot.links[link].name.clone(), shapes, joint });
            let children = child_joints[link].iter().rev();
            stack.extend(children.map(|&(joint_idx, child)| (child, Some((joint_idx, tree_idx)))));
        }
        // One parent a link: what the root does not reach lies on or behind a cycle.
        match placed.iter().position(|&placed| !placed) {
            Some(link) => {
                Err(SceneError::Cycle { at: self.at("joints"), value: robot.links[link].name.clone() })
            }
            None => Ok(tree),
        }
    }

    fn joint(&self, joint: &urdf_rs::Joint, parent: usize) -> Result<UrdfJoint, SceneError> {
        let field = |part: &str| self.at(format!("joint \"{}\" {part}", joint.name));
        let unsupported = |kind, remedy| SceneError::UnsupportedJoint {
            at: self.at("type"),
            model: self.model.into(),
            joint: joint.name.as_str().into(),
            kind,
            remedy,
        };
        if joint.mimic.is_some() {
            let remedy = "make the joint independent, or fixed, and state the relation as a row of the task";
            return Err(unsupported("mimic", remedy));
        }
        let axis = || {
            let xyz = *joint.axis.xyz;
            for k in 0..3 {
                finite(field(&format!("axis xyz[{k}]")), xyz[k])?;
            }
            Unit::try_new(Vector3::from(xyz), 1e-9)
                .ok_or_else(|| SceneError::ZeroAxis { at: field("axis xyz"), value: format!("{xyz:?}") })
        };
        let limits = || {
            let (lower, upper) = (joint.limit.lower, joint.limit.upper);
            // From URDF 1.2 on, a side that is left out reads as infinite: no range.
            if lower == f64::NEG_INFINITY || upper == f64::INFINITY {
                return Ok(None);
            }
            finite(field("limit lower"), lower)?;
            finite(field("limit upper"), upper)?;
            if lower < upper {
                Ok(Some((lower, upper)))
            } else {
                Err(SceneError::NotOrdered { at: field("limit"), lower, upper })
            }
        };
        let kind = match joint.joint_type {
            JointType::Fixed => UrdfJointKind::Fixed,
            JointType::Revolute => UrdfJointKind::Revolute { axis: axis()?, limits: limits()? },
            JointType::Continuous => UrdfJointKind::Continuous { axis: axis()? },
            JointType::Prismatic => UrdfJointKind::Prismatic { axis: axis()?, limits: limits()? },
            JointType::Planar => UrdfJointKind::Planar { normal: axis()? },
            JointType::Floating => {
                let remedy =
                    "use three prismatic and three revolute joints in a row, with links without shapes";
                return Err(unsupported("floating", remedy));
            }
            JointType::Spherical => {
                let remedy = "use three revolute joints in a row, with links without shapes";
                return Err(unsupported("spherical", remedy));
            }
        };
        let X_PF = pose(|part| field(&format!("origin {part}")), *joint.origin.xyz, *joint.origin.rpy)?;
        Ok(UrdfJoint { name: joint.name.clone(), parent, X_PF, kind })
    }

    fn shapes(&self, link: &urdf_rs::Link) -> Result<Vec<(RigidTransform, Shape)>, SceneError> {
        let mut shapes = Vec::with_capacity(link.collision.len());
        for (shape_idx, collision) in link.collision.iter().enumerate() {
            let field = |part: &str| self.at(format!("link \"{}\" collision[{shape_idx}] {part}", link.name));
            let shape = match &collision.geometry {
                Geometry::Box { size } => cuboid(|part| field(&format!("box {part}")), **size)?,
                Geometry::Cylinder { radius, length } => Shape::Cylinder {
                    radius: positive(field("cylinder radius"), *radius)?,
                    half_length: positive(field("cylinder length"), *length)? / 2.0,
                },
                Geometry::Capsule { radius, length } => Shape::Capsule {
                    radius: positive(field("capsule radius"), *radius)?,
                    half_length: positive(field("capsule length"), *length)? / 2.0,
                },
                Geometry::Sphere { radius } => {
                    Shape::Sphere { radius: positive(field("sphere radius"), *radius)? }
                }
                Geometry::Mesh { .. } => {
                    return Err(SceneError::UnsupportedShape {
                        at: self.at(format!("collision[{shape_idx}]")),
                        model: self.model.into(),
                        link: link.name.as_str().into(),
                        kind: "mesh",
                        remedy: "put boxes, cylinders, spheres or capsules around it",
                    });
                }
            };
            let origin = &collision.origin;
            let X_LS = pose(|part| field(&format!("origin {part}")), *origin.xyz, *origin.rpy)?;
            shapes.push((X_LS, shape));
        }
        Ok(shapes)
    }
}

/// A box of the given full `size`.
pub fn cuboid(at: impl Fn(&str) -> Place, size: [f64; 3]) -> Result<Shape, SceneError> {
    let mut half_extents = Vector3::zeros();
    for k in 0..3 {
        half_extents[k] = positive(at(&format!("size[{k}]")), size[k])? / 2.0;
    }
    Ok(Shape::Box { half_extents })
}
