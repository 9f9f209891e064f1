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

    /// For each joint between the groups of two points, its coordinate and how fast n·(x_a - x_b) grows with it, for
    /// x_a rigid on group `a` and x_b on group `b`, n fixed in the world. A coordinate may come more than once.
    pub fn slopes(
        &self,
        groups: &[Placement],
        (mut a, x_a): (usize, &Vector3<f64>),
        (mut b, x_b): (usize, &Vector3<f64>),
        n: &Vector3<f64>,
    ) -> Vec<(usize, f64)> {
        let slope = |group: usize, x: &Vector3<f64>| {
            let Placement { R, p } = &groups[group];
            match &self.groups[group - 1].motion {
                // The joint's axis is fixed by its own motion: the group's frame serves as well as F.
                GroupMotion::Revolute { K, .. } => {
                    let axis = Vector3::new(K[(2, 1)], K[(0, 2)], K[(1, 0)]);
                    n.dot(&(R * axis).cross(&(x - p)))
                }
                GroupMotion::Prismatic { axis } => n.dot(&(R * axis)),
            }
        };
        let mut slopes = Vec::new();
        // A parent stands before its children, so the greater of two different groups is no ancestor of the other.
        while a != b {
            let group = a.max(b);
            let Group { parent, coordinate_idx, .. } = self.groups[group - 1];
            if a > b {
                slopes.push((coordinate_idx, slope(group, x_a)));
                a = parent;
            } else {
                slopes.push((coordinate_idx, -slope(group, x_b)));
                b = parent;
            }
        }
        slopes
    }
}
