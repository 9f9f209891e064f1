//! Rational forward kinematics: poses along a chain as polynomials in s over a common denominator.
//!
//! For a revolute joint s = tan((q − q*)/2) / T, for a prismatic one s = (q − q*) / T. With t = T s,
//!
//! ```text
//! (1 + t²) R_w(δ) = (1 − t²) I + 2 t [w]× + 2 t² w wᵀ        δ = 2 atan t = q − q*
//! ```
//!
//! so a point x of the last frame is at (R x + p) / D in the first, with entries of R and p of degree at most 2 in each
//! revolute variable and 1 in each prismatic one, and D = ∏ (1 + T_i² s_i²) over the revolute joints.
//! Source: mathematics.md 2.2; Wampler & Sommese 2011, section 4.

use crate::{Chain, RigidTransform};
use nalgebra::{Matrix3, Vector3};
use scene::CoordinateKind;
use sos::{Monomial, Polynomial};

/// A coordinate of TC-space, centred and scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TcVariable {
    /// The coordinate of C-space.
    pub coordinate_idx: usize,
    /// Angle or length.
    pub kind: CoordinateKind,
    /// q*, radians or metres.
    pub center: f64,
    /// T, positive: s = ±1 at q* ± 2 atan T, or q* ± T.
    pub scale: f64,
}

impl TcVariable {
    /// s of the value `q` of its coordinate.
    pub fn s_from_q(&self, q: f64) -> f64 {
        match self.kind {
            CoordinateKind::Revolute => (0.5 * (q - self.center)).tan() / self.scale,
            CoordinateKind::Prismatic => (q - self.center) / self.scale,
        }
    }

    /// q of `s`.
    pub fn q_from_s(&self, s: f64) -> f64 {
        match self.kind {
            CoordinateKind::Revolute => self.center + 2.0 * (self.scale * s).atan(),
            CoordinateKind::Prismatic => self.center + self.scale * s,
        }
    }
}

/// The pose at the end of a chain, times its denominator.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalPose {
    /// D · R, by rows.
    pub R: [[Polynomial; 3]; 3],
    /// D · p.
    pub p: [Polynomial; 3],
    /// D ≥ 1.
    pub denominator: Polynomial,
}

impl RationalPose {
    /// X(s) of the chain; `None` if a joint's coordinate is not among `variables`, whose positions number the s_i.
    pub fn new(chain: &Chain, variables: &[TcVariable]) -> Option<Self> {
        let one = Polynomial::constant(1.0);
        let mut pose = Self {
            R: std::array::from_fn(|i| {
                std::array::from_fn(|j| if i == j { one.clone() } else { Polynomial::zero() })
            }),
            p: std::array::from_fn(|_| Polynomial::zero()),
            denominator: one,
        };
        let (last, others) = chain.transforms.split_last()?;
        pose.prepend_fixed(last);
        for (joint, X) in chain.joints.iter().zip(others).rev() {
            let i = variables.iter().position(|v| v.coordinate_idx == joint.coordinate_idx)?;
            let TcVariable { center, scale, .. } = variables[i];
            let (s, w) = (Monomial::variable(i), joint.axis.into_inner());
            match joint.kind {
                CoordinateKind::Revolute => {
                    pose.prepend_fixed(&joint.pose(center));
                    let mut even = Polynomial::constant(1.0);
                    even.add_term(s.times(s), -scale * scale);
                    let odd = Polynomial::term(s, 2.0 * joint.sign * scale);
                    let square = Polynomial::term(s.times(s), 2.0 * scale * scale);
                    let cross = w.cross_matrix();
                    let turn: [[Polynomial; 3]; 3] = std::array::from_fn(|a| {
                        std::array::from_fn(|b| {
                            let mut entry = odd.scaled(cross[(a, b)]);
                            entry.add_scaled(w[a] * w[b], &square);
                            if a == b { entry.plus(&even) } else { entry }
                        })
                    });
                    pose.prepend(|x| std::array::from_fn(|a| sum(&turn[a], x)));
                    let mut denominator = Polynomial::constant(1.0);
                    denominator.add_term(s.times(s), scale * scale);
                    pose.denominator = pose.denominator.times(&denominator);
                }
                CoordinateKind::Prismatic => {
                    let way = Polynomial::affine(joint.sign * center, &[])
                        .plus(&Polynomial::term(s, joint.sign * scale))
                        .times(&pose.denominator);
                    for a in 0..3 {
                        pose.p[a].add_scaled(w[a], &way);
                    }
                }
            }
            pose.prepend_fixed(X);
        }
        Some(pose)
    }

