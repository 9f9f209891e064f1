//! Points of a body as rational functions of s = tan((q − q*)/2)/T, or (q − q*)/T for a prismatic joint.
//!
//! A point is at X(s)/D(s). With t = T s, cos δ = (1 − t²)/(1 + t²), sin δ = 2t/(1 + t²) and 1 − cos δ = 2t²/(1 + t²),
//! so a turn by δ about the unit axis w takes X to (1 − t²) X + 2t w × X + 2t² w (w·X), over a denominator 1 + t² more.

use crate::chain::{Side, Step, cross};
use crate::interval::{self, Interval, Mat3, Vec3};
use crate::sos::polynomial::{self, Polynomial};
use crate::swept::rotation;
use ipc_types::artefact::SosJoint;

/// Three polynomials.
pub type PolynomialVec = [Polynomial; 3];

/// The denominator D of a side, common to all its points; `None` if a coordinate of the side is not among `joints`.
pub fn denominator(side: &Side, joints: &[SosJoint]) -> Option<Polynomial> {
    let mut D = Polynomial::constant(Interval::ONE);
    for step in &side.steps {
        if let Step::Turn { coordinate, .. } = step {
            D = D.times(&one_plus_square(variable(joints, *coordinate)?)?);
        }
    }
    Some(D)
}

/// The numerator X of the point `v` of the shape's frame, seen from the side's frame.
pub fn numerator(side: &Side, joints: &[SosJoint], v: &Vec3) -> Option<PolynomialVec> {
    let mut X = v.map(Polynomial::constant);
    let mut D = Polynomial::constant(Interval::ONE);
    for step in side.steps.iter().rev() {
        match step {
            Step::Fixed { R, p } => {
                let moved = times(R, &X);
                X = add(moved, &p.map(|p| D.scaled(p)));
            }
            Step::Turn { axis, sign, coordinate } => {
                let (i, joint) = variable(joints, *coordinate)?;
                let T = Interval::point(joint.scale);
                let two_t = single(i, 1, Interval::point(2.0 * sign) * T)?;
                let t2 = single(i, 2, T.square())?;
                let crossed = cross_polynomial(axis, &X);
                let along = (0..3).fold(Polynomial::default(), |sum, r| sum.plus(&X[r].scaled(axis[r])));
                let turned: PolynomialVec = std::array::from_fn(|r| {
                    let rest = X[r].clone().minus(&t2.times(&X[r]));
                    let across = two_t.times(&crossed[r]);
                    let kept = t2.times(&along.scaled(Interval::point(2.0) * axis[r]));
                    rest.plus(&across).plus(&kept)
                });
                let (s, c) = (Interval::point(*sign) * Interval::point(joint.center)).sin_cos();
                X = times(&rotation(axis, s, c, Interval::ONE), &turned);
                D = D.times(&one_plus_square((i, joint))?);
            }
            Step::Slide { axis, sign, coordinate } => {
                let (i, joint) = variable(joints, *coordinate)?;
                let sign = Interval::point(*sign);
                let q = Polynomial::constant(sign * Interval::point(joint.center)).plus(&single(
                    i,
                    1,
                    sign * Interval::point(joint.scale),
                )?);
                let moved = q.times(&D);
                X = add(X, &axis.map(|w| moved.scaled(w)));
            }
        }
    }
    Some(X)
}

fn variable(joints: &[SosJoint], coordinate: usize) -> Option<(usize, &SosJoint)> {
    joints.iter().enumerate().find(|(_, joint)| usize::from(joint.coordinate) == coordinate)
}

fn single(i: usize, exponent: u8, coefficient: Interval) -> Option<Polynomial> {
    let mut p = Polynomial::default();
    p.add_term(polynomial::power(i, exponent)?, coefficient);
    Some(p)
}

/// 1 + T² s².
fn one_plus_square((i, joint): (usize, &SosJoint)) -> Option<Polynomial> {
    Some(Polynomial::constant(Interval::ONE).plus(&single(i, 2, Interval::point(joint.scale).square())?))
}

fn add(a: PolynomialVec, b: &PolynomialVec) -> PolynomialVec {
    let mut terms = b.iter();
    a.map(|x| terms.next().map_or_else(Polynomial::default, |y| x.plus(y)))
}

fn times(R: &Mat3, X: &PolynomialVec) -> PolynomialVec {
    std::array::from_fn(|r| (0..3).fold(Polynomial::default(), |sum, c| sum.plus(&X[c].scaled(R[r][c]))))
}

/// w × X, column by column of [w]×.
fn cross_polynomial(w: &Vec3, X: &PolynomialVec) -> PolynomialVec {
    let columns: [Vec3; 3] = [
        cross(w, &interval::point3(1.0, 0.0, 0.0)),
        cross(w, &interval::point3(0.0, 1.0, 0.0)),
        cross(w, &interval::point3(0.0, 0.0, 1.0)),
    ];
    std::array::from_fn(|r| {
        (0..3).fold(Polynomial::default(), |sum, c| sum.plus(&X[c].scaled(columns[c][r])))
    })
}
