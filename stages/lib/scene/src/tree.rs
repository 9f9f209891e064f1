//! Models and obstacles to one composite tree with bodies and movable joints.

use crate::document::{Document, ModelTable, ObstacleTable, RoleName};
use crate::error::{Place, SceneError, listed};
use crate::numbers::{pose, positive};
use crate::urdf::{UrdfJoint, UrdfJointKind, UrdfTree, cuboid};
use crate::{Body, CoordinateKind, Link, Motion, RigidTransform, Role, Shape};
use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};
use std::collections::BTreeSet;

/// The composite tree. Until the order of the coordinates is known, `coordinate_idx` of a motion is the
/// position in `movable`.
pub struct CompositeTree {
    pub links: Vec<Link>,
    pub bodies: Vec<Body>,
    pub movable: Vec<MovableJoint>,
    pub adjacent_links: Vec<(usize, usize)>,
    pub excluded_links: Vec<(usize, usize)>,
}

/// A one-dimensional joint, before the scene orders them.
pub struct MovableJoint {
    pub model: String,
    /// Name in the model: of the joint, with `_x`, `_y`, `_theta` for the parts of a planar one.
    pub name: String,
    /// Kind of the joint in the file.
    pub joint_kind: &'static str,
    pub kind: CoordinateKind,
    pub role: Role,
    /// The range of the file; `None` if the scene must name it.
    pub limits: Option<(f64, f64)>,
}

impl CompositeTree {
    /// World, the models in the order of the scene file, the obstacles. `place` names a field of the file.
    pub fn build(
        document: &Document,
        trees: Vec<UrdfTree>,
        place: &dyn Fn(String) -> Place,
    ) -> Result<Self, SceneError> {
        let world = Link {
            name: "world".to_owned(),
            role: Role::Obstacle,
            parent: None,
            X_PF: RigidTransform::identity(),
            motion: Motion::Fixed,
        };
        let mut composite = Self {
            links: vec![world],
            bodies: Vec::new(),
            movable: Vec::new(),
            adjacent_links: Vec::new(),
            excluded_links: Vec::new(),
        };
        for (model, tree) in document.models.iter().zip(trees) {
            composite.add_model(model, tree, place)?;
        }
        for obstacle in &document.obstacles {
            composite.add_obstacle(obstacle, place)?;
        }
        composite.adjacent_links.sort_unstable();
        composite.adjacent_links.dedup();
        // `#` and `:` in names of a URDF could make two bodies or links look alike.
        let links = composite.links.iter().map(|link| &link.name);
        let mut seen = BTreeSet::new();
        if let Some(name) = links.into_iter().find(|&name| !seen.insert(name)) {
            return Err(SceneError::DuplicateName { at: place("model".to_owned()), value: name.clone() });
        }
        let mut seen = BTreeSet::new();
        if let Some(body) = composite.bodies.iter().find(|body| !seen.insert(&body.name)) {
            return Err(SceneError::DuplicateName {
                at: place("model".to_owned()),
                value: body.name.clone(),
            });
        }
        composite.excluded_links = composite.excluded_links(&document.collision.exclude, place)?;
        Ok(composite)
    }

    /// Pairs of links, lower index first and sorted, from pairs of names.
    fn excluded_links(
        &self,
        exclude: &[[String; 2]],
        place: &dyn Fn(String) -> Place,
    ) -> Result<Vec<(usize, usize)>, SceneError> {
        let mut pairs = BTreeSet::new();
        for (pair_idx, pair) in exclude.iter().enumerate() {
            let at = || place(format!("collision.exclude[{pair_idx}]"));
            let find = |name: &String| {
                let with_bodies = || self.links.iter().skip(1).map(|link| &link.name);
                self.links.iter().skip(1).position(|link| &link.name == name).map(|idx| idx + 1).ok_or_else(
                    || SceneError::UnknownLink {
                        at: at(),
                        value: name.clone(),
                        known: listed(with_bodies()),
                    },
                )
            };
            let (link_a, link_b) = (find(&pair[0])?, find(&pair[1])?);
            if link_a == link_b {
                return Err(SceneError::ExcludedWithItself { at: at(), value: pair[0].clone() });
            }
            pairs.insert((link_a.min(link_b), link_a.max(link_b)));
        }
        Ok(pairs.into_iter().collect())
    }

