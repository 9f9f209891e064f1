//! The motions between a frame and a body, enclosed by intervals.
//!
//! Seen from the frame of link F, a point x of body A in its shape frame S is at T_1 T_2 … T_k x, where each T is a
//! fixed transform or one joint's motion. Poses of the scene are believed to [`POSE_SLACK`]: the angles of a file
//! pass through sine, cosine and a quaternion before they are here.

use crate::body::{self, Symmetry};
use crate::interval::{self, Interval, Mat3, Vec3};
use scene::{Motion, RigidTransform, Scene};

/// Each entry of a rotation matrix and each coordinate of a position is taken to be known to this much.
pub const POSE_SLACK: f64 = 2e-15;

/// One factor of the product between frame and body.
#[derive(Debug, Clone)]
pub enum Step {
    /// x ↦ R x + p.
    Fixed {
        /// Rotation.
        R: Mat3,
        /// Translation.
        p: Vec3,
    },
    /// Rotation by `sign · q[coordinate]` about `axis`.
    Turn {
        /// Unit axis.
        axis: Vec3,
        /// +1 from parent to child, -1 from child to parent.
        sign: f64,
        /// Coordinate.
        coordinate: usize,
    },
    /// Translation by `sign · q[coordinate] · axis`.
    Slide {
        /// Unit axis.
        axis: Vec3,
        /// +1 from parent to child, -1 from child to parent.
        sign: f64,
        /// Coordinate.
        coordinate: usize,
    },
}

impl Step {
    /// Coordinate of a motion.
    pub fn coordinate(&self) -> Option<usize> {
        match self {
            Step::Fixed { .. } => None,
            Step::Turn { coordinate, .. } | Step::Slide { coordinate, .. } => Some(*coordinate),
        }
    }
}

/// A body seen from a frame.
#[derive(Debug, Clone)]
pub struct Side {
    /// From the frame outwards to the body; the last is the pose of the shape in its link.
    pub steps: Vec<Step>,
    /// Upper bound of what dropped rotations add to the radius of the body.
    pub inflation: f64,
}

fn slack(x: f64) -> Interval {
    Interval::point(x) + Interval::hull(-POSE_SLACK, POSE_SLACK)
}

/// Enclosure of a pose as matrix and vector.
fn enclose(X: &RigidTransform) -> (Mat3, Vec3) {
    let R = X.rotation.to_rotation_matrix();
    let p = X.translation.vector;
    (std::array::from_fn(|i| std::array::from_fn(|j| slack(R[(i, j)]))), std::array::from_fn(|i| slack(p[i])))
}

fn fixed(X: &RigidTransform) -> Step {
    let (R, p) = enclose(X);
    Step::Fixed { R, p }
}

fn fixed_inverse(X: &RigidTransform) -> Step {
    let (R, p) = enclose(X);
    let R = interval::transpose(&R);
    let p = interval::times_vec(&R, &p).map(|x| -x);
    Step::Fixed { R, p }
}

fn motion(motion: &Motion, sign: f64) -> Option<Step> {
    let enclose_axis =
        |axis: &nalgebra::Unit<nalgebra::Vector3<f64>>| std::array::from_fn(|i| slack(axis[i]));
    match motion {
        Motion::Fixed => None,
        Motion::Revolute { axis, coordinate_idx } => {
            Some(Step::Turn { axis: enclose_axis(axis), sign, coordinate: *coordinate_idx })
        }
        Motion::Prismatic { axis, coordinate_idx } => {
            Some(Step::Slide { axis: enclose_axis(axis), sign, coordinate: *coordinate_idx })
        }
    }
}

/// Links from `link` up to the world, itself first.
fn ancestry(scene: &Scene, link: usize) -> Option<Vec<usize>> {
    let mut chain = vec![link];
    let mut at = link;
    while let Some(parent) = scene.links.get(at)?.parent {
        if parent >= at {
            return None;
        }
        at = parent;
        chain.push(at);
    }
    Some(chain)
}

