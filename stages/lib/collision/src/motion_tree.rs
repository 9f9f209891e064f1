//! The tree of rigid groups of links, cut down to what moves bodies of some pair.
//!
//! Links that no relevant coordinate moves against each other form one group; group 0 is the world. A coordinate
//! that no pair depends on is held at 0, so it costs nothing and no answer depends on it.

use crate::placement::Placement;
use nalgebra::{Matrix3, Vector3};
use scene::{CollisionPair, Motion, RigidTransform, Scene};

/// How a group moves against its parent.
#[derive(Debug, Clone)]
enum GroupMotion {
    /// Rotation I + sin θ K + (1 - cos θ) K², K the cross product matrix of the axis (Rodrigues).
    Revolute {
        K: Matrix3<f64>,
        K2: Matrix3<f64>,
    },
    Prismatic {
        axis: Vector3<f64>,
    },
}

#[derive(Debug, Clone)]
struct Group {
    parent: usize,
    X_PF: Placement,
    motion: GroupMotion,
    coordinate_idx: usize,
    /// Whether a body of some pair is moved by it.
    needed: bool,
}

/// See the module's head.
#[derive(Debug, Clone)]
pub struct MotionTree {
    /// Groups from 1 on (entry 0 is group 1); a parent stands before its children.
    groups: Vec<Group>,
    /// Group of each link.
    pub group_of_link: Vec<usize>,
    /// Pose of each link in its group.
    pub X_GL: Vec<RigidTransform>,
}

impl MotionTree {
    /// Tree of `scene` for `pairs`; `relevant` says which coordinates some pair depends on.
    pub fn new(scene: &Scene, pairs: &[CollisionPair], relevant: &[bool]) -> Self {
        let mut tree = Self { groups: Vec::new(), group_of_link: Vec::new(), X_GL: Vec::new() };
        for link in &scene.links {
            let (parent_group, X_GP) = match link.parent {
                Some(parent) => (tree.group_of_link[parent], tree.X_GL[parent]),
                None => (0, RigidTransform::identity()),
            };
            let X_GF = X_GP * link.X_PF;
            let moving = match &link.motion {
                Motion::Fixed => None,
                Motion::Revolute { axis, coordinate_idx } => {
                    let K = axis.cross_matrix();
                    Some((GroupMotion::Revolute { K, K2: K * K }, *coordinate_idx))
                }
                Motion::Prismatic { axis, coordinate_idx } => {
                    Some((GroupMotion::Prismatic { axis: axis.into_inner() }, *coordinate_idx))
                }
            };
            match moving {
                Some((motion, coordinate_idx)) if relevant[coordinate_idx] => {
                    let (parent, X_PF) = (parent_group, Placement::from(&X_GF));
                    tree.groups.push(Group { parent, X_PF, motion, coordinate_idx, needed: false });
                    tree.group_of_link.push(tree.groups.len());
                    tree.X_GL.push(RigidTransform::identity());
                }
                _ => {
                    tree.group_of_link.push(parent_group);
                    tree.X_GL.push(X_GF);
                }
            }
        }
        for body_idx in pairs.iter().flat_map(|pair| [pair.body_a, pair.body_b]) {
            let mut group = tree.group_of_link[scene.bodies[body_idx].link_idx];
            while group > 0 {
                tree.groups[group - 1].needed = true;
                group = tree.groups[group - 1].parent;
            }
        }
        tree
    }

    /// X_WG of every group at `q` into `out`; those that move no body of a pair keep the identity.
    pub fn group_placements(&self, q: &[f64], out: &mut Vec<Placement>) {
        out.clear();
        out.push(Placement::identity());
        for group in &self.groups {
            if !group.needed {
                out.push(Placement::identity());
                continue;
            }
            let X_WF = if group.parent == 0 { group.X_PF } else { out[group.parent].compose(&group.X_PF) };
            let value = q[group.coordinate_idx];
            out.push(match &group.motion {
                GroupMotion::Revolute { K, K2 } => {
                    let (sine, cosine) = value.sin_cos();
                    let R = Matrix3::identity() + K * sine + K2 * (1.0 - cosine);
                    Placement { R: X_WF.R * R, p: X_WF.p }
                }
                GroupMotion::Prismatic { axis } => {
                    Placement { R: X_WF.R, p: X_WF.p + X_WF.R * (axis * value) }
                }
            });
        }
    }
}