    fn add_model(
        &mut self,
        model: &ModelTable,
        tree: UrdfTree,
        place: &dyn Fn(String) -> Place,
    ) -> Result<(), SceneError> {
        let role = match model.role {
            RoleName::Robot => Role::Robot,
            RoleName::Object => Role::Object,
            RoleName::Obstacle => Role::Obstacle,
        };
        let X_WR = pose(|part| place(format!("model.{}.{part}", model.name)), model.xyz, model.rpy)?;
        // Position in `self.links` of each link of the file; its parent comes before it.
        let mut link_of: Vec<usize> = Vec::with_capacity(tree.links.len());
        for urdf_link in tree.links {
            let name = format!("{}/{}", model.name, urdf_link.name);
            let link_idx = match urdf_link.joint {
                None => self.add_link(Link {
                    name: name.clone(),
                    role,
                    parent: Some(0),
                    X_PF: X_WR,
                    motion: Motion::Fixed,
                }),
                Some(joint) => {
                    let parent = link_of[joint.parent];
                    let link_idx = self.add_jointed_link(&model.name, &name, role, parent, joint);
                    self.adjacent_links.push((parent, link_idx));
                    link_idx
                }
            };
            link_of.push(link_idx);
            for (shape_idx, (X_LS, shape)) in urdf_link.shapes.into_iter().enumerate() {
                let name = if shape_idx == 0 { name.clone() } else { format!("{name}#{}", shape_idx + 1) };
                self.bodies.push(Body { name, link_idx, X_LS, shape });
            }
        }
        Ok(())
    }

    fn add_link(&mut self, link: Link) -> usize {
        self.links.push(link);
        self.links.len() - 1
    }

    /// Adds the link that `joint` holds, with the links between the parts of a planar joint before it.
    fn add_jointed_link(
        &mut self,
        model: &str,
        name: &str,
        role: Role,
        parent: usize,
        joint: UrdfJoint,
    ) -> usize {
        let X_PF = joint.X_PF;
        let (kind, axis, limits, joint_kind) = match joint.kind {
            UrdfJointKind::Fixed => {
                let motion = Motion::Fixed;
                return self.add_link(Link {
                    name: name.to_owned(),
                    role,
                    parent: Some(parent),
                    X_PF,
                    motion,
                });
            }
            UrdfJointKind::Revolute { axis, limits } => (CoordinateKind::Revolute, axis, limits, "revolute"),
            UrdfJointKind::Continuous { axis } => (CoordinateKind::Revolute, axis, None, "continuous"),
            UrdfJointKind::Prismatic { axis, limits } => {
                (CoordinateKind::Prismatic, axis, limits, "prismatic")
            }
            UrdfJointKind::Planar { normal } => {
                return self.add_planar(model, name, role, parent, &joint.name, X_PF, normal);
            }
        };
        let coordinate_idx = self.movable.len();
        let (model, joint_name) = (model.to_owned(), joint.name);
        self.movable.push(MovableJoint { model, name: joint_name, joint_kind, kind, role, limits });
        let motion = match kind {
            CoordinateKind::Revolute => Motion::Revolute { axis, coordinate_idx },
            CoordinateKind::Prismatic => Motion::Prismatic { axis, coordinate_idx },
        };
        self.add_link(Link { name: name.to_owned(), role, parent: Some(parent), X_PF, motion })
    }

