//! Grows a polytope of TC-space about a seed by bilinear alternation (C-IRIS; thesis 1, section 7.2; Dai et al. 2023,
//! Algorithm 2).
//!
//! The polytope is {s ∈ [−1, 1]^k : c_r·s ≤ d_r}, s over all coordinates that some pair depends on. In turn
//!
//! 1. faces fixed: planes and multipliers σ_r of every pair, one programme a pair;
//! 2. the greatest ellipsoid {Q u + e} inside; then the multipliers σ_r fixed: planes, multipliers of the box, and faces,
//!    one programme over all pairs:
//!
//! ```text
//! max Σ_r δ_r   s.t.   ‖Q c_r‖ + c_r·e + δ_r ≤ d_r,  ‖c_r‖ ≤ 1,  δ_r ≥ 0,
//!                      ±(a·X_v + b D) − r D − γ − Σ_r σ_{r,v} (d_r − c_r·s) = Σ_i (1 ± s_i) mᵀ Q m   for each point v
//! ```
//!
//! so every face moves away from the ellipsoid as far as the multipliers allow, and keeps the seed inside. The polytope that comes out is emitted
//! in C-space, inside the preimage, and certified like any other region: nothing here has to be right.

use crate::cell::CellBox;
use crate::sums::pair_sums::{PairSums, SidePolynomials};
use crate::sums::recheck_sums::factors;
use crate::sums::search_sums::{bound_norm, shifted};
use crate::sums::tangent_space::{joints, least_difference, variable};
use conic::{Affine, Settings};
use convex_sets::{HPolyhedron, Hyperrectangle};
use ipc_types::artefact::{SosJoint, SosRow};
use nalgebra::{DMatrix, DVector};
use scene::{CollisionPair, CoordinateKind, Scene};
use sos::{GramBasis, Identity, Monomial, Polynomial, SosProgram, Term, gram_polynomial};
use std::collections::BTreeSet;

/// How long to grow.
#[derive(Debug, Clone)]
pub struct GrowSettings {
    /// Most alternations.
    pub max_iterations: usize,
    /// The margin falls when the ellipsoid's volume grows by less than this share, and it ends when it is least.
    pub least_growth: f64,
    /// γ in the first programme is not asked to exceed this at first, metres. Larger: more for the faces to gain, but multipliers
    /// nearer to the boundary of their cone.
    pub max_margin: f64,
    /// For the solver.
    pub solver: Settings,
}

/// A grown polytope.
#[derive(Debug, Clone)]
pub struct Grown {
    /// In C-space; rows include the joint limits.
    pub polyhedron: HPolyhedron,
    /// A point strictly inside.
    pub center: DVector<f64>,
    /// Volume of the ellipsoid in TC-space after each alternation, relative to that of the unit ball.
    pub ellipsoid_volumes: Vec<f64>,
}

/// Why nothing was grown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GrowError {
    /// The seed.
    #[error("the seed is not free, or so near contact that not even the smallest box about it is certified")]
    Seed,
    /// Outside the limits, or of another dimension.
    #[error("the seed has {found} coordinates within the joint limits, the scene has {expected}")]
    Limits {
        /// Coordinates within their limits.
        found: usize,
        /// Coordinates of the scene.
        expected: usize,
    },
    /// An angle of 2 π.
    #[error(
        "the range of an angle that matters is too wide for tangents of half angles; narrow its joint limits"
    )]
    Range,
}

