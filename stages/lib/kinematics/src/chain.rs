//! X_AB(q) between two frames of the tree as a product of fixed transforms and joint motions.
//!
//! X_AB(q) = X_0 · J_1(q) · X_1 · J_2(q) · … · J_k(q) · X_k, with J_j the rotation by `sign · q` about the joint's
//! axis, or the translation by `sign · q · axis`; the sign is -1 where the way goes from child to parent.

use crate::RigidTransform;
use nalgebra::{Translation3, Unit, UnitQuaternion, Vector3};
use scene::{CoordinateKind, Motion, Scene};

/// A joint that moves, as a factor of a [`Chain`].
#[derive(Debug, Clone, PartialEq)]
pub struct ChainJoint {
    /// Its coordinate.
    pub coordinate_idx: usize,
    /// Angle or length.
    pub kind: CoordinateKind,
    /// Unit axis in the frames on both sides of the joint (its own motion leaves it fixed).
    pub axis: Unit<Vector3<f64>>,
    /// +1 from parent to child, -1 from child to parent.
    pub sign: f64,
    /// The link whose joint it is (the child).
    pub link_idx: usize,
}

impl ChainJoint {
    /// J(q) for the value `value` of its coordinate.
    pub fn pose(&self, value: f64) -> RigidTransform {
        let signed = self.sign * value;
        match self.kind {
            CoordinateKind::Revolute => RigidTransform::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(&self.axis, signed),
            ),
            CoordinateKind::Prismatic => RigidTransform::from_parts(
                Translation3::from(self.axis.into_inner() * signed),
                UnitQuaternion::identity(),
            ),
        }
    }
}

/// The way from frame A to frame B; see the module's head.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// X_0 … X_k: `joints.len() + 1` fixed transforms.
    pub transforms: Vec<RigidTransform>,
    /// The joints that move, from A to B.
    pub joints: Vec<ChainJoint>,
    /// `joints.len() + 1` links: entry i is the link nearest to the world among those between joint i and joint
    /// i + 1 (counted from 1), all of which are rigid against each other.
    pub frame_links: Vec<usize>,
}

impl Chain {
    /// From the frame of `link_a` to the frame of `link_b`: up to the lowest common ancestor, then down.
    pub fn between_links(scene: &Scene, link_a: usize, link_b: usize) -> Self {
        let (mut up, mut down) = (vec![link_a], vec![link_b]);
        let (mut at_a, mut at_b) = (link_a, link_b);
        // A parent's index is less than its child's, so the greater of two different links is never the common
        // ancestor; the world, link 0, ends both ways.
        while at_a != at_b {
            if at_a > at_b {
                at_a = scene.links[at_a].parent.unwrap_or(0);
                up.push(at_a);
            } else {
                at_b = scene.links[at_b].parent.unwrap_or(0);
                down.push(at_b);
            }
        }
        let mut chain = Self {
            transforms: vec![RigidTransform::identity()],
            joints: Vec::new(),
            frame_links: vec![link_a],
        };
        for step in up.windows(2) {
            chain.push_motion(scene, step[0], -1.0);
            chain.push_fixed(&scene.links[step[0]].X_PF.inverse(), step[1]);
        }
        for &link_idx in down.iter().rev().skip(1) {
            chain.push_fixed(&scene.links[link_idx].X_PF, scene.links[link_idx].parent.unwrap_or(0));
            chain.push_motion(scene, link_idx, 1.0);
        }
        chain
    }

    /// From the frame of link `link_idx` to the frame S of a body's shape.
    pub fn to_body(scene: &Scene, link_idx: usize, body_idx: usize) -> Self {
        let body = &scene.bodies[body_idx];
        let mut chain = Self::between_links(scene, link_idx, body.link_idx);
        chain.append(&body.X_LS);
        chain
    }

    /// From the frame S of body `body_a`'s shape to that of `body_b`'s.
    pub fn between_bodies(scene: &Scene, body_a: usize, body_b: usize) -> Self {
        let mut chain = Self::to_body(scene, scene.bodies[body_a].link_idx, body_b);
        chain.transforms[0] = scene.bodies[body_a].X_LS.inverse() * chain.transforms[0];
        chain
    }

    /// X_AB at `q`, all coordinates of the scene.
    pub fn pose(&self, q: &[f64]) -> RigidTransform {
        let mut X = self.transforms[0];
        for (joint, X_next) in self.joints.iter().zip(&self.transforms[1..]) {
            X = X * joint.pose(q[joint.coordinate_idx]) * X_next;
        }
        X
    }

    /// Gradient of n·x over the chain's joints (one entry each, in their order), for the point x with coordinates
    /// `p_B` in the last frame and `n_A` fixed in the first.
    pub fn gradient(&self, q: &[f64], p_B: &Vector3<f64>, n_A: &Vector3<f64>) -> Vec<f64> {
        let x = self.pose(q) * nalgebra::Point3::from(*p_B);
        let mut X = self.transforms[0];
        let mut gradient = Vec::with_capacity(self.joints.len());
        for (joint, X_next) in self.joints.iter().zip(&self.transforms[1..]) {
            let axis_A = X.rotation * joint.axis.into_inner() * joint.sign;
            gradient.push(match joint.kind {
                CoordinateKind::Revolute => n_A.dot(&axis_A.cross(&(x.coords - X.translation.vector))),
                CoordinateKind::Prismatic => n_A.dot(&axis_A),
            });
            X = X * joint.pose(q[joint.coordinate_idx]) * X_next;
        }
        gradient
    }

    /// The same way from B to A.
    pub fn reversed(&self) -> Self {
        let reverse = |joint: &ChainJoint| ChainJoint { sign: -joint.sign, ..joint.clone() };
        Self {
            transforms: self.transforms.iter().rev().map(RigidTransform::inverse).collect(),
            joints: self.joints.iter().rev().map(reverse).collect(),
            frame_links: self.frame_links.iter().rev().copied().collect(),
        }
    }

    /// Replaces the last joint by its identity; nothing happens if there is none.
    pub(crate) fn drop_last(&mut self) {
        if self.joints.pop().is_some()
            && let (Some(X_last), Some(link)) = (self.transforms.pop(), self.frame_links.pop())
        {
            self.append(&X_last);
            if let Some(frame_link) = self.frame_links.last_mut() {
                *frame_link = link.min(*frame_link);
            }
        }
    }

    /// Multiplies the last fixed transform by `X`.
    fn append(&mut self, X: &RigidTransform) {
        if let Some(last) = self.transforms.last_mut() {
            *last *= X;
        }
    }

    fn push_fixed(&mut self, X: &RigidTransform, link: usize) {
        self.append(X);
        if let Some(frame_link) = self.frame_links.last_mut() {
            *frame_link = link.min(*frame_link);
        }
    }

    fn push_motion(&mut self, scene: &Scene, link_idx: usize, sign: f64) {
        let (kind, axis, coordinate_idx) = match &scene.links[link_idx].motion {
            Motion::Fixed => return,
            Motion::Revolute { axis, coordinate_idx } => (CoordinateKind::Revolute, *axis, *coordinate_idx),
            Motion::Prismatic { axis, coordinate_idx } => (CoordinateKind::Prismatic, *axis, *coordinate_idx),
        };
        self.joints.push(ChainJoint { coordinate_idx, kind, axis, sign, link_idx });
        self.transforms.push(RigidTransform::identity());
        // Above a joint that is passed upwards only its parent follows; below one that is passed downwards the
        // child is the first of the new rigid group.
        let next = if sign < 0.0 { scene.links[link_idx].parent.unwrap_or(0) } else { link_idx };
        self.frame_links.push(next);
    }
}
