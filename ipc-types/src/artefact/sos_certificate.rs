//! Sum-of-squares proof that a pair of bodies is apart on a region P (C-IRIS). Source: Dai et al. 2023; mathematics.md
//! 2.2, 2.3.
//!
//! Everything below holds in exact arithmetic for the stored doubles; a verifier encloses it with intervals and needs
//! no solver.
//!
//! **Joints and variables.** The pair's joints are those between the bodies, less the dropped ones (`frame`, as in the
//! swept kind). `joints` has one entry for each of their coordinates, sorted by coordinate: k entries. Entry i has the
//! coordinate j(i), a centre q*, a scale T > 0 and bounds l < u with, for all q in the box of joint limits,
//!
//! ```text
//! q_j − u ≤ Σ μ_r (a_r·q − b_r)        (upper_multipliers)        l − q_j ≤ Σ μ_r (a_r·q − b_r)      (lower_multipliers)
//! ```
//!
//! where (a_r, b_r) are `RegionCertificate::rows`, which hold on P, and μ_r ≥ 0; so l ≤ q_j ≤ u on P. The variable is
//!
//! ```text
//! revolute:  s_i = tan((q_j − q*)/2) / T,   −π < l − q*,  u − q* < π,  tan((u − q*)/2) ≤ T,  tan((q* − l)/2) ≤ T
//! prismatic: s_i = (q_j − q*) / T,          u − q* ≤ T,  q* − l ≤ T
//! ```
//!
//! so that s ∈ [−1, 1]^k on P. (TC-space about q*, scaled.)
//!
//! **Rows.** Each of `rows` claims c·s ≤ d on P, by multipliers μ ≥ 0 of the region's rows: with a = Σ μ_r a_r,
//!
//! ```text
//! d ≥ Σ_r μ_r b_r − Σ_{j not in joints} min { a_j q_j : joint limits } − Σ_i min { a_j(i) q − c_i s_i(q) : l_i ≤ q ≤ u_i }
//! ```
//!
//! A verifier bounds each minimum from below. With δ = q − q*, φ(δ) = a δ − c tan(δ/2)/T is concave where c δ ≥ 0
//! (least at an end of that piece) and convex where c δ ≤ 0 (above its tangent at any point of that piece).
//!
//! **Bodies.** The core of each body is enclosed by the hull of points v in the shape's frame S, in this order:
//!
//! | shape, `enclosure` | points | radius |
//! | --- | --- | --- |
//! | box, `Core` | (±x, ±y, ±z), point number p = 0…7; bit 0, 1, 2 of p set: +x, +y, +z, else − | 0 |
//! | sphere, `Core` | (0, 0, 0) | the sphere's |
//! | capsule, `Core` | (0, 0, −h), (0, 0, h) | the capsule's |
//! | cylinder, `CylinderInCapsule` | (0, 0, −h), (0, 0, h) | the cylinder's |
//! | cylinder, `CylinderInPrism { n_facets: m, phase }` | for p = 0…m−1: ρ (cos α_p, sin α_p), α_p = phase + (2p + 1) π/m, ρ = radius / cos(π/m), first at z = −h, then the next p; then all at z = h | 0 |
//!
//! with h the half length and m ≥ 3. To the radius add what dropped rotations add to it (as in the swept kind):
//! r_A, r_B. No other combination of shape and enclosure is allowed.
//!
//! **Polynomials.** In the frame of `frame.link`, a point v of S is at X_v(s)/D(s): along the steps from the frame's link
//! outwards to the body, from the last to the first, starting with X = v, D = 1:
//!
//! ```text
//! fixed transform (R, p):                   X ← R X + p D
//! revolute, unit axis w, sign ±1:           X ← R_w(± q*) [ (1 − T²s²) X + 2 (± T s) w × X + 2 T²s² w (w·X) ],  D ← (1 + T²s²) D
//! prismatic, unit axis w, sign ±1:          X ← X ± w (q* + T s) D
//! ```
//!
//! (sign −1 where the way goes from child to parent). D ≥ 1 is the side's denominator, common to all its points.
//!
//! **Plane.** a(s) = a_0 + Σ_i a_i s_i ∈ R³, b(s) = b_0 + Σ_i b_i s_i (`plane_a`, `plane_b`: k + 1 entries, constant
//! first). N is any upper bound of ‖a(s)‖ on [−1, 1]^k; the norm is convex, so the largest value at the 2^k corners
//! will do. The claim for each point v of A and each w of B is
//!
//! ```text
//! a(s)·X_v(s) + b(s) D_A(s) − N (r_A + clearance/2) D_A(s) > 0,     −a(s)·X_w(s) − b(s) D_B(s) − N (r_B + clearance/2) D_B(s) > 0
//! ```
//!
//! on s(P); so the bodies are further apart than `clearance`, on two sides of a plane.
//!
//! **Sums of squares.** For each point, p being the left side above, `terms` are
//!
//! ```text
//! Σ_t w_t(s) · m_t(s)ᵀ Q_t m_t(s)
//! ```
//!
//! with m_t the monomials of `bases[basis]`, Q_t symmetric positive semidefinite, and w_t the product of `factors`:
//! factor 2i is 1 − s_i, factor 2i + 1 is 1 + s_i, factor 2k + r is d_r − c_r·s (row r); the empty product is 1. Every w_t
//! is nonnegative on s(P). `gram` is the upper triangle of Q_t by columns, entries as they are (no √2):
//! Q_00, Q_01, Q_11, Q_02, Q_12, Q_22, …
//!
//! **What decides.** Let ϱ = p − Σ_t w_t m_tᵀ Q_t m_t, expanded into monomials ϱ_α s^α. The point is proven if every Q_t is
//! positive semidefinite (the producer makes them positive definite, for an interval Cholesky) and
//!
//! ```text
//! ϱ_0 − Σ_{α ≠ 0} |ϱ_α| > 0,
//! ```
//!
//! since |s^α| ≤ 1: then p > 0 on s(P). With k = 0 there are no terms and p is a number.

