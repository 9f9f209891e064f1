//! Sum-of-squares proofs that two bodies are apart on a region. The mathematics is at the head of
//! `ipc_types::artefact::SosProof`; every number here is an interval around the exact one.

mod enclosure;
mod polynomial;
mod positive_definite;
mod rational_kinematics;
mod tangent_space;

use crate::chain::Side;
use crate::interval::{self, Interval, Vec3};
use ipc_types::artefact::{PairCertificate, SosJoint, SosProof, SosTerm, SweptRow};
use polynomial::Polynomial;
use scene::Scene;
use tangent_space::Ground;

/// Largest degree in one variable that a term may reach: keys of monomials have eight bits a variable.
const MAX_DEGREE: usize = 200;

/// Why a sum-of-squares proof does not prove what it claims.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SosError {
    /// Lengths or numbers that do not fit together.
    #[error("the sum-of-squares proof is malformed: {0}")]
    Malformed(String),
    /// The frame does not see the pair, or the variables are not the joints between the two bodies.
    #[error("the frame of link {link} does not see the bodies by exactly the joints that the proof lists")]
    Frame {
        /// Link.
        link: usize,
    },
    /// A variable that may leave [-1, 1] on the region.
    #[error(
        "coordinate {coordinate} is not proven to stay between {lower} and {upper} on the region, or its scale {scale} is too small"
    )]
    Variable {
        /// Coordinate.
        coordinate: usize,
        /// Claimed lower bound.
        lower: f64,
        /// Claimed upper bound.
        upper: f64,
        /// Scale T.
        scale: f64,
    },
    /// A row that is not proven on the image of the region.
    #[error("row {row_idx} of the sum-of-squares proof is not proven to hold on the region")]
    Row {
        /// Position.
        row_idx: usize,
    },
    /// A body and an enclosure that do not go together, or another number of points than it has.
    #[error("the points of body {side} are not those of its enclosure")]
    Enclosure {
        /// `A` or `B`.
        side: char,
    },
    /// A multiplier that is not proven positive semidefinite.
    #[error(
        "point {point_idx} of body {side}: the Gram matrix of term {term_idx} is not proven positive semidefinite"
    )]
    NotPositive {
        /// `A` or `B`.
        side: char,
        /// Position of the point.
        point_idx: usize,
        /// Position of the term.
        term_idx: usize,
    },
    /// The identity does not hold closely enough.
    #[error(
        "point {point_idx} of body {side}: what the sums of squares leave is only proven to exceed {bound:e}, which is not positive"
    )]
    NotSeparated {
        /// `A` or `B`.
        side: char,
        /// Position of the point.
        point_idx: usize,
        /// Proven lower bound.
        bound: f64,
    },
}

/// Verifies `proof`; `rows` hold on the region, `lower` and `upper` are the joint limits. Returns the number of points.
pub fn verify(
    scene: &Scene,
    pair: &PairCertificate,
    proof: &SosProof,
    rows: &[SweptRow],
    lower: &[f64],
    upper: &[f64],
) -> Result<usize, SosError> {
    proof
        .validate(scene.dim(), rows.len())
        .map_err(|violation| SosError::Malformed(violation.to_string()))?;
    let sides = see(scene, pair, proof).ok_or(SosError::Frame { link: proof.frame.link as usize })?;
    let ground = Ground { scene, rows, lower, upper };
    for joint in &proof.joints {
        if !tangent_space::joint_holds(&ground, joint) {
            let SosJoint { lower, upper, scale, .. } = *joint;
            return Err(SosError::Variable {
                coordinate: usize::from(joint.coordinate),
                lower,
                upper,
                scale,
            });
        }
    }
    for (row_idx, row) in proof.rows.iter().enumerate() {
        if !tangent_space::row_holds(&ground, &proof.joints, row) {
            return Err(SosError::Row { row_idx });
        }
    }
    let norm = norm_bound(proof);
    let mut n_points = 0;
    for (side_idx, (name, sign, points)) in
        [('A', 1.0, &proof.points_a), ('B', -1.0, &proof.points_b)].into_iter().enumerate()
    {
        let body = [pair.body_a, pair.body_b][side_idx] as usize;
        let side = &sides[side_idx];
        let (corners, radius) = enclosure::enclose(&scene.bodies[body].shape, &proof.enclosures[side_idx])
            .filter(|(corners, _)| corners.len() == points.len())
            .ok_or(SosError::Enclosure { side: name })?;
        let reach = Interval::point(radius)
            + Interval::point(side.inflation)
            + Interval::point(pair.clearance) * Interval::point(0.5);
        let claim = Claim { proof, sign, kept: Interval::point(norm) * reach };
        for (point_idx, (corner, terms)) in corners.iter().zip(points).enumerate() {
            if let Some(term_idx) = terms.iter().position(|term| !is_positive(proof, term)) {
                return Err(SosError::NotPositive { side: name, point_idx, term_idx });
            }
            let rest = claim.rest(side, corner, terms).ok_or_else(|| {
                SosError::Malformed(format!("point {point_idx} of body {name}: its degree is too large"))
            })?;
            let bound = rest.lower_bound();
            if !(bound > 0.0) {
                return Err(SosError::NotSeparated { side: name, point_idx, bound });
            }
            n_points += 1;
        }
    }
    Ok(n_points)
}

