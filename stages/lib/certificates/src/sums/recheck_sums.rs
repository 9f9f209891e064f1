//! A second look at a sum-of-squares proof in plain `f64`, from the stored data alone.
//!
//! It shares the kinematics with the search, so it is no independent verifier (that is `regrasp-check`, in interval
//! arithmetic); no proof leaves the certifier without having passed it, with a margin above what intervals lose.

use crate::cell::CellBox;
use crate::rows::Rows;
use crate::sums::pair_sums::{PairSums, SidePolynomials};
use crate::sums::tangent_space::least_difference;
use ipc_types::artefact::{SosJoint, SosProof, SosRow, SosTerm};
use nalgebra::Vector3;
use scene::CoordinateKind;
use sos::{GramBasis, Monomial, Polynomial, gram_polynomial, is_positive_definite};

/// What is wrong with a proof.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum SumsError {
    #[error("its shapes do not fit together")]
    Malformed,
    #[error("its frame is not between the bodies, or its joints are not the pair's")]
    Frame,
    #[error("joint {joint_idx}: bounds or scale do not hold on the region")]
    Joint { joint_idx: usize },
    #[error("row {row_idx} does not hold on the region")]
    Row { row_idx: usize },
    #[error("side {side}, point {point_idx}: term {term_idx} is no positive definite Gram form")]
    Gram { side: usize, point_idx: usize, term_idx: usize },
    #[error("side {side}, point {point_idx}: {value:e} is left where a positive number is needed")]
    Margin { side: usize, point_idx: usize, value: f64 },
}

/// A Gram matrix less this share of its greatest diagonal entry must still have a Cholesky factor.
const GRAM_MARGIN: f64 = 1e-13;
/// What must be left of the residual's bound, relative to the coefficients that make it up.
const MARGIN: f64 = 1e-12;

/// Looks at the proof for `pair` on the region with the rows `region`; returns the least margin left.
pub fn recheck_sums(
    pair: &PairSums,
    proof: &SosProof,
    region: &Rows,
    limits: &CellBox,
) -> Result<f64, SumsError> {
    proof.validate(limits.lower.len(), region.len()).map_err(|_| SumsError::Malformed)?;
    let coordinates = proof.joints.iter().map(|joint| usize::from(joint.coordinate));
    let frame_idx = (0..pair.chain.frames.len()).find(|&idx| pair.frame_choice(idx) == proof.frame);
    let (Some(frame_idx), true) = (frame_idx, coordinates.eq(pair.coordinates.iter().copied())) else {
        return Err(SumsError::Frame);
    };
    for (joint_idx, (joint, kind)) in proof.joints.iter().zip(&pair.kinds).enumerate() {
        if !joint_holds(joint, *kind, region, limits) {
            return Err(SumsError::Joint { joint_idx });
        }
    }
    for (row_idx, row) in proof.rows.iter().enumerate() {
        if !row_holds(row, &proof.joints, &pair.kinds, region, limits) {
            return Err(SumsError::Row { row_idx });
        }
    }
    let sides = pair.sides(frame_idx, &proof.enclosures, &proof.joints).ok_or(SumsError::Malformed)?;
    let weights = Weights::new(proof);
    let mut least = f64::INFINITY;
    for (side_idx, (side, points)) in sides.iter().zip([&proof.points_a, &proof.points_b]).enumerate() {
        if points.len() != side.points.len() {
            return Err(SumsError::Malformed);
        }
        for (point_idx, terms) in points.iter().enumerate() {
            for (term_idx, term) in terms.iter().enumerate() {
                let order = weights.bases[usize::from(term.basis)].order();
                if !is_positive_definite(order, &term.gram, GRAM_MARGIN) {
                    return Err(SumsError::Gram { side: side_idx, point_idx, term_idx });
                }
            }
            let claim = claim(proof, side, side_idx, point_idx, pair.model.clearance);
            let (value, size) = weights.margin(&claim, terms);
            // A verifier bounds what dropped rotations add by itself, and may come to a little more.
            let denominator: f64 = side.denominator.terms().map(|(_, c)| c.abs()).sum();
            if !(value > MARGIN * size + pair.inflation * denominator) {
                return Err(SumsError::Margin { side: side_idx, point_idx, value });
            }
            least = least.min(value);
        }
    }
    Ok(least)
}

/// N: the greatest ‖a(s)‖ on the unit box, from its corners, rounded up.
pub fn greatest_norm(plane_a: &[[f64; 3]]) -> f64 {
    let k = plane_a.len().saturating_sub(1);
    let mut most: f64 = 0.0;
    for corner in 0..1_usize << k {
        let mut a = plane_a.first().map_or_else(Vector3::zeros, |a| Vector3::from(*a));
        for i in 0..k {
            a += Vector3::from(plane_a[i + 1]) * if corner >> i & 1 == 1 { 1.0 } else { -1.0 };
        }
        most = most.max(a.norm());
    }
    most * (1.0 + 1e-13)
}

