//! A body seen from a frame: the product of fixed transforms and joint motions between the two, ready for control
//! nets.
//!
//! Seen from the frame of link F, a point x of the body in its shape frame S is at T_1 T_2 … T_k x. Each joint's
//! frame is turned so that its axis is z; a motion is then a rotation about z or a translation along z.
//! Source: mathematics.md 2.1.

use crate::support::Core;
use kinematics::{Chain, Reach};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use scene::{Coordinate, CoordinateKind, Shape};

/// A fixed transform, then the motion of one joint.
#[derive(Debug, Clone)]
pub struct Step {
    /// Rotation of the fixed transform.
    pub R: Matrix3<f64>,
    /// Translation of the fixed transform, metres.
    pub p: Vector3<f64>,
    /// Rotation about z, or translation along z.
    pub kind: CoordinateKind,
    /// +1 from parent to child, -1 from child to parent: the motion is by `sign * q[coordinate]`.
    pub sign: f64,
    /// Position of the coordinate in q.
    pub coordinate: usize,
    /// How far the body moves at most when the joint moves by one unit: metres a radian, or 1.
    pub lever: f64,
}

/// A body seen from a frame.
#[derive(Debug, Clone)]
pub struct Side {
    /// From the frame outwards to the body; joints that drop out are left out.
    pub steps: Vec<Step>,
    /// Rotation from the last joint to the shape's frame.
    pub R_tail: Matrix3<f64>,
    /// Translation from the last joint to the shape's frame.
    pub p_tail: Vector3<f64>,
    /// The body without its radius.
    pub core: Core,
}

impl Side {
    /// The body of `shape` at the end of `chain`.
    pub fn new(chain: &Chain, shape: &Shape, coordinates: &[Coordinate]) -> Self {
        let reach = Reach::new(chain, shape, coordinates);
        let (mut R, mut p) = (Matrix3::identity(), Vector3::zeros());
        let mut steps = Vec::with_capacity(chain.joints.len());
        for (k, X) in chain.transforms.iter().enumerate() {
            p += R * X.translation.vector;
            R *= X.rotation.to_rotation_matrix().into_inner();
            let Some(joint) = chain.joints.get(k) else { break };
            // axis = Q z, so that R_axis(θ) = Q R_z(θ) Qᵀ and axis · t = Q (t z).
            let Q = aligned_with(&joint.axis);
            steps.push(Step {
                R: R * Q,
                p,
                kind: joint.kind,
                sign: joint.sign,
                coordinate: joint.coordinate_idx,
                lever: reach.reach(k),
            });
            (R, p) = (Q.transpose(), Vector3::zeros());
        }
        Self { steps, R_tail: R, p_tail: p, core: Core::new(shape) }
    }

    /// Pose (rotation, translation) of the shape in the frame at `q`.
    pub fn pose(&self, q: &[f64]) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut R, mut p) = (Matrix3::identity(), Vector3::zeros());
        for step in &self.steps {
            p += R * step.p;
            R *= step.R;
            step.advance(q, &mut R, &mut p);
        }
        (R * self.R_tail, p + R * self.p_tail)
    }

    /// Adds `factor` · ∂(n·x)/∂q_j at `q` to `g` for each joint, for the point `x` of the body given in the frame.
    pub fn add_gradient(&self, q: &[f64], n: &Vector3<f64>, x: &Vector3<f64>, factor: f64, g: &mut [f64]) {
        let (mut R, mut p) = (Matrix3::identity(), Vector3::zeros());
        for step in &self.steps {
            p += R * step.p;
            R *= step.R;
            let axis: Vector3<f64> = R.column(2).into_owned();
            g[step.coordinate] += factor
                * step.sign
                * match step.kind {
                    CoordinateKind::Revolute => n.dot(&axis.cross(&(x - p))),
                    CoordinateKind::Prismatic => n.dot(&axis),
                };
            step.advance(q, &mut R, &mut p);
        }
    }

    /// Number of rotations among the joints; the control net has 3 to this power rows.
    pub fn n_turns(&self) -> usize {
        self.steps.iter().filter(|step| step.kind == CoordinateKind::Revolute).count()
    }
}

impl Step {
    /// Multiplies the pose by the joint's motion.
    fn advance(&self, q: &[f64], R: &mut Matrix3<f64>, p: &mut Vector3<f64>) {
        let value = self.sign * q[self.coordinate];
        match self.kind {
            CoordinateKind::Revolute => {
                *R *= Rotation3::from_axis_angle(&Vector3::z_axis(), value).into_inner();
            }
            CoordinateKind::Prismatic => *p += *R * Vector3::new(0.0, 0.0, value),
        }
    }
}

/// A rotation Q with Q z = axis.
fn aligned_with(axis: &Unit<Vector3<f64>>) -> Matrix3<f64> {
    let z = axis.into_inner();
    if z == Vector3::z() {
        return Matrix3::identity();
    }
    let helper = if z.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let x = helper.cross(&z).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z])
}