/// Half-width of the first box about the seed, in units of s, and how often it is halved where it is not certified.
const FIRST_HALF_WIDTH: f64 = 0.3;
/// See [`FIRST_HALF_WIDTH`].
const MAX_HALVINGS: usize = 8;
/// The second programme keeps this share of the margin that the first has found.
const KEPT_MARGIN: f64 = 0.1;
/// A margin that no pair reaches, metres.
const UNBOUNDED_MARGIN: f64 = 1e3;
/// Factor by which the margin falls when growth is slow.
const MARGIN_STEP: f64 = 0.1;
/// Least margin that multipliers are sought for, metres.
const MIN_MARGIN: f64 = 1e-4;
/// Frames that are tried for a pair's plane.
const MAX_FRAMES: usize = 2;
/// Faces keep this far from the points to keep, in units of s.
const ROOM_KEPT: f64 = 1e-5;
/// How often, and to which share of its width each time, the region is narrowed about the points to keep where its
/// faces in C-space would cut them off.
const MAX_NARROWINGS: i32 = 12;
/// See [`MAX_NARROWINGS`].
const NARROWING: f64 = 0.7;
/// Points may be on a bound of a coordinate up to this, radians or metres: rounding of tangents.
const TOL_ON_BOUND: f64 = 1e-9;

/// The pairs of a scene over all coordinates that matter.
#[derive(Debug, Clone)]
pub struct Grower {
    pairs: Vec<PairSums>,
    sides: Vec<[SidePolynomials; 2]>,
    joints: Vec<SosJoint>,
    kinds: Vec<CoordinateKind>,
    limits: CellBox,
    settings: GrowSettings,
}

/// For each side and point a polynomial a face.
type PairMultipliers = [Vec<Vec<Polynomial>>; 2];

/// Multipliers of the faces: for each pair, side and point one Gram polynomial a face; and the margin γ.
struct Multipliers {
    polynomials: Vec<PairMultipliers>,
    gammas: Vec<f64>,
}

impl Grower {
    /// All pairs of `scene`, each with the distance that `clearance` asks of it, about `seed`.
    pub fn new(
        scene: &Scene,
        clearance: impl Fn(CollisionPair) -> f64,
        seed: &[f64],
        settings: GrowSettings,
    ) -> Result<Self, GrowError> {
        let limits = Hyperrectangle { lower: scene.lower(), upper: scene.upper() };
        Self::within(scene, clearance, &limits, seed, settings)
    }

    /// As [`Grower::new`], within a part `bounds` of the joint box.
    pub fn within(
        scene: &Scene,
        clearance: impl Fn(CollisionPair) -> f64,
        bounds: &Hyperrectangle,
        seed: &[f64],
        settings: GrowSettings,
    ) -> Result<Self, GrowError> {
        let limits = CellBox {
            lower: bounds.lower.iter().copied().collect(),
            upper: bounds.upper.iter().copied().collect(),
        };
        let inside = |j: usize| limits.lower[j] <= seed[j] && seed[j] <= limits.upper[j];
        let found = (0..seed.len().min(scene.dim())).filter(|&j| inside(j)).count();
        if found != scene.dim() || seed.len() != scene.dim() {
            return Err(GrowError::Limits { found, expected: scene.dim() });
        }
        let pairs: Vec<PairSums> = scene
            .collision_pairs()
            .into_iter()
            .map(|pair| PairSums::new(scene, pair, clearance(pair)))
            .filter(|pair| !pair.coordinates.is_empty())
            .collect();
        let all: BTreeSet<usize> = pairs.iter().flat_map(|pair| pair.coordinates.iter().copied()).collect();
        let coordinates: Vec<usize> = all.into_iter().collect();
        let kinds: Vec<CoordinateKind> = coordinates.iter().map(|&j| scene.coordinates[j].kind).collect();
        let bounds = vec![[None, None]; scene.dim()];
        let joints = joints(&coordinates, &kinds, &bounds, &limits).ok_or(GrowError::Range)?;
        let pairs: Vec<PairSums> = pairs.into_iter().map(|pair| pair.over(&coordinates, &kinds)).collect();
        let mut grower = Self { pairs, sides: Vec::new(), joints, kinds, limits, settings };
        let s_seed = grower.s_of(seed);
        let mut sides = Vec::with_capacity(grower.pairs.len());
        for pair in &grower.pairs {
            let sides_in = |frame: usize| pair.sides(frame, &pair.enclosures(frame, seed), &grower.joints);
            let frames = pair.frame_order();
            let mut candidates: Vec<[SidePolynomials; 2]> =
                frames.into_iter().take(MAX_FRAMES).filter_map(sides_in).collect();
            // The frame that leaves the greatest margin on the largest box about the seed that has a plane in any.
            let best_on = |halving: usize| {
                let half = FIRST_HALF_WIDTH * 0.5_f64.powi(halving as i32);
                let rows = first_rows(std::slice::from_ref(&s_seed), half);
                let margin = |sides| Some(grower.pair_multipliers(pair, sides, &rows, UNBOUNDED_MARGIN)?.1);
                let margins =
                    candidates.iter().enumerate().filter_map(|(at, sides)| Some((margin(sides)?, at)));
                margins.max_by(|x, y| x.0.total_cmp(&y.0).then(y.1.cmp(&x.1))).map(|(_, at)| at)
            };
            let chosen = (0..MAX_HALVINGS).find_map(best_on).ok_or(GrowError::Seed)?;
            sides.push(candidates.swap_remove(chosen));
        }
        grower.sides = sides;
        Ok(grower)
    }