impl Side {
    /// Body `body_idx` of the scene seen from the frame of link `frame`; `None` for indices that do not exist.
    pub fn new(scene: &Scene, frame: usize, body_idx: usize) -> Option<Self> {
        let body = scene.bodies.get(body_idx)?;
        let up = ancestry(scene, frame)?;
        let down = ancestry(scene, body.link_idx)?;
        let meeting = *up.iter().find(|link| down.contains(link))?;
        let mut steps = Vec::new();
        for &link in up.iter().take_while(|&&link| link != meeting) {
            steps.extend(motion(&scene.links[link].motion, -1.0));
            steps.push(fixed_inverse(&scene.links[link].X_PF));
        }
        let below: Vec<usize> = down.into_iter().take_while(|&link| link != meeting).collect();
        for &link in below.iter().rev() {
            steps.push(fixed(&scene.links[link].X_PF));
            steps.extend(motion(&scene.links[link].motion, 1.0));
        }
        steps.push(fixed(&body.X_LS));
        Some(Self { steps: merge(steps), inflation: 0.0 })
    }

    /// Coordinates of the motions, from the frame outwards.
    pub fn coordinates(&self) -> Vec<usize> {
        self.steps.iter().filter_map(Step::coordinate).collect()
    }

    /// Leaves out the `n_dropped` motions nearest to the body, each a rotation that maps the body to itself but for a
    /// distance that is added to `inflation`. `None` if there are fewer, if one is no rotation, or if the body has no
    /// such symmetry.
    ///
    /// A rotation about an axis whose offset from the body's axis of symmetry is ε and whose tilt is τ moves a point
    /// of the core by at most 2 (ε + τ · extent) from where the rotation about the body's own axis would have
    /// brought it, and that one maps the core to itself.
    pub fn drop_rotations(mut self, scene: &Scene, body_idx: usize, n_dropped: usize) -> Option<Self> {
        let shape = &scene.bodies.get(body_idx)?.shape;
        let symmetry = body::symmetry(shape);
        for _ in 0..n_dropped {
            if symmetry == Symmetry::None {
                return None;
            }
            let turn_idx = self.steps.iter().rposition(|step| !matches!(step, Step::Fixed { .. }))?;
            let Step::Turn { axis, .. } = self.steps[turn_idx].clone() else { return None };
            self.steps.remove(turn_idx);
            let tail = merge(self.steps.split_off(turn_idx));
            let Some(Step::Fixed { R, p }) = tail.first() else { return None };
            // |p × axis| is the distance of the shape's origin from the axis, whose length is 1 but for the slack.
            let inverse_length = interval::norm(&axis).recip();
            let offset = interval::norm(&cross(p, &axis)) * inverse_length;
            let mut deviation = offset;
            if symmetry == Symmetry::AboutZ {
                let z_S = [R[0][2], R[1][2], R[2][2]];
                let sine =
                    interval::norm(&cross(&z_S, &axis)) * inverse_length * interval::norm(&z_S).recip();
                if !(sine.hi() < 0.5) {
                    return None;
                }
                // τ ≤ 1.1 sin τ below 30°.
                let tilt = Interval::point(1.1) * sine;
                deviation = deviation + tilt * Interval::point(body::core_extent(shape));
            }
            let added = Interval::point(2.0) * deviation + Interval::point(self.inflation);
            self.inflation = added.hi();
            self.steps.extend(tail);
            self.steps = merge(self.steps);
        }
        Some(self)
    }
}

/// Joins neighbouring fixed transforms.
fn merge(steps: Vec<Step>) -> Vec<Step> {
    let mut merged: Vec<Step> = Vec::with_capacity(steps.len());
    for step in steps {
        match (merged.last_mut(), step) {
            (Some(Step::Fixed { R: R1, p: p1 }), Step::Fixed { R: R2, p: p2 }) => {
                let moved = interval::times_vec(R1, &p2);
                *p1 = std::array::from_fn(|i| p1[i] + moved[i]);
                *R1 = interval::times(R1, &R2);
            }
            (_, step) => merged.push(step),
        }
    }
    merged
}

/// Cross product.
pub(crate) fn cross(a: &Vec3, b: &Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
