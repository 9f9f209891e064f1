//! IRIS-ZO: a region around a seed from collision checks alone (Werner et al. 2024).
//!
//! Around an ellipsoid, samples of the polytope P that collide are walked to the boundary and cut off, nearest ones
//! first (`placing`), until the *unadaptive test* passes: of M = 2 ln(1/δ_k) / (ε τ²) uniform samples at most (1 - τ) ε M
//! collide, which a region with a share above ε of collisions passes with probability δ_k at most;
//! δ_k = 6 δ / (π k)², so that all tests k = 1, 2, … together err with probability δ. Then the largest ellipsoid in
//! P takes the place of the first, until it no longer grows.
//!
//! What collides in P lies mostly at its faces, where uniform samples seldom fall. The ends of hit-and-run's chords
//! are on the faces and come for free: they are checked too, and cut as samples are.

use convex_sets::{HPolyhedron, HitAndRun, Hyperellipsoid};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::domain::Domain;
use crate::placing::{Boundary, Face, Placing};

/// Where to grow; all in the domain's units u.
#[derive(Debug, Clone)]
pub(crate) struct Seed {
    /// The first ellipsoid.
    pub(crate) ellipsoid: Hyperellipsoid,
    /// A free point that stays in the region.
    pub(crate) witness: DVector<f64>,
}

/// How to grow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Growth {
    pub(crate) epsilon: f64,
    pub(crate) delta: f64,
    /// Metres of displacement.
    pub(crate) margin: f64,
    pub(crate) max_iterations: usize,
}

/// Relative excess τ of the test.
const TAU: f64 = 0.5;
/// The test's ε before the last separation, in units of the requested one.
const COARSE: f64 = 8.0;
/// The ellipsoid must grow by this factor, or the alternation ends.
const LEAST_GROWTH: f64 = 1.02;
/// Steps of the walk between two samples.
const MIXING_STEPS: usize = 3;
/// Chords of each pass whose ends are checked.
const N_CHORDS: usize = 150;
/// Of their ends so many may collide.
const N_ENDS_ALLOWED: usize = 1;
/// Collisions that end a pass which cannot pass any more: more at once would mostly be cut off by the first faces.
const BATCH: usize = 6;
/// Share of its distance that a face keeps when it is moved to cut a collision off: at once, or as a last resort.
const SLIVER: f64 = 0.995;
const WEDGE: f64 = 0.9;
/// Steps for each dimension by which the walk forgets where it started.
const BURN_IN: usize = 5;
/// A face so near a chord's end is not what the end tests.
const INSET: f64 = 1e-9;
/// A chord's end so near the domain's own faces is not tested.
const DOMAIN_INSET: f64 = 1e-6;
const MAX_PASSES: usize = 150;
const MAX_FACES: usize = 150;

impl Seed {
    /// A ball of half the domain's size around a free point.
    pub(crate) fn ball(witness: DVector<f64>) -> Self {
        Self { ellipsoid: Hyperellipsoid::ball(witness.clone(), 0.5), witness }
    }
}

/// A region that has passed a coarse test only; [`refine`] makes it a region.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    /// In the domain's units; the first 2k faces are the unit box, the others are not redundant.
    pub(crate) polyhedron: HPolyhedron,
    inscribed: Hyperellipsoid,
    witness: DVector<f64>,
}

/// Grows a draft. `None` if the witness is not free or no region with an interior is left.
pub(crate) fn grow(domain: &Domain<'_>, seed: &Seed, growth: &Growth, rng: &mut ChaCha8Rng) -> Option<Draft> {
    if !domain.is_free(&seed.witness) {
        return None;
    }
    let coarse = Growth { epsilon: (COARSE * growth.epsilon).min(0.2), ..*growth };
    let mut ellipsoid = seed.ellipsoid.clone();
    let mut best: Option<(HPolyhedron, Hyperellipsoid)> = None;
    // Collisions known from earlier ellipsoids: what they cut off need not be found again.
    let mut known: Vec<DVector<f64>> = Vec::new();
    for _ in 0..growth.max_iterations.max(1) {
        let mut separation = Separation::new(domain, &ellipsoid, &seed.witness, domain.unit_box(), &coarse);
        separation.place(&known);
        separation.run(rng);
        known.extend(separation.faces.iter().map(|face| face.boundary.clone()));
        let P = separation.polyhedron();
        let Ok(inscribed) = P.max_inscribed_ellipsoid() else { break };
        let last = best.as_ref().map_or(0.0, |(_, last)| last.relative_volume());
        let volume = inscribed.relative_volume();
        if volume > last {
            ellipsoid = inscribed.clone();
            best = Some((P, inscribed));
        }
        if volume < LEAST_GROWTH * last {
            break;
        }
    }
    let (P, inscribed) = best?;
    let polyhedron = P.remove_redundant_keeping(2 * domain.dim()).ok()?;
    Some(Draft { polyhedron, inscribed, witness: seed.witness.clone() })
}

/// The draft with what the requested test finds in it cut off; in the domain's units, first 2k faces the unit box.
pub(crate) fn refine(
    domain: &Domain<'_>,
    draft: &Draft,
    growth: &Growth,
    rng: &mut ChaCha8Rng,
) -> Option<HPolyhedron> {
    let mut separation =
        Separation::new(domain, &draft.inscribed, &draft.witness, draft.polyhedron.clone(), growth);
    separation.run(rng);
    separation.polyhedron().remove_redundant_keeping(2 * domain.dim()).ok()
}