/// The polynomial that is to be positive at a point.
fn claim(
    proof: &SosProof,
    side: &SidePolynomials,
    side_idx: usize,
    point_idx: usize,
    clearance: f64,
) -> Polynomial {
    let k = proof.joints.len();
    let sign = if side_idx == 0 { 1.0 } else { -1.0 };
    let coefficients = proof.plane_a.iter().flatten().chain(&proof.plane_b);
    let mut p = Polynomial::zero();
    for (at, coefficient) in coefficients.enumerate() {
        p.add_scaled(sign * coefficient, &side.plane_slope(point_idx, at, k));
    }
    let distance = greatest_norm(&proof.plane_a) * (side.radius + 0.5 * clearance);
    p.add_scaled(-distance, &side.denominator);
    p
}

/// The factors and bases that terms name.
pub struct Weights {
    factors: Vec<Polynomial>,
    bases: Vec<GramBasis>,
}

impl Weights {
    /// Those of `proof`.
    pub fn new(proof: &SosProof) -> Self {
        let monomials = |basis: &Vec<Vec<u8>>| basis.iter().map(|m| Monomial::new(m)).collect();
        Self {
            factors: factors(proof.joints.len(), &proof.rows),
            bases: proof.bases.iter().map(|basis| GramBasis::new(monomials(basis))).collect(),
        }
    }

    /// A lower bound of the claim less the terms on the unit box, and the size of what it is made of.
    pub fn margin(&self, claim: &Polynomial, terms: &[SosTerm]) -> (f64, f64) {
        let mut rest = claim.clone();
        let mut size: f64 = claim.terms().map(|(_, c)| c.abs()).sum();
        for term in terms {
            let mut weight = Polynomial::constant(1.0);
            for &factor in &term.factors {
                weight = weight.times(&self.factors[usize::from(factor)]);
            }
            let square = weight.times(&gram_polynomial(&self.bases[usize::from(term.basis)], &term.gram));
            size += square.terms().map(|(_, c)| c.abs()).sum::<f64>();
            rest.add_scaled(-1.0, &square);
        }
        (rest.lower_bound_on_unit_box(), size)
    }
}

/// 1 − s_i and 1 + s_i for each variable, then d − c·s for each row.
pub fn factors(k: usize, rows: &[SosRow]) -> Vec<Polynomial> {
    let unit = |i: usize, sign: f64| {
        let mut p = Polynomial::constant(1.0);
        p.add_term(Monomial::variable(i), sign);
        p
    };
    let sides = (0..k).flat_map(|i| [unit(i, -1.0), unit(i, 1.0)]);
    let minus = |row: &SosRow| row.c.iter().map(|c| -c).collect::<Vec<f64>>();
    sides.chain(rows.iter().map(|row| Polynomial::affine(row.d, &minus(row)))).collect()
}

fn joint_holds(joint: &SosJoint, kind: CoordinateKind, region: &Rows, limits: &CellBox) -> bool {
    let j = usize::from(joint.coordinate);
    // sign q_j ≤ value, by the multipliers.
    let follows = |sign: f64, value: f64, multipliers: &[(u32, f64)]| {
        let mut g = vec![0.0; limits.lower.len()];
        g[j] = -sign;
        sign * limits.center(j) - region.bound(limits, &g, multipliers) <= value + 1e-12 * (1.0 + value.abs())
    };
    let reach = |delta: f64| match kind {
        CoordinateKind::Revolute => delta.abs() < std::f64::consts::PI && (0.5 * delta).tan() <= joint.scale,
        CoordinateKind::Prismatic => delta <= joint.scale,
    };
    follows(1.0, joint.upper, &joint.upper_multipliers)
        && follows(-1.0, -joint.lower, &joint.lower_multipliers)
        && reach(joint.upper - joint.center)
        && reach(joint.center - joint.lower)
}

fn row_holds(
    row: &SosRow,
    joints: &[SosJoint],
    kinds: &[CoordinateKind],
    region: &Rows,
    limits: &CellBox,
) -> bool {
    let n = limits.lower.len();
    let (mut a, mut least) = (vec![0.0; n], 0.0);
    for &(r, mu) in &row.multipliers {
        for j in 0..n {
            a[j] += mu * region.a(r as usize)[j];
        }
        least += mu * region.b[r as usize];
    }
    for (i, (joint, kind)) in joints.iter().zip(kinds).enumerate() {
        let j = usize::from(joint.coordinate);
        least -= least_difference(a[j], row.c[i], joint, *kind);
        a[j] = 0.0;
    }
    for j in 0..n {
        least -= (a[j] * limits.lower[j]).min(a[j] * limits.upper[j]);
    }
    row.d > least
}
