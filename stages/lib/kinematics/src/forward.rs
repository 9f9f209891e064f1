//! Forward kinematics: X_WL(q) = X_WP(q) · X_PF · X_FL(q) for every link L with parent P, root first.

use crate::RigidTransform;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use scene::{Body, Link, Motion, Scene};

/// The moving part of a scene: its links and bodies.
#[derive(Debug, Clone)]
pub struct Kinematics {
    links: Vec<Link>,
    bodies: Vec<Body>,
    dim: usize,
}

impl Kinematics {
    /// Copies what is needed of `scene`, whose links stand after their parents.
    pub fn new(scene: &Scene) -> Self {
        Self { links: scene.links.clone(), bodies: scene.bodies.clone(), dim: scene.dim() }
    }

    /// Dimension of C-space.
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of links.
    pub fn n_links(&self) -> usize {
        self.links.len()
    }

    /// X_WL of every link at `q` (`dim` entries) into `out`, which keeps its allocation between calls.
    pub fn link_poses(&self, q: &[f64], out: &mut Vec<RigidTransform>) {
        debug_assert_eq!(q.len(), self.dim);
        out.clear();
        for link in &self.links {
            let X_PL = link.X_PF * X_FL(&link.motion, q);
            out.push(match link.parent {
                Some(parent) => out[parent] * X_PL,
                None => X_PL,
            });
        }
    }

    /// X_WS of the shape of body `body_idx`, from the poses of [`Kinematics::link_poses`].
    pub fn body_pose(&self, link_poses: &[RigidTransform], body_idx: usize) -> RigidTransform {
        let body = &self.bodies[body_idx];
        link_poses[body.link_idx] * body.X_LS
    }

    /// Gradient of n·x over q for the point x = `p_W` rigid on link `link_idx`, `n_W` fixed in the world: the row
    /// nᵀJ of the geometric Jacobian. `out` has `dim` entries and is overwritten.
    pub fn gradient(
        &self,
        link_poses: &[RigidTransform],
        link_idx: usize,
        p_W: &Vector3<f64>,
        n_W: &Vector3<f64>,
        out: &mut [f64],
    ) {
        out.fill(0.0);
        let mut at = Some(link_idx);
        while let Some(link_idx) = at {
            let link = &self.links[link_idx];
            // The joint's axis is fixed by its own motion: the link's frame serves as well as F.
            let X_WL = &link_poses[link_idx];
            match &link.motion {
                Motion::Fixed => {}
                Motion::Revolute { axis, coordinate_idx } => {
                    let lever = p_W - X_WL.translation.vector;
                    out[*coordinate_idx] = n_W.dot(&(X_WL.rotation * axis.into_inner()).cross(&lever));
                }
                Motion::Prismatic { axis, coordinate_idx } => {
                    out[*coordinate_idx] = n_W.dot(&(X_WL.rotation * axis.into_inner()));
                }
            }
            at = link.parent;
        }
    }
}

/// Pose of a link in its joint's frame.
fn X_FL(motion: &Motion, q: &[f64]) -> RigidTransform {
    match motion {
        Motion::Fixed => RigidTransform::identity(),
        Motion::Revolute { axis, coordinate_idx } => RigidTransform::from_parts(
            Translation3::identity(),
            UnitQuaternion::from_axis_angle(axis, q[*coordinate_idx]),
        ),
        Motion::Prismatic { axis, coordinate_idx } => RigidTransform::from_parts(
            Translation3::from(axis.into_inner() * q[*coordinate_idx]),
            UnitQuaternion::identity(),
        ),
    }
}