    /// s of a configuration.
    fn s_of(&self, q: &[f64]) -> Vec<f64> {
        let variables = self.joints.iter().zip(&self.kinds);
        variables
            .map(|(joint, kind)| variable(joint, *kind).s_from_q(q[usize::from(joint.coordinate)]))
            .collect()
    }

    /// Grows from `seed`.
    pub fn grow(&self, seed: &[f64]) -> Result<Grown, GrowError> {
        self.grow_about(&[seed])
    }

    /// Grows about the hull of `points`, which stays inside.
    pub fn grow_about(&self, points: &[&[f64]]) -> Result<Grown, GrowError> {
        let kept: Vec<Vec<f64>> = points.iter().map(|q| self.s_of(q)).collect();
        let mut margin = self.settings.max_margin;
        let mut half = FIRST_HALF_WIDTH;
        let mut rows = first_rows(&kept, half);
        let mut multipliers = None;
        for _ in 0..MAX_HALVINGS {
            multipliers = self.multipliers(&rows, margin);
            if multipliers.is_some() {
                break;
            }
            half *= 0.5;
            rows = first_rows(&kept, half);
        }
        let mut multipliers = multipliers.ok_or(GrowError::Seed)?;
        let mut volumes = Vec::new();
        for _ in 0..self.settings.max_iterations {
            let Some((Q, center, volume)) = self.ellipsoid(&rows) else { break };
            let is_slow =
                volumes.last().is_some_and(|last| volume < last * (1.0 + self.settings.least_growth));
            volumes.push(volume);
            if is_slow {
                // Multipliers for a smaller margin lie elsewhere, and may let faces move that are stuck.
                margin *= MARGIN_STEP;
                if margin < MIN_MARGIN {
                    break;
                }
                let Some(other) = self.multipliers(&rows, margin) else { break };
                multipliers = other;
            }
            let Some(moved) = self.faces(&rows, &multipliers, (&Q, &center), &kept) else { break };
            // Faces that cannot be certified again are not taken.
            let Some(next) = self.multipliers(&moved, margin) else { break };
            (rows, multipliers) = (moved, next);
        }
        if let Some((_, _, volume)) = self.ellipsoid(&rows) {
            volumes.push(volume);
        }
        let polyhedron = self.in_configuration_space(&rows, points).ok_or(GrowError::Seed)?;
        let ball = polyhedron.interior_point().map_err(|_| GrowError::Seed)?;
        Ok(Grown { center: ball.center, polyhedron, ellipsoid_volumes: volumes })
    }

    /// Step 1.
    fn multipliers(&self, rows: &[SosRow], max_margin: f64) -> Option<Multipliers> {
        let mut found = Multipliers { polynomials: Vec::new(), gammas: Vec::new() };
        for (pair, sides) in self.pairs.iter().zip(&self.sides) {
            let (polynomials, gamma) = self.pair_multipliers(pair, sides, rows, max_margin)?;
            found.polynomials.push(polynomials);
            found.gammas.push(gamma);
        }
        Some(found)
    }