use crate::artefact::FrameChoice;
use crate::validate::Violation;
use serde::{Deserialize, Serialize};

/// Proof for one pair on one region; see the module's head.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SosProof {
    /// The link in whose frame the plane is written, and the joints that drop out.
    pub frame: FrameChoice,
    /// How the cores of A and B are enclosed.
    pub enclosures: [CoreEnclosure; 2],
    /// The variables [k], sorted by coordinate.
    pub joints: Vec<SosJoint>,
    /// Further rows that hold on s(P).
    pub rows: Vec<SosRow>,
    /// a(s) [k + 1], constant first.
    pub plane_a: Vec<[f64; 3]>,
    /// b(s) [k + 1], constant first.
    pub plane_b: Vec<f64>,
    /// Monomial bases that terms name by position: each monomial as its k exponents.
    pub bases: Vec<Vec<Vec<u8>>>,
    /// For each point of A's core, in the order of the module's head, the terms that prove it on the positive side.
    pub points_a: Vec<Vec<SosTerm>>,
    /// The same for B, on the negative side.
    pub points_b: Vec<Vec<SosTerm>>,
}

/// A convex hull of points that contains the core of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum CoreEnclosure {
    /// The core itself: box, sphere, capsule.
    Core,
    /// A cylinder in the capsule of its radius about its axis.
    CylinderInCapsule,
    /// A cylinder in a prism whose facets touch it, the first at the angle `phase` from the x axis.
    CylinderInPrism {
        /// Facets, at least 3.
        n_facets: u16,
        /// Radians.
        phase: f64,
    },
}

/// A variable s_i.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SosJoint {
    /// Index of the coordinate.
    pub coordinate: u16,
    /// q*, radians or metres.
    pub center: f64,
    /// T, positive.
    pub scale: f64,
    /// l: the coordinate is not below this on P.
    pub lower: f64,
    /// u: the coordinate is not above this on P.
    pub upper: f64,
    /// Why q_j ≥ l: (index into `RegionCertificate::rows`, μ ≥ 0); empty where l is the joint limit or below.
    pub lower_multipliers: Vec<(u32, f64)>,
    /// Why q_j ≤ u.
    pub upper_multipliers: Vec<(u32, f64)>,
}

