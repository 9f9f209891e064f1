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
const COARSE: f64 = 4.0;
/// The ellipsoid must grow by this factor, or the alternation ends.
const LEAST_GROWTH: f64 = 1.02;
/// Steps of the walk between two samples.
const MIXING_STEPS: usize = 3;
/// Chords of each pass whose ends are checked.
const N_CHORDS: usize = 150;
/// Collisions that end a pass: more at once would mostly be cut off by the first ones' faces.
const BATCH: usize = 6;
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
    for _ in 0..growth.max_iterations.max(1) {
        let P = separate(domain, &ellipsoid, &seed.witness, domain.unit_box(), &coarse, rng);
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
    let P = separate(domain, &draft.inscribed, &draft.witness, draft.polyhedron.clone(), growth, rng);
    P.remove_redundant_keeping(2 * domain.dim()).ok()
}

/// Samples M of the `k`-th test, and how many of them may collide.
fn test_size(growth: &Growth, k: usize) -> (usize, usize) {
    let k = k as f64;
    let delta_k = 6.0 * growth.delta / (std::f64::consts::PI * k).powi(2);
    let M = (2.0 * (1.0 / delta_k).ln() / (growth.epsilon * TAU * TAU)).ceil();
    (M as usize, ((1.0 - TAU) * growth.epsilon * M) as usize)
}

/// P with faces that cut off its collisions until the test passes.
fn separate(
    domain: &Domain<'_>,
    ellipsoid: &Hyperellipsoid,
    witness: &DVector<f64>,
    P: HPolyhedron,
    growth: &Growth,
    rng: &mut ChaCha8Rng,
) -> HPolyhedron {
    let k = domain.dim();
    let placing = Placing::new(domain, ellipsoid, witness, growth.margin);
    let mut walk = HitAndRun::new(&P, witness, DMatrix::identity(k, k));
    let mut added: Vec<Face> = Vec::new();
    for pass in 1..=MAX_PASSES {
        let (n_samples, n_allowed) = test_size(growth, pass);
        let (mut drawn, mut n_hits, mut n_ends) = (0, 0, 0);
        let mut collisions: Vec<DVector<f64>> = Vec::new();
        while drawn < n_samples && collisions.len() < BATCH.max(n_allowed + 1) {
            drawn += 1;
            let mut chord = walk.step(rng);
            for _ in 1..MIXING_STEPS {
                chord = walk.step(rng);
            }
            let u = DVector::from_column_slice(walk.point());
            if drawn <= N_CHORDS {
                let direction = DVector::from_column_slice(walk.direction());
                for t in [chord.t_min, chord.t_max] {
                    let end = &u + (t * (1.0 - INSET)) * &direction;
                    if (0..k).any(|j| end[j].abs() > 1.0 - DOMAIN_INSET) {
                        // The domain may begin at contact, as a grasp band does.
                        continue;
                    }
                    if !domain.is_free(&end) {
                        collisions.push(end);
                        n_ends += 1;
                    }
                }
            }
            if !domain.is_free(&u) {
                collisions.push(u);
                n_hits += 1;
            }
        }
        let passed = drawn == n_samples && n_hits <= n_allowed && n_ends <= N_CHORDS / 100;
        if passed || added.len() >= MAX_FACES {
            break;
        }
        let mut boundaries: Vec<Boundary> = collisions.iter().map(|u| placing.walk(u)).collect();
        boundaries.sort_by(|p, q| p.distance.total_cmp(&q.distance));
        let first_new = added.len();
        for boundary in &boundaries {
            let is_cut = |new: &[Face], u: &DVector<f64>| new.iter().any(|face| face.a.dot(u) > face.b);
            if is_cut(&added[first_new..], &boundary.collision) {
                continue;
            }
            let nearest = placing.nearest_face(boundary);
            let face = match nearest {
                // The search has slid to what is cut already: the collision itself is still there.
                Some(face) if !is_cut(&added, &face.boundary) => Some(face),
                _ => placing.face(boundary),
            };
            if let Some(face) = face {
                walk.push_row(&face.a, face.b);
                added.push(face);
            }
        }
        if added.len() == first_new {
            // Nothing can be placed: what is left is the certifier's.
            break;
        }
        if !walk.is_inside() {
            walk.restart(witness.as_slice());
            for _ in 0..4 * k {
                walk.step(rng);
            }
        }
    }
    let A = DMatrix::from_fn(added.len(), k, |i, j| added[i].a[j]);
    let b = DVector::from_fn(added.len(), |i, _| added[i].b);
    P.intersection(&HPolyhedron { A, b })
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