/// Samples M of the `k`-th test, and how many of them may collide.
fn test_size(growth: &Growth, k: usize) -> (usize, usize) {
    let k = k as f64;
    let delta_k = 6.0 * growth.delta / (std::f64::consts::PI * k).powi(2);
    let M = (2.0 * (1.0 / delta_k).ln() / (growth.epsilon * TAU * TAU)).ceil();
    (M as usize, ((1.0 - TAU) * growth.epsilon * M) as usize)
}

/// P with faces that cut its collisions off, one after the other.
struct Separation<'a, 'd> {
    domain: &'a Domain<'d>,
    placing: Placing<'a, 'd>,
    witness: &'a DVector<f64>,
    growth: &'a Growth,
    start: HPolyhedron,
    /// A walk inside P and all faces.
    walk: HitAndRun,
    faces: Vec<Face>,
}

/// What one pass of samples found.
struct Pass {
    collisions: Vec<DVector<f64>>,
    passed: bool,
}

impl<'a, 'd> Separation<'a, 'd> {
    fn new(
        domain: &'a Domain<'d>,
        ellipsoid: &'a Hyperellipsoid,
        witness: &'a DVector<f64>,
        start: HPolyhedron,
        growth: &'a Growth,
    ) -> Self {
        let k = domain.dim();
        let placing = Placing::new(domain, ellipsoid, witness, growth.margin);
        let walk = HitAndRun::new(&start, witness, DMatrix::identity(k, k));
        Self { domain, placing, witness, growth, start, walk, faces: Vec::new() }
    }

    /// Cuts until the test passes, or nothing more can be placed: what is left then is the certifier's.
    fn run(&mut self, rng: &mut ChaCha8Rng) {
        for pass_idx in 1..=MAX_PASSES {
            let pass = self.sample(pass_idx, rng);
            if pass.passed || self.faces.len() >= MAX_FACES || !self.place(&pass.collisions) {
                break;
            }
        }
    }

    /// Uniform samples and chords' ends, until the test passes or cannot pass any more.
    fn sample(&mut self, pass_idx: usize, rng: &mut ChaCha8Rng) -> Pass {
        let k = self.domain.dim();
        let (n_samples, n_allowed) = test_size(self.growth, pass_idx);
        let (mut n_hits, mut n_ends) = (0, 0);
        let mut collisions: Vec<DVector<f64>> = Vec::new();
        self.walk.restart(self.witness.as_slice());
        for _ in 0..BURN_IN * k {
            self.walk.step(rng);
        }
        for drawn in 0..n_samples {
            let failed = n_hits > n_allowed || n_ends > N_ENDS_ALLOWED;
            if failed && (collisions.len() >= BATCH || drawn >= N_CHORDS) {
                return Pass { collisions, passed: false };
            }
            let mut chord = self.walk.step(rng);
            for _ in 1..MIXING_STEPS {
                chord = self.walk.step(rng);
            }
            let u = DVector::from_column_slice(self.walk.point());
            if drawn < N_CHORDS {
                let direction = DVector::from_column_slice(self.walk.direction());
                for t in [chord.t_min, chord.t_max] {
                    let end = &u + (t * (1.0 - INSET)) * &direction;
                    // The domain may begin at contact, as a grasp band does.
                    let on_domain = (0..k).any(|j| end[j].abs() > 1.0 - DOMAIN_INSET);
                    if !on_domain && !self.domain.is_free(&end) {
                        collisions.push(end);
                        n_ends += 1;
                    }
                }
            }
            if !self.domain.is_free(&u) {
                collisions.push(u);
                n_hits += 1;
            }
        }
        Pass { collisions, passed: n_hits <= n_allowed && n_ends <= N_ENDS_ALLOWED }
    }

    /// Faces that cut `collisions` off, nearest first; whether any was placed.
    fn place(&mut self, collisions: &[DVector<f64>]) -> bool {
        let mut boundaries: Vec<Boundary> = collisions.iter().map(|u| self.placing.walk(u)).collect();
        boundaries.sort_by(|p, q| p.distance.total_cmp(&q.distance));
        let first_new = self.faces.len();
        for boundary in &boundaries {
            let is_cut = |faces: &[Face], u: &DVector<f64>| faces.iter().any(|face| face.a.dot(u) > face.b);
            if is_cut(&self.faces[first_new..], &boundary.collision) {
                continue;
            }
            let placing = &self.placing;
            // A sliver beside a face is that face's; only what is more asks for the search.
            let face = placing.shifted(&self.faces, boundary, SLIVER).or_else(|| {
                match placing.nearest_face(boundary) {
                    Some(face) if !is_cut(&self.faces, &face.boundary) => Some(face),
                    // The search has slid to what is cut already: the collision itself is still there.
                    _ => {
                        let moved = placing.shifted(&self.faces, boundary, WEDGE);
                        moved.or_else(|| placing.face(boundary))
                    }
                }
            });
            if let Some(face) = face {
                self.walk.push_row(&face.a, face.b);
                self.faces.push(face);
            }
        }
        self.faces.len() > first_new
    }

    fn polyhedron(&self) -> HPolyhedron {
        let (m, k) = (self.faces.len(), self.domain.dim());
        let A = DMatrix::from_fn(m, k, |i, j| self.faces[i].a[j]);
        let b = DVector::from_fn(m, |i, _| self.faces[i].b);
        self.start.intersection(&HPolyhedron { A, b })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_size_of_werner_2024() {
        let growth = Growth { epsilon: 0.01, delta: 0.05, margin: 1e-6, max_iterations: 1 };
        // 2 ln(π² / 0.3) / (0.01 · 0.25) = 2794.6.
        assert_eq!(test_size(&growth, 1), (2795, 13));
        assert!(test_size(&growth, 9).0 > 2795);
    }
}