    /// A planar joint as prismatic x, prismatic y, revolute theta (thesis 2, appendix F): x and y span the
    /// plane, theta turns about its normal. x and y are those of the joint's frame turned by the smallest
    /// rotation that brings its z to the normal; for a normal with negative z, of the frame turned by π about
    /// its x before. The parts are called `joint_x`, `joint_y`, `joint_theta`.
    #[allow(clippy::too_many_arguments)] // The parts of one joint, used in this one place.
    fn add_planar(
        &mut self,
        model: &str,
        name: &str,
        role: Role,
        parent: usize,
        joint: &str,
        X_PF: RigidTransform,
        normal: Unit<Vector3<f64>>,
    ) -> usize {
        let (near, flip) = if normal.z < 0.0 {
            (-Vector3::z_axis(), UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
        } else {
            (Vector3::z_axis(), UnitQuaternion::identity())
        };
        // `near` and `normal` enclose at most a right angle, so there is a smallest rotation between them.
        let R_FN = UnitQuaternion::rotation_between_axis(&near, &normal).unwrap_or_default() * flip;
        let x_axis = R_FN * Vector3::x_axis();
        let y_axis = Unit::new_normalize(normal.cross(&x_axis));
        let parts = [
            ("x", CoordinateKind::Prismatic, x_axis),
            ("y", CoordinateKind::Prismatic, y_axis),
            ("theta", CoordinateKind::Revolute, normal),
        ];
        let (mut parent, mut X_PF) = (parent, X_PF);
        for (part, kind, axis) in parts {
            let coordinate_idx = self.movable.len();
            self.movable.push(MovableJoint {
                model: model.to_owned(),
                name: format!("{joint}_{part}"),
                joint_kind: "planar",
                kind,
                role,
                limits: None,
            });
            let (link_name, motion) = match kind {
                CoordinateKind::Revolute => (name.to_owned(), Motion::Revolute { axis, coordinate_idx }),
                CoordinateKind::Prismatic => {
                    (format!("{model}/{joint}:{part}"), Motion::Prismatic { axis, coordinate_idx })
                }
            };
            parent = self.add_link(Link { name: link_name, role, parent: Some(parent), X_PF, motion });
            X_PF = RigidTransform::from_parts(Translation3::identity(), UnitQuaternion::identity());
        }
        parent
    }

    fn add_obstacle(
        &mut self,
        obstacle: &ObstacleTable,
        place: &dyn Fn(String) -> Place,
    ) -> Result<(), SceneError> {
        let at = |part: &str| place(format!("obstacle.{}{part}", obstacle.name));
        let ObstacleTable { cuboid: box_table, cylinder, sphere, capsule, .. } = obstacle;
        let shape = match (box_table, cylinder, sphere, capsule) {
            (Some(table), None, None, None) => cuboid(|part| at(&format!(".box.{part}")), table.size)?,
            (None, Some(table), None, None) => Shape::Cylinder {
                radius: positive(at(".cylinder.radius"), table.radius)?,
                half_length: positive(at(".cylinder.length"), table.length)? / 2.0,
            },
            (None, None, Some(table), None) => {
                Shape::Sphere { radius: positive(at(".sphere.radius"), table.radius)? }
            }
            (None, None, None, Some(table)) => Shape::Capsule {
                radius: positive(at(".capsule.radius"), table.radius)?,
                half_length: positive(at(".capsule.length"), table.length)? / 2.0,
            },
            _ => {
                let given = [box_table.is_some(), cylinder.is_some(), sphere.is_some(), capsule.is_some()];
                let found = given.into_iter().filter(|&given| given).count();
                return Err(SceneError::ShapeCount { at: at(""), found });
            }
        };
        let X_PF = pose(|part| at(&format!(".{part}")), obstacle.xyz, obstacle.rpy)?;
        let name = obstacle.name.clone();
        let link_idx = self.add_link(Link {
            name: name.clone(),
            role: Role::Obstacle,
            parent: Some(0),
            X_PF,
            motion: Motion::Fixed,
        });
        self.bodies.push(Body { name, link_idx, X_LS: RigidTransform::identity(), shape });
        Ok(())
    }
}
