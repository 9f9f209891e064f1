//! Finds a sum-of-squares proof for one pair on one region.
//!
//! ```text
//! max γ   s.t.   ±(a(s)·X_v(s) + b(s) D(s)) − (r + clearance/2) D(s) − γ = Σ_t w_t(s) m(s)ᵀ Q_t m(s)   for each point v
//!                ‖a(s)‖ ≤ 1 at the corners of [−1, 1]^k,   γ ≤ γ_max,   Q_t ⪰ 0
//! ```
//!
//! with w_t = 1 ± s_i, and the rows. γ_max lies below what the region's centre allows: where it is reached, the
//! solver ends inside the cone. What comes out is shifted to be positive definite and looked at by
//! [`crate::sums::recheck_sums`]; only that decides. Source: Dai et al. 2023, section IV.

use crate::bounds::coordinate_bounds;
use crate::cell::CellBox;
use crate::rows::Rows;
use crate::sums::pair_sums::{PairSums, SidePolynomials};
use crate::sums::recheck_sums::{factors, recheck_sums};
use crate::sums::tangent_space;
use conic::{Affine, Settings};
use ipc_types::artefact::{CoreEnclosure, SosJoint, SosProof, SosRow, SosTerm};
use sos::{GramBasis, Identity, Polynomial, SosProgram, SosSolution, Term, TermId, least_eigenvalue};

/// A region as sums of squares see it.
pub struct SumsRegion<'a> {
    /// Its rows.
    pub rows: &'a Rows,
    /// Joint limits.
    pub limits: &'a CellBox,
    /// A point inside.
    pub center: &'a [f64],
}

/// How a programme is set up and solved.
#[derive(Debug, Clone)]
pub struct SumsSettings {
    /// Rows beyond the box that a programme uses at most.
    pub max_rows: usize,
    /// Frames that are tried.
    pub max_frames: usize,
    /// For the solver.
    pub solver: Settings,
}

/// γ is not asked to exceed this share of the gap at the centre, nor [`MAX_GAMMA`].
const GAMMA_SHARE: f64 = 0.1;
/// Metres.
const MAX_GAMMA: f64 = 1e-2;
/// Gram matrices are made positive definite by this share of their greatest diagonal entry, and [`SHIFT`].
const RELATIVE_SHIFT: f64 = 1e-11;
/// See [`RELATIVE_SHIFT`].
const SHIFT: f64 = 1e-11;
/// Most corners of the box at which ‖a‖ is bounded one by one.
const MAX_CORNER_VARIABLES: usize = 6;

/// A proof with the plane in one of the frames at these positions, and the frame's; `None` if none was found.
/// `n_solved` counts programmes.
pub fn search_sums(
    pair: &PairSums,
    frames: &[usize],
    region: &SumsRegion<'_>,
    settings: &SumsSettings,
    n_solved: &mut u64,
) -> Option<(usize, SosProof)> {
    let bounds = coordinate_bounds(region.rows, region.limits);
    let joints = tangent_space::joints(&pair.coordinates, &pair.kinds, &bounds, region.limits)?;
    let rows = tangent_space::rows(region.rows, region.limits, &joints, &pair.kinds, settings.max_rows);
    for &frame_idx in frames {
        let enclosures = pair.enclosures(frame_idx, region.center);
        let sides = pair.sides(frame_idx, &enclosures, &joints)?;
        let gap = pair.model.gap(region.center) - pair.model.clearance;
        if !(gap > 0.0) {
            return None;
        }
        let programme = Programme::new(&sides, &joints, &rows, pair.model.clearance, gap);
        *n_solved += 1;
        let Ok(solution) = programme.program.solve(&settings.solver) else { continue };
        let proof = programme.proof(pair, frame_idx, enclosures, joints.clone(), rows.clone(), &solution);
        if recheck_sums(pair, &proof, region.rows, region.limits).is_ok() {
            return Some((frame_idx, proof));
        }
    }
    None
}

struct Programme {
    program: SosProgram,
    k: usize,
    /// For each side and point the terms' Q, one for each factor.
    terms: [Vec<Vec<TermId>>; 2],
    bases: [GramBasis; 2],
}