/// A row c·s ≤ d that holds on s(P).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SosRow {
    /// Coefficients [k].
    pub c: Vec<f64>,
    /// Offset.
    pub d: f64,
    /// Why it holds: (index into `RegionCertificate::rows`, μ ≥ 0).
    pub multipliers: Vec<(u32, f64)>,
}

/// A summand w(s) · m(s)ᵀ Q m(s).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SosTerm {
    /// Factors of w.
    pub factors: Vec<u16>,
    /// Position in `SosProof::bases`.
    pub basis: u16,
    /// Upper triangle of Q by columns.
    pub gram: Vec<f64>,
}

/// Most joints between two bodies: the corners of [−1, 1]^k are enumerated.
pub const MAX_SOS_JOINTS: usize = 14;
/// Largest exponent in a basis.
pub const MAX_SOS_EXPONENT: u8 = 8;

impl SosProof {
    /// Whether shapes fit together and numbers are finite, for a scene of `dim` coordinates and a certificate of
    /// `n_rows` rows. It says nothing about what is proven.
    pub fn validate(&self, dim: usize, n_rows: usize) -> Result<(), Violation> {
        let k = self.joints.len();
        if k > MAX_SOS_JOINTS {
            return Err(Violation::new("length of joints", k, format!("at most {MAX_SOS_JOINTS}")));
        }
        for (i, joint) in self.joints.iter().enumerate() {
            joint.validate(dim, n_rows).map_err(|v| v.within(&format!("joints[{i}]")))?;
            if i > 0 && self.joints[i - 1].coordinate >= joint.coordinate {
                let field = format!("joints[{i}].coordinate");
                return Err(Violation::new(field, joint.coordinate, "coordinates in ascending order"));
            }
        }
        for (i, row) in self.rows.iter().enumerate() {
            let within = |v: Violation| v.within(&format!("rows[{i}]"));
            numbers("c", &row.c, k).map_err(within)?;
            numbers("d", &[row.d], 1).map_err(within)?;
            multipliers("multipliers", &row.multipliers, n_rows).map_err(within)?;
        }
        let plane_a: Vec<f64> = self.plane_a.iter().flatten().copied().collect();
        numbers("plane_a", &plane_a, 3 * (k + 1))?;
        numbers("plane_b", &self.plane_b, k + 1)?;
        for (i, basis) in self.bases.iter().enumerate() {
            for (m, monomial) in basis.iter().enumerate() {
                let field = format!("bases[{i}][{m}]");
                if monomial.len() != k {
                    return Err(Violation::new(format!("length of {field}"), monomial.len(), k.to_string()));
                }
                if let Some(&exponent) = monomial.iter().find(|&&exponent| exponent > MAX_SOS_EXPONENT) {
                    return Err(Violation::new(field, exponent, format!("at most {MAX_SOS_EXPONENT}")));
                }
            }
        }
        for enclosure in &self.enclosures {
            if let CoreEnclosure::CylinderInPrism { n_facets, phase } = *enclosure {
                if n_facets < 3 {
                    return Err(Violation::new("enclosures: n_facets", n_facets, "at least 3"));
                }
                numbers("enclosures: phase", &[phase], 1)?;
            }
        }
        for (side, points) in [("points_a", &self.points_a), ("points_b", &self.points_b)] {
            for (p, terms) in points.iter().enumerate() {
                for (t, term) in terms.iter().enumerate() {
                    self.validate_term(term).map_err(|v| v.within(&format!("{side}[{p}][{t}]")))?;
                }
            }
        }
        Ok(())
    }

    fn validate_term(&self, term: &SosTerm) -> Result<(), Violation> {
        let Some(basis) = self.bases.get(usize::from(term.basis)) else {
            return Err(Violation::new("basis", term.basis, format!("less than {}", self.bases.len())));
        };
        let n_factors = 2 * self.joints.len() + self.rows.len();
        if let Some(&factor) = term.factors.iter().find(|&&factor| usize::from(factor) >= n_factors) {
            return Err(Violation::new("factors", factor, format!("less than {n_factors}")));
        }
        numbers("gram", &term.gram, basis.len() * (basis.len() + 1) / 2)
    }
}

