//! How fast a body can accelerate along a curve, seen from a frame.
//!
//! For a point x of a body behind joints 1 … k (outermost first) and a curve q(t),
//!
//! ```text
//! x'' = Σ_j q_j'' ∂_j x + Σ_j q_j'² ∂_jj x + 2 Σ_{i<j} q_i' q_j' ∂_ij x
//! ‖x''‖ ≤ M2 = Σ_j a_j R_j + Σ_{j revolute} v_j² R_j + 2 Σ_{i<j, i revolute} v_i v_j R_j
//! ```
//!
//! with |q_j'| ≤ v_j, |q_j''| ≤ a_j, and R_j the body's largest distance from the axis of joint j (1 for a prismatic
//! one): ∂_j x = z_j × (x − o_j) has that length, and an outer rotation only turns it (mathematics 2.1, Paths).

use kinematics::{Chain, Reach};
use scene::{Coordinate, CoordinateKind, Shape};

/// The joints between a frame and a body, with the body's reach from each.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionBound {
    joints: Vec<JointBound>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct JointBound {
    coordinate_idx: usize,
    turns: bool,
    /// R_j, metres; 1 for a prismatic joint.
    reach: f64,
}

impl MotionBound {
    /// For the core of `shape` at the end of `chain`, within the limits of `coordinates`.
    pub fn new(chain: &Chain, shape: &Shape, coordinates: &[Coordinate]) -> Self {
        let reach = Reach::new(chain, shape, coordinates);
        let joints = chain.joints.iter().enumerate().map(|(joint_idx, joint)| JointBound {
            coordinate_idx: joint.coordinate_idx,
            turns: joint.kind == CoordinateKind::Revolute,
            reach: reach.reach(joint_idx),
        });
        Self { joints: joints.collect() }
    }

    /// M2 for bounds `speed` and `acceleration` of all coordinates.
    #[inline]
    pub fn second_order(&self, speed: &[f64], acceleration: &[f64]) -> f64 {
        let (mut turning, mut bound) = (0.0, 0.0);
        for joint in &self.joints {
            let v = speed[joint.coordinate_idx];
            let mut factor = acceleration[joint.coordinate_idx] + 2.0 * turning * v;
            if joint.turns {
                factor += v * v;
                turning += v;
            }
            bound += factor * joint.reach;
        }
        bound
    }

    /// Whether one of `coordinates` (a flag each) is among the joints.
    pub fn involves(&self, coordinates: &[bool]) -> bool {
        self.joints.iter().any(|joint| coordinates[joint.coordinate_idx])
    }
}