    /// D · (R x + p).
    pub fn point(&self, x: &Vector3<f64>) -> [Polynomial; 3] {
        std::array::from_fn(|a| {
            let mut numerator = self.p[a].clone();
            for b in 0..3 {
                numerator.add_scaled(x[b], &self.R[a][b]);
            }
            numerator
        })
    }

    fn prepend_fixed(&mut self, X: &RigidTransform) {
        let R: Matrix3<f64> = X.rotation.to_rotation_matrix().into_inner();
        self.prepend(|x| {
            std::array::from_fn(|a| {
                let mut moved = Polynomial::zero();
                for b in 0..3 {
                    moved.add_scaled(R[(a, b)], &x[b]);
                }
                moved
            })
        });
        for a in 0..3 {
            self.p[a].add_scaled(X.translation.vector[a], &self.denominator);
        }
    }

    /// Applies a linear map to the columns of R and to p.
    fn prepend(&mut self, map: impl Fn(&[Polynomial; 3]) -> [Polynomial; 3]) {
        for column in 0..3 {
            let x: [Polynomial; 3] = std::array::from_fn(|a| self.R[a][column].clone());
            for (a, moved) in map(&x).into_iter().enumerate() {
                self.R[a][column] = moved;
            }
        }
        self.p = map(&self.p);
    }
}

fn sum(row: &[Polynomial; 3], x: &[Polynomial; 3]) -> Polynomial {
    let mut sum = Polynomial::zero();
    for b in 0..3 {
        sum.add_scaled(1.0, &row[b].times(&x[b]));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChainJoint;
    use nalgebra::{Translation3, Unit, UnitQuaternion};
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from)
    }

    fn transform() -> impl Strategy<Value = RigidTransform> {
        (vector(), vector()).prop_map(|(p, turn)| {
            RigidTransform::from_parts(Translation3::from(p), UnitQuaternion::from_scaled_axis(turn * 3.0))
        })
    }

    fn chain() -> impl Strategy<Value = Chain> {
        let joint = (vector(), any::<bool>(), any::<bool>());
        prop::collection::vec((joint, transform()), 0..5).prop_flat_map(|joints| {
            transform().prop_map(move |first| Chain {
                transforms: std::iter::once(first).chain(joints.iter().map(|(_, X)| *X)).collect(),
                joints: joints
                    .iter()
                    .enumerate()
                    .map(|(i, ((axis, is_angle, is_up), _))| ChainJoint {
                        coordinate_idx: i,
                        kind: if *is_angle { CoordinateKind::Revolute } else { CoordinateKind::Prismatic },
                        axis: Unit::new_normalize(axis + Vector3::new(0.0, 0.0, 1e-3)),
                        sign: if *is_up { -1.0 } else { 1.0 },
                        link_idx: i,
                    })
                    .collect(),
                frame_links: vec![0; joints.len() + 1],
            })
        })
    }

    proptest! {
        /// The rational pose is the pose, whatever the centre and the scale.
        #[test]
        fn rational_kinematics_is_kinematics(chain in chain(), x in vector(),
                                             q in prop::array::uniform5(-1.5..1.5_f64),
                                             center in prop::array::uniform5(-1.0..1.0_f64),
                                             scale in 0.2..2.0_f64) {
            let variables: Vec<TcVariable> = chain.joints.iter().map(|joint| TcVariable {
                coordinate_idx: joint.coordinate_idx,
                kind: joint.kind,
                center: center[joint.coordinate_idx],
                scale,
            }).collect();
            let s: Vec<f64> = variables.iter().map(|v| v.s_from_q(q[v.coordinate_idx])).collect();
            for (v, s) in variables.iter().zip(&s) {
                prop_assert!((v.q_from_s(*s) - q[v.coordinate_idx]).abs() < 1e-12);
            }
            let pose = RationalPose::new(&chain, &variables).expect("all coordinates are variables");
            let denominator = pose.denominator.value(&s);
            prop_assert!(denominator >= 1.0 - 1e-12);
            let expected = chain.pose(&q) * nalgebra::Point3::from(x);
            for (a, numerator) in pose.point(&x).iter().enumerate() {
                prop_assert!((numerator.value(&s) / denominator - expected[a]).abs() < 1e-10);
                for (i, joint) in chain.joints.iter().enumerate() {
                    let most = if joint.kind == CoordinateKind::Revolute { 2 } else { 1 };
                    prop_assert!(numerator.degree_in(i) <= most);
                }
            }
            prop_assert!(chain.joints.is_empty() || RationalPose::new(&chain, &[]).is_none());
        }
    }
}
