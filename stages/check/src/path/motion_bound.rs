//! Upper bound of the second derivative of a body's points along a curve, seen from a frame.
//!
//! With |q_j'| ≤ v_j and |q_j''| ≤ a_j for the motions from the frame outwards,
//! ‖x''‖ ≤ Σ_j a_j R_j + Σ_{j turns} v_j² R_j + 2 Σ_{i<j, i turns} v_i v_j R_j, where R_j is the largest distance of the core
//! from the axis of motion j, 1 for a slide.

use crate::body;
use crate::chain::{Step, cross};
use crate::interval::{self, Interval, Mat3, Vec3};
use scene::{Scene, Shape};

/// The motions from the frame outwards, each with an upper bound of R_j.
pub struct MotionBound {
    motions: Vec<(usize, bool, f64)>,
}

impl MotionBound {
    /// For the core of `shape` at the end of `steps`, all coordinates inside the joint limits; `None` for a coordinate
    /// that does not exist.
    ///
    /// A ball holds the core wherever the motions passed so far, from the body inwards, have put it. A turn carries
    /// the ball around its axis: from then on its centre is the foot on the axis, and the radius grows by the distance.
    pub fn new(scene: &Scene, steps: &[Step], shape: &Shape) -> Option<Self> {
        let mut motions = Vec::new();
        let mut center: Vec3 = [Interval::ZERO; 3];
        let mut radius = Interval::point(body::core_extent(shape));
        // The core itself, by points whose hull holds it, until a motion has been passed.
        let mut corners = Some(corners(shape));
        for step in steps.iter().rev() {
            match step {
                Step::Fixed { R, p } => {
                    center = placed(R, p, &center);
                    corners = corners.map(|points| points.iter().map(|x| placed(R, p, x)).collect());
                }
                Step::Turn { axis, coordinate, .. } => {
                    let along = interval::dot(axis, &center);
                    let foot: Vec3 = std::array::from_fn(|i| along * axis[i]);
                    let distance = interval::norm(&std::array::from_fn(|i| center[i] - foot[i]));
                    let mut reach = (distance + radius).hi();
                    if let Some(points) = corners.take() {
                        let furthest = points.iter().map(|x| interval::norm(&cross(x, axis)).hi());
                        reach = reach.min(furthest.fold(0.0, f64::max));
                    }
                    radius = radius + distance;
                    center = foot;
                    motions.push((*coordinate, true, reach));
                }
                Step::Slide { axis, sign, coordinate } => {
                    corners = None;
                    let limits = scene.coordinates.get(*coordinate)?;
                    let middle = 0.5 * limits.lower + 0.5 * limits.upper;
                    let [low, high] = [limits.lower, limits.upper]
                        .map(|end| (Interval::point(end) - Interval::point(middle)).magnitude());
                    let shift = Interval::point(*sign) * Interval::point(middle);
                    center = std::array::from_fn(|i| center[i] + shift * axis[i]);
                    radius = radius + Interval::point(low.max(high));
                    motions.push((*coordinate, false, 1.0));
                }
            }
        }
        motions.reverse();
        Some(Self { motions })
    }

    /// The bound, for upper bounds of |q_j'| and |q_j''| of all coordinates.
    pub fn second_order(&self, speed: &[f64], acceleration: &[f64]) -> Interval {
        let (mut turning, mut sum) = (Interval::ZERO, Interval::ZERO);
        for &(coordinate, turns, reach) in &self.motions {
            let v = Interval::point(speed[coordinate]);
            let mut factor = Interval::point(acceleration[coordinate]) + Interval::point(2.0) * turning * v;
            if turns {
                factor = factor + v.square();
                turning = turning + v;
            }
            sum = sum + factor * Interval::point(reach);
        }
        sum
    }
}

/// R x + p.
fn placed(R: &Mat3, p: &Vec3, x: &Vec3) -> Vec3 {
    let turned = interval::times_vec(R, x);
    std::array::from_fn(|i| turned[i] + p[i])
}

/// Points whose hull holds the core; a disc is held by a square.
fn corners(shape: &Shape) -> Vec<Vec3> {
    let (x, y, z) = match shape {
        Shape::Box { half_extents } => (half_extents.x, half_extents.y, half_extents.z),
        Shape::Cylinder { radius, half_length } => (*radius, *radius, *half_length),
        Shape::Sphere { .. } => (0.0, 0.0, 0.0),
        Shape::Capsule { half_length, .. } => (0.0, 0.0, *half_length),
    };
    let sign = |corner: u32, bit: u32| if corner >> bit & 1 == 0 { 1.0 } else { -1.0 };
    (0..8).map(|k| interval::point3(sign(k, 0) * x, sign(k, 1) * y, sign(k, 2) * z)).collect()
}