    /// Step 1 for one pair: for each side and point a polynomial a face, and γ.
    fn pair_multipliers(
        &self,
        pair: &PairSums,
        sides: &[SidePolynomials; 2],
        rows: &[SosRow],
        max_margin: f64,
    ) -> Option<(PairMultipliers, f64)> {
        let k = self.joints.len();
        let factors = factors(k, rows);
        let (mut program, gamma) = plane_programme(k);
        program.conic_mut().add_linear_cost(gamma, -1.0);
        program.conic_mut().add_less_equal(vec![(gamma, 1.0)], max_margin);
        let mut ids = Vec::new();
        for (side_idx, side) in sides.iter().enumerate() {
            let terms: Vec<Term> =
                factors.iter().map(|w| Term { weight: w.clone(), basis: side.basis() }).collect();
            for point_idx in 0..side.points.len() {
                let mut identity = claim(pair, side, side_idx, point_idx, k, 0);
                identity.slopes.push((gamma, Polynomial::constant(-1.0)));
                identity.terms.clone_from(&terms);
                ids.push((side_idx, program.add_identity(&identity)));
            }
        }
        let solution = program.solve(&self.settings.solver).ok()?;
        if !(solution.status.has_solution() && solution.unknown(gamma) > MIN_GAMMA) {
            return None;
        }
        let mut polynomials = [Vec::new(), Vec::new()];
        for (side_idx, terms) in ids {
            let basis: GramBasis = sides[side_idx].basis();
            let of_faces = terms[2 * k..]
                .iter()
                .map(|id| gram_polynomial(&basis, &shifted(basis.order(), solution.gram(*id))));
            polynomials[side_idx].push(of_faces.collect());
        }
        Some((polynomials, solution.unknown(gamma)))
    }

    /// Step 2, about the ellipsoid {Q u + center}; the points `kept` stay inside.
    fn faces(
        &self,
        rows: &[SosRow],
        multipliers: &Multipliers,
        (Q, center): (&DMatrix<f64>, &DVector<f64>),
        kept: &[Vec<f64>],
    ) -> Option<Vec<SosRow>> {
        let (k, m) = (self.joints.len(), rows.len());
        // Unknowns: for each face c [k], d, δ; then the planes of each pair.
        let width = k + 2;
        let (c, d, delta) = (|r: usize, j: usize| r * width + j, |r| r * width + k, |r| r * width + k + 1);
        let mut program = SosProgram::new(m * width);
        let conic = program.conic_mut();
        for r in 0..m {
            conic.add_linear_cost(delta(r), -1.0);
            conic.add_less_equal(vec![(delta(r), -1.0)], 0.0);
            conic.add_less_equal(vec![(d(r), 1.0)], (k as f64).sqrt());
            let one = Affine::new(Vec::new(), 1.0);
            conic.add_second_order_cone(one, (0..k).map(|j| Affine::variable(c(r, j))).collect());
            for s in kept {
                let mut terms: Vec<(usize, f64)> = (0..k).map(|j| (c(r, j), s[j])).collect();
                terms.push((d(r), -1.0));
                conic.add_less_equal(terms, -ROOM_KEPT);
            }
            let mut head = vec![(d(r), 1.0), (delta(r), -1.0)];
            head.extend((0..k).map(|j| (c(r, j), -center[j])));
            let part = |i: usize| Affine::new((0..k).map(|j| (c(r, j), Q[(i, j)])).collect(), 0.0);
            conic.add_second_order_cone(Affine::new(head, 0.0), (0..k).map(part).collect());
        }
        let box_factors = factors(k, &[]);
        for (pair_idx, (pair, sides)) in self.pairs.iter().zip(&self.sides).enumerate() {
            let plane = program.conic_mut().add_variables(4 * (k + 1));
            bound_norm(program.conic_mut(), plane, k);
            for (side_idx, side) in sides.iter().enumerate() {
                let terms: Vec<Term> =
                    box_factors.iter().map(|w| Term { weight: w.clone(), basis: side.basis() }).collect();
                for point_idx in 0..side.points.len() {
                    let mut identity = claim(pair, side, side_idx, point_idx, k, plane);
                    let margin = KEPT_MARGIN * multipliers.gammas[pair_idx];
                    identity.constant.add_term(Monomial::ONE, -margin);
                    for (r, sigma) in
                        multipliers.polynomials[pair_idx][side_idx][point_idx].iter().enumerate()
                    {
                        identity.slopes.push((d(r), sigma.scaled(-1.0)));
                        for j in 0..k {
                            let s = Polynomial::term(Monomial::variable(j), 1.0);
                            identity.slopes.push((c(r, j), sigma.times(&s)));
                        }
                    }
                    identity.terms.clone_from(&terms);
                    program.add_identity(&identity);
                }
            }
        }
        let solution = program.solve(&self.settings.solver).ok()?;
        if !solution.status.has_solution() {
            return None;
        }
        let row = |r: usize| SosRow {
            c: (0..k).map(|j| solution.unknown(c(r, j))).collect(),
            d: solution.unknown(d(r)),
            multipliers: Vec::new(),
        };
        Some((0..m).map(row).collect())
    }