/// Both bodies from the proof's frame, if its variables are exactly the coordinates of the joints between.
fn see(scene: &Scene, pair: &PairCertificate, proof: &SosProof) -> Option<[Side; 2]> {
    let side = |body: u32, n_dropped: u32| {
        let body = body as usize;
        Side::new(scene, proof.frame.link as usize, body)?.drop_rotations(scene, body, n_dropped as usize)
    };
    let sides = [side(pair.body_a, proof.frame.n_dropped_a)?, side(pair.body_b, proof.frame.n_dropped_b)?];
    let mut found: Vec<usize> = sides.iter().flat_map(Side::coordinates).collect();
    found.sort_unstable();
    let listed: Vec<usize> = proof.joints.iter().map(|joint| usize::from(joint.coordinate)).collect();
    // A coordinate on both sides would stand twice in what was found: no frame between the bodies has that.
    (found == listed && pair.clearance >= 0.0).then_some(sides)
}

/// Upper bound of ‖a(s)‖ on [−1, 1]^k: a norm of an affine function is convex, so the corners bound it.
fn norm_bound(proof: &SosProof) -> f64 {
    let k = proof.joints.len();
    let mut most = 0.0_f64;
    for corner in 0..1_usize << k {
        let mut a: Vec3 = proof.plane_a[0].map(Interval::point);
        for i in 0..k {
            let slope = proof.plane_a[i + 1].map(Interval::point);
            a = std::array::from_fn(|r| if corner >> i & 1 == 1 { a[r] + slope[r] } else { a[r] - slope[r] });
        }
        most = most.max(interval::norm(&a).hi());
    }
    most
}

fn is_positive(proof: &SosProof, term: &SosTerm) -> bool {
    let size = proof.bases.get(usize::from(term.basis)).map_or(0, Vec::len);
    positive_definite::is_positive_semidefinite(&term.gram, size)
}

/// What is claimed of the points of one body.
struct Claim<'a> {
    proof: &'a SosProof,
    /// +1 for A, −1 for B.
    sign: f64,
    /// N (r + clearance/2).
    kept: Interval,
}

impl Claim<'_> {
    /// p − Σ w mᵀ Q m for the point `corner`; `None` if a degree is too large to be stored.
    fn rest(&self, side: &Side, corner: &Vec3, terms: &[SosTerm]) -> Option<Polynomial> {
        let proof = self.proof;
        let sign = |x: f64| Interval::point(self.sign * x);
        let X = rational_kinematics::numerator(side, &proof.joints, corner)?;
        let D = rational_kinematics::denominator(side, &proof.joints)?;
        let affine = |entry: &dyn Fn(usize) -> Interval| {
            Polynomial::affine(entry(0), (1..=proof.joints.len()).map(entry))
        };
        let mut p = Polynomial::default();
        for r in 0..3 {
            p = p.plus(&affine(&|i| sign(proof.plane_a[i][r])).times(&X[r]));
        }
        p = p.plus(&affine(&|i| sign(proof.plane_b[i])).times(&D));
        p = p.minus(&D.scaled(self.kept));
        for term in terms {
            p = p.minus(&self.term(term)?);
        }
        Some(p)
    }

    /// w mᵀ Q m.
    fn term(&self, term: &SosTerm) -> Option<Polynomial> {
        let basis = self.proof.bases.get(usize::from(term.basis))?;
        let largest = basis.iter().flatten().copied().max().map_or(0, usize::from);
        if 2 * largest + term.factors.len() > MAX_DEGREE {
            return None;
        }
        let key = |monomial: &Vec<u8>| {
            monomial.iter().enumerate().try_fold(0, |key, (i, &e)| Some(key + polynomial::power(i, e)?))
        };
        let keys: Vec<polynomial::Monomial> = basis.iter().map(key).collect::<Option<_>>()?;
        let mut entries = term.gram.iter();
        let mut product = Polynomial::default();
        for column in 0..keys.len() {
            for row in 0..=column {
                let twice = if row == column { 1.0 } else { 2.0 };
                product.add_term(
                    keys[row] + keys[column],
                    Interval::point(twice) * Interval::point(*entries.next()?),
                );
            }
        }
        for &factor in &term.factors {
            product = product.times(&self.factor(usize::from(factor))?);
        }
        Some(product)
    }

    fn factor(&self, factor: usize) -> Option<Polynomial> {
        let k = self.proof.joints.len();
        if factor < 2 * k {
            let slope = if factor.is_multiple_of(2) { -1.0 } else { 1.0 };
            let mut linear = vec![Interval::ZERO; k];
            linear[factor / 2] = Interval::point(slope);
            return Some(Polynomial::affine(Interval::ONE, linear));
        }
        let row = self.proof.rows.get(factor - 2 * k)?;
        Some(Polynomial::affine(Interval::point(row.d), row.c.iter().map(|&c| Interval::point(-c))))
    }
}

#[cfg(test)]
mod tests;
