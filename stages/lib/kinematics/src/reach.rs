//! How far a body can be from the axes of the joints that move it, and what follows for its motion.
//!
//! Along a straight edge q(t) = q_0 + t d every point x of a body, seen from the chain's first frame, has
//! ‖x''‖ ≤ M2 = Σ_j d_j² R_j + 2 Σ_{i<j} |d_i d_j| R_j over revolute joints i, j, with R_j the largest distance of the
//! body from axis j; a prismatic joint j adds 2 Σ_{i<j} |d_i d_j| and nothing as i (mathematics 2.1, Paths).
//! First order: ‖x'‖ ≤ M1 = Σ_j |d_j| R_j, with 1 for a prismatic R_j.

use crate::{Chain, Support};
use nalgebra::{Unit, Vector3};
use scene::{Coordinate, CoordinateKind, Shape};

/// Bounds for the core of one body, seen from the first frame of a chain that ends at its shape; valid for all q within
/// the joint limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    joints: Vec<JointReach>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct JointReach {
    coordinate_idx: usize,
    kind: CoordinateKind,
    /// R_j, metres; 1 for a prismatic joint, which moves every point by its own amount.
    reach: f64,
}

impl Reach {
    /// Reach of the core of `shape` along `chain`, within the limits of `coordinates`.
    pub fn new(chain: &Chain, shape: &Shape, coordinates: &[Coordinate]) -> Self {
        let n_joints = chain.joints.len();
        // A ball that holds the core wherever the joints passed so far have put it, in the frame of the next joint.
        let (mut center, mut radius) = (Vector3::zeros(), shape.core_extent());
        let mut joints = Vec::with_capacity(n_joints);
        for joint_idx in (0..n_joints).rev() {
            let joint = &chain.joints[joint_idx];
            let X = &chain.transforms[joint_idx + 1];
            center = X.rotation * center + X.translation.vector;
            let reach = match joint.kind {
                CoordinateKind::Revolute => {
                    let foot = joint.axis.into_inner() * joint.axis.dot(&center);
                    let mut reach = (center - foot).norm() + radius;
                    if joint_idx + 1 == n_joints {
                        reach = reach.min(distance_from_axis(shape, X, &joint.axis));
                    }
                    // Whatever the angle, the core stays in a ball about a point of the axis.
                    radius += (center - foot).norm();
                    center = foot;
                    reach
                }
                CoordinateKind::Prismatic => {
                    let coordinate = &coordinates[joint.coordinate_idx];
                    let middle = joint.sign * 0.5 * (coordinate.lower + coordinate.upper);
                    center += joint.axis.into_inner() * middle;
                    radius += 0.5 * (coordinate.upper - coordinate.lower);
                    1.0
                }
            };
            joints.push(JointReach {
                coordinate_idx: joint.coordinate_idx,
                kind: joint.kind,
                reach: reach * (1.0 + 1e-12),
            });
        }
        joints.reverse();
        Self { joints }
    }

    /// R_j of the chain's joint `joint_idx`, metres; 1 for a prismatic joint.
    pub fn reach(&self, joint_idx: usize) -> f64 {
        self.joints[joint_idx].reach
    }

    /// M1 for the direction `d` (all coordinates): bound of ‖x'‖.
    pub fn speed_bound(&self, d: &[f64]) -> f64 {
        self.joints.iter().map(|joint| d[joint.coordinate_idx].abs() * joint.reach).sum()
    }

    /// M2 for the direction `d` (all coordinates): bound of ‖x''‖.
    pub fn acceleration_bound(&self, d: &[f64]) -> f64 {
        let mut turning = 0.0;
        let mut bound = 0.0;
        for joint in &self.joints {
            let d_j = d[joint.coordinate_idx].abs();
            bound += 2.0 * turning * d_j * joint.reach;
            if joint.kind == CoordinateKind::Revolute {
                bound += d_j * d_j * joint.reach;
                turning += d_j;
            }
        }
        bound
    }
}

/// Upper bound of the distance of the core of `shape`, at pose `X` in the joint's frame, from the axis.
fn distance_from_axis(shape: &Shape, X: &crate::RigidTransform, axis: &Unit<Vector3<f64>>) -> f64 {
    let distance = |x: Vector3<f64>| (X.rotation * x + X.translation.vector).cross(axis).norm();
    // The distance is convex, so its maximum over a core is over vertices; a disc is held by a square.
    let half = match shape {
        Shape::Box { half_extents } => *half_extents,
        Shape::Cylinder { radius, half_length } => Vector3::new(*radius, *radius, *half_length),
        Shape::Sphere { .. } => Vector3::zeros(),
        Shape::Capsule { half_length, .. } => Vector3::new(0.0, 0.0, *half_length),
    };
    let mut largest: f64 = 0.0;
    for corner in 0..8 {
        let sign = |bit: usize| if corner >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let x = Vector3::new(half.x * sign(0), half.y * sign(1), half.z * sign(2));
        largest = largest.max(distance(x));
    }
    largest
}