    /// The greatest ellipsoid {Q u + e} in the polytope: Q, e and its volume.
    fn ellipsoid(&self, rows: &[SosRow]) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
        let k = self.joints.len();
        let ellipsoid = polytope(k, rows).max_inscribed_ellipsoid().ok()?;
        Some((ellipsoid.image_of_ball()?, ellipsoid.center.clone(), ellipsoid.relative_volume()))
    }

    /// A polytope of C-space whose image lies in the one of TC-space, with `points` strictly inside; `None` if they
    /// are not, however near to them it stays.
    fn in_configuration_space(&self, rows: &[SosRow], points: &[&[f64]]) -> Option<HPolyhedron> {
        let n = self.limits.lower.len();
        // The nearer the range of the coordinates to the points, the less is lost beside them.
        let polyhedron = (0..MAX_NARROWINGS).find_map(|narrowing| {
            let polyhedron = self.preimage(rows, points, NARROWING.powi(narrowing));
            let is_inside = |q: &&[f64]| {
                let slack = &polyhedron.b - &polyhedron.A * DVector::from_column_slice(q);
                // Bounds of the joints may be touched.
                slack
                    .iter()
                    .enumerate()
                    .all(|(face_idx, slack)| *slack > if face_idx < 2 * n { -TOL_ON_BOUND } else { 0.0 })
            };
            points.iter().all(is_inside).then_some(polyhedron)
        })?;
        Some(polyhedron.remove_redundant_keeping(2 * n).unwrap_or(polyhedron))
    }

    /// The coordinates that matter within their bounds, drawn together about `points` to this `share`, all others within
    /// their limits, and for each face c_j s_j(q) ≤ β_j q − min (β_j q − c_j s_j(q)).
    fn preimage(&self, rows: &[SosRow], points: &[&[f64]], share: f64) -> HPolyhedron {
        let n = self.limits.lower.len();
        let (mut lower, mut upper) = (self.limits.lower.clone(), self.limits.upper.clone());
        let bounds = polytope(self.joints.len(), rows).bounding_box().ok();
        let mut within = self.joints.clone();
        for (i, (joint, kind)) in within.iter_mut().zip(&self.kinds).enumerate() {
            let v = variable(joint, *kind);
            if let Some(bounds) = &bounds {
                joint.lower = v.q_from_s(bounds.lower[i]).max(joint.lower);
                joint.upper = v.q_from_s(bounds.upper[i]).min(joint.upper);
            }
            let j = usize::from(joint.coordinate);
            let least = points.iter().map(|q| q[j]).fold(f64::INFINITY, f64::min);
            let most = points.iter().map(|q| q[j]).fold(f64::NEG_INFINITY, f64::max);
            joint.lower = joint.lower.max(least - share * (least - joint.lower));
            joint.upper = joint.upper.min(most + share * (joint.upper - most));
            (lower[j], upper[j]) = (joint.lower, joint.upper);
        }
        let around = HPolyhedron::from_box(&DVector::from_vec(lower), &DVector::from_vec(upper));
        let mut A = around.A.clone();
        let mut b: Vec<f64> = around.b.iter().copied().collect();
        for row in rows {
            let mut a = DVector::zeros(n);
            let mut offset = row.d;
            for (i, (joint, kind)) in within.iter().zip(&self.kinds).enumerate() {
                let v = variable(joint, *kind);
                let beta = row.c[i] * (v.s_from_q(joint.upper) - v.s_from_q(joint.lower))
                    / (joint.upper - joint.lower);
                a[usize::from(joint.coordinate)] = beta;
                offset += least_difference(beta, row.c[i], joint, *kind);
            }
            let norm = a.norm();
            if norm > 1e-9 {
                A = A.insert_row(b.len(), 0.0);
                A.set_row(b.len(), &(a / norm).transpose());
                b.push(offset / norm);
            }
        }
        HPolyhedron { A, b: DVector::from_vec(b) }
    }
}