impl SosJoint {
    fn validate(&self, dim: usize, n_rows: usize) -> Result<(), Violation> {
        if usize::from(self.coordinate) >= dim {
            return Err(Violation::new("coordinate", self.coordinate, format!("less than {dim}")));
        }
        numbers("center", &[self.center], 1)?;
        if !(self.scale > 0.0 && self.scale.is_finite()) {
            return Err(Violation::new("scale", self.scale, "a positive finite number"));
        }
        numbers("lower", &[self.lower], 1)?;
        if !(self.lower < self.upper && self.upper.is_finite()) {
            return Err(Violation::new("upper", self.upper, format!("more than {}", self.lower)));
        }
        multipliers("lower_multipliers", &self.lower_multipliers, n_rows)?;
        multipliers("upper_multipliers", &self.upper_multipliers, n_rows)
    }
}

fn numbers(field: &str, values: &[f64], length: usize) -> Result<(), Violation> {
    crate::validate::vector(field, values, length)
}

fn multipliers(field: &str, multipliers: &[(u32, f64)], n_rows: usize) -> Result<(), Violation> {
    for (i, &(row, mu)) in multipliers.iter().enumerate() {
        if row as usize >= n_rows {
            return Err(Violation::new(format!("{field}[{i}][0]"), row, format!("less than {n_rows}")));
        }
        if !(mu >= 0.0 && mu.is_finite()) {
            return Err(Violation::new(format!("{field}[{i}][1]"), mu, "a finite number, not negative"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proof() -> SosProof {
        SosProof {
            frame: FrameChoice { link: 0, n_dropped_a: 0, n_dropped_b: 0 },
            enclosures: [CoreEnclosure::Core, CoreEnclosure::CylinderInPrism { n_facets: 8, phase: 0.0 }],
            joints: vec![SosJoint {
                coordinate: 1,
                center: 0.0,
                scale: 0.5,
                lower: -0.5,
                upper: 0.5,
                lower_multipliers: vec![(0, 1.0)],
                upper_multipliers: vec![],
            }],
            rows: vec![SosRow { c: vec![1.0], d: 0.5, multipliers: vec![(1, 2.0)] }],
            plane_a: vec![[1.0, 0.0, 0.0]; 2],
            plane_b: vec![0.0; 2],
            bases: vec![vec![vec![0], vec![1]]],
            points_a: vec![vec![SosTerm { factors: vec![2], basis: 0, gram: vec![1.0, 0.0, 1.0] }]],
            points_b: vec![vec![]],
        }
    }

    #[test]
    fn damage_of_each_kind_is_named() {
        assert_eq!(proof().validate(2, 2), Ok(()));
        type Damage = fn(&mut SosProof);
        let cases: [(&str, Damage); 14] = [
            ("joints[0].coordinate", |p| p.joints[0].coordinate = 2),
            ("joints[0].scale", |p| p.joints[0].scale = -1.0),
            ("joints[0].upper", |p| p.joints[0].upper = f64::NAN),
            ("joints[0].lower_multipliers[0][0]", |p| p.joints[0].lower_multipliers[0].0 = 2),
            ("joints[0].lower_multipliers[0][1]", |p| p.joints[0].lower_multipliers[0].1 = -1.0),
            ("joints[1].coordinate", |p| p.joints.push(p.joints[0].clone())),
            ("rows[0].length of c", |p| p.rows[0].c.clear()),
            ("length of plane_a", |p| p.plane_a.truncate(1)),
            ("plane_b[1]", |p| p.plane_b[1] = f64::INFINITY),
            ("length of bases[0][1]", |p| p.bases[0][1].clear()),
            ("bases[0][1]", |p| p.bases[0][1][0] = 200),
            ("points_a[0][0].factors", |p| p.points_a[0][0].factors[0] = 3),
            ("points_a[0][0].length of gram", |p| p.points_a[0][0].gram.truncate(2)),
            ("enclosures: n_facets", |p| {
                p.enclosures[1] = CoreEnclosure::CylinderInPrism { n_facets: 2, phase: 0.0 };
            }),
        ];
        for (field, damage) in cases {
            let mut damaged = proof();
            damage(&mut damaged);
            let violation = damaged.validate(2, 2).expect_err(field);
            assert_eq!(violation.field, field);
        }
    }
}