impl Programme {
    fn new(
        sides: &[SidePolynomials; 2],
        joints: &[SosJoint],
        rows: &[SosRow],
        clearance: f64,
        gap: f64,
    ) -> Self {
        let k = joints.len();
        let n_plane = 4 * (k + 1);
        let gamma = n_plane;
        let mut program = SosProgram::new(n_plane + 1);
        let conic = program.conic_mut();
        conic.add_linear_cost(gamma, -1.0);
        conic.add_less_equal(vec![(gamma, 1.0)], (GAMMA_SHARE * gap).min(MAX_GAMMA));
        bound_norm(conic, 0, k);
        let factors = factors(k, rows);
        let bases = [sides[0].basis(), sides[1].basis()];
        let mut terms = [Vec::new(), Vec::new()];
        for (side_idx, side) in sides.iter().enumerate() {
            let sign = if side_idx == 0 { 1.0 } else { -1.0 };
            for point_idx in 0..side.points.len() {
                let mut slopes: Vec<(usize, Polynomial)> =
                    (0..n_plane).map(|at| (at, side.plane_slope(point_idx, at, k).scaled(sign))).collect();
                slopes.push((gamma, Polynomial::constant(-1.0)));
                // The weight 1 would add nothing: it is the mean of 1 − s_i and 1 + s_i.
                let identity = Identity {
                    constant: side.denominator.scaled(-(side.radius + 0.5 * clearance)),
                    slopes,
                    terms: factors
                        .iter()
                        .map(|weight| Term { weight: weight.clone(), basis: bases[side_idx].clone() })
                        .collect(),
                };
                if k == 0 {
                    // A number: γ is what is left of it.
                    at_least(&mut program, &identity);
                    terms[side_idx].push(Vec::new());
                } else {
                    terms[side_idx].push(program.add_identity(&identity));
                }
            }
        }
        Self { program, k, terms, bases }
    }

    /// What the solver found, as a proof that is yet to be looked at.
    fn proof(
        &self,
        pair: &PairSums,
        frame_idx: usize,
        enclosures: [CoreEnclosure; 2],
        joints: Vec<SosJoint>,
        rows: Vec<SosRow>,
        solution: &SosSolution,
    ) -> SosProof {
        let k = self.k;
        let a = |i: usize| [0, 1, 2].map(|c| solution.unknown(3 * i + c));
        let point = |side: usize, terms: &Vec<TermId>| {
            (0_u16..)
                .zip(terms)
                .map(|(factor, id)| SosTerm {
                    factors: vec![factor],
                    basis: side as u16,
                    gram: shifted(self.bases[side].order(), solution.gram(*id)),
                })
                .collect()
        };
        let exponents = |basis: &GramBasis| basis.monomials().iter().map(|m| m.exponents(k)).collect();
        SosProof {
            frame: pair.frame_choice(frame_idx),
            enclosures,
            joints,
            rows,
            plane_a: (0..=k).map(a).collect(),
            plane_b: (0..=k).map(|i| solution.unknown(3 * (k + 1) + i)).collect(),
            bases: self.bases.iter().map(exponents).collect(),
            points_a: self.terms[0].iter().map(|terms| point(0, terms)).collect(),
            points_b: self.terms[1].iter().map(|terms| point(1, terms)).collect(),
        }
    }
}

/// Left side ≥ 0 for an identity without variables.
fn at_least(program: &mut SosProgram, identity: &Identity) {
    let one = sos::Monomial::ONE;
    let terms = identity.slopes.iter().map(|(unknown, p)| (*unknown, -p.coefficient(one))).collect();
    program.conic_mut().add_less_equal(terms, identity.constant.coefficient(one));
}

/// ‖a(s)‖ ≤ 1 on the box: at its corners, or by the triangle inequality where these are many. The plane's unknowns
/// start at `plane`.
pub fn bound_norm(conic: &mut conic::ConicProgram, plane: usize, k: usize) {
    let one = Affine::new(Vec::new(), 1.0);
    if k <= MAX_CORNER_VARIABLES {
        for corner in 0..1_usize << k {
            let sign = |i: usize| if i == 0 || corner >> (i - 1) & 1 == 1 { 1.0 } else { -1.0 };
            let component =
                |c: usize| Affine::new((0..=k).map(|i| (plane + 3 * i + c, sign(i))).collect(), 0.0);
            conic.add_second_order_cone(one.clone(), (0..3).map(component).collect());
        }
        return;
    }
    let first = conic.add_variables(k + 1);
    for i in 0..=k {
        let parts = (0..3).map(|c| Affine::variable(plane + 3 * i + c)).collect();
        conic.add_second_order_cone(Affine::variable(first + i), parts);
    }
    conic.add_less_equal((0..=k).map(|i| (first + i, 1.0)).collect(), 1.0);
}

/// The matrix with as much added to its diagonal as makes it positive definite.
pub fn shifted(order: usize, mut packed: Vec<f64>) -> Vec<f64> {
    let diagonal = |j: usize| j * (j + 3) / 2;
    let most = (0..order).map(|j| packed[diagonal(j)].abs()).fold(0.0, f64::max);
    let margin = RELATIVE_SHIFT * most + SHIFT;
    let shift = (margin - least_eigenvalue(order, &packed)).max(0.0);
    for j in 0..order {
        packed[diagonal(j)] += shift;
    }
    packed
}