/// Below this margin a polytope does not count as certified, metres.
const MIN_GAMMA: f64 = 1e-7;

/// A programme whose first unknowns are a plane's coefficients, and γ.
fn plane_programme(k: usize) -> (SosProgram, usize) {
    let gamma = 4 * (k + 1);
    let mut program = SosProgram::new(gamma + 1);
    bound_norm(program.conic_mut(), 0, k);
    (program, gamma)
}

/// The left side for a point, without γ: the plane's unknowns start at `plane`.
fn claim(
    pair: &PairSums,
    side: &SidePolynomials,
    side_idx: usize,
    point_idx: usize,
    k: usize,
    plane: usize,
) -> Identity {
    let sign = if side_idx == 0 { 1.0 } else { -1.0 };
    let slope = |at: usize| (plane + at, side.plane_slope(point_idx, at, k).scaled(sign));
    Identity {
        constant: side.denominator.scaled(-(side.radius + 0.5 * pair.model.clearance)),
        slopes: (0..4 * (k + 1)).map(slope).collect(),
        terms: Vec::new(),
    }
}

/// The rows with the box.
fn polytope(k: usize, rows: &[SosRow]) -> HPolyhedron {
    let unit = HPolyhedron::from_box(&DVector::from_element(k, -1.0), &DVector::from_element(k, 1.0));
    let A = DMatrix::from_fn(2 * k + rows.len(), k, |r, j| match r.checked_sub(2 * k) {
        Some(r) => rows[r].c[j],
        None => unit.A[(r, j)],
    });
    let b = DVector::from_fn(2 * k + rows.len(), |r, _| match r.checked_sub(2 * k) {
        Some(r) => rows[r].d,
        None => unit.b[r],
    });
    HPolyhedron { A, b }
}

/// Faces at the distance `half` from the hull of `points` in the directions of the axes and, for k > 1, of the corners.
fn first_rows(points: &[Vec<f64>], half: f64) -> Vec<SosRow> {
    let k = points.first().map_or(0, Vec::len);
    let mut directions: Vec<Vec<f64>> = Vec::new();
    for i in 0..k {
        for sign in [1.0, -1.0] {
            directions.push((0..k).map(|j| if i == j { sign } else { 0.0 }).collect());
        }
    }
    if (2..=MAX_CORNER_DIRECTIONS).contains(&k) {
        let length = 1.0 / (k as f64).sqrt();
        for corner in 0..1_usize << k {
            directions.push((0..k).map(|j| if corner >> j & 1 == 1 { length } else { -length }).collect());
        }
    }
    let reach = |c: &[f64], s: &[f64]| c.iter().zip(s).map(|(c, s)| c * s).sum::<f64>();
    directions
        .into_iter()
        .map(|c| SosRow {
            d: points.iter().map(|s| reach(&c, s)).fold(f64::NEG_INFINITY, f64::max) + half,
            c,
            multipliers: Vec::new(),
        })
        .collect()
}

/// Above this many variables the corners are too many to be faces.
const MAX_CORNER_DIRECTIONS: usize = 4;
