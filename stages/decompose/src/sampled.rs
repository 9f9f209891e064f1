//! One separation from samples, with the probabilistic test (ε, δ) of Werner et al. 2024: what IRIS-ZO and IRIS-NP2
//! share, and how IRIS-NP ends.
//!
//! Around an ellipsoid, samples of the polytope P that collide are walked to the boundary and cut off, nearest ones
//! first (`placing`), until the *unadaptive test* passes: of M = 2 ln(1/δ_k) / (ε τ²) uniform samples at most (1 - τ) ε M
//! collide, which a region with a share above ε of collisions passes with probability δ_k at most;
//! δ_k = 6 δ / (π k)², so that all tests k = 1, 2, … together err with probability δ.
//!
//! What collides in P lies mostly at its faces, where uniform samples seldom fall. The ends of hit-and-run's chords
//! are on the faces and come for free: they are checked too, and cut as samples are.

use convex_sets::{HPolyhedron, HitAndRun, Hyperellipsoid};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::domain::Domain;
use crate::grower::{Grower, Growth};
use crate::placing::{Boundary, Face, Placing, Search};
use crate::seed::Witness;

/// Relative excess τ of the test.
const TAU: f64 = 0.5;
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
/// Share of the room before the witness by which a moved face goes further, once faces are spent.
const OVERSHOOT: f64 = 0.03;
/// Steps for each dimension by which the walk forgets where it started.
const BURN_IN: usize = 5;
/// A face so near a chord's end is not what the end tests.
const INSET: f64 = 1e-9;
/// A chord's end so near the domain's own faces is not tested.
const DOMAIN_INSET: f64 = 1e-6;
const MAX_PASSES: usize = 150;

/// Separation from samples, with collisions known from earlier ellipsoids: what they cut off need not be found again.
pub(crate) struct SampledGrower {
    search: Search,
    known: Vec<DVector<f64>>,
}

impl SampledGrower {
    pub(crate) fn new(search: Search) -> Self {
        Self { search, known: Vec::new() }
    }
}

impl Grower for SampledGrower {
    fn separate(
        &mut self,
        domain: &Domain<'_>,
        ellipsoid: &Hyperellipsoid,
        witness: &Witness,
        start: HPolyhedron,
        growth: &Growth,
        rng: &mut ChaCha8Rng,
    ) -> HPolyhedron {
        let placing = Placing::new(domain, ellipsoid, witness, growth.margin, self.search);
        let mut separation = Separation::new(domain, placing, witness, start, growth);
        separation.place(&self.known);
        separation.run(rng);
        self.known.extend(separation.faces.iter().map(|face| face.boundary.clone()));
        separation.polyhedron()
    }

    fn is_tested(&self) -> bool {
        true
    }
}

/// `start` with `faces` that part it from collisions already, and further ones until the test (ε, δ) passes.
pub(crate) fn until_tested(
    domain: &Domain<'_>,
    placing: Placing<'_, '_>,
    witness: &Witness,
    (start, faces): (HPolyhedron, Vec<Face>),
    growth: &Growth,
    rng: &mut ChaCha8Rng,
) -> HPolyhedron {
    let mut separation = Separation::new(domain, placing, witness, start, growth);
    for face in faces {
        separation.push(face);
    }
    separation.run(rng);
    separation.polyhedron()
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
    witness: DVector<f64>,
    growth: &'a Growth,
    /// The unit box, then `n_inherited` faces that an earlier separation placed.
    start: HPolyhedron,
    n_inherited: usize,
    /// Where the sides of the unit box are, once faces are spent.
    sides: Vec<f64>,
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
        placing: Placing<'a, 'd>,
        witness: &Witness,
        start: HPolyhedron,
        growth: &'a Growth,
    ) -> Self {
        let k = domain.dim();
        let witness = witness.point();
        let walk = HitAndRun::new(&start, &witness, DMatrix::identity(k, k));
        let n_inherited = start.n_faces().saturating_sub(2 * k);
        let sides = start.b.iter().take(2 * k).copied().collect();
        Self { domain, placing, witness, growth, start, n_inherited, sides, walk, faces: Vec::new() }
    }

    /// Cuts until the test passes, or nothing more can be placed: what is left then is the certifier's.
    fn run(&mut self, rng: &mut ChaCha8Rng) {
        for pass_idx in 1..=MAX_PASSES {
            let pass = self.sample(pass_idx, rng);
            if pass.passed || !self.place(&pass.collisions) {
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
        let mut any_moved = false;
        for boundary in &boundaries {
            let is_cut = |faces: &[Face], u: &DVector<f64>| faces.iter().any(|face| face.a.dot(u) > face.b);
            if is_cut(&self.faces[first_new..], &boundary.collision)
                || any_moved && !self.polyhedron().contains(&boundary.collision, 0.0)
            {
                continue;
            }
            let placing = &self.placing;
            if self.n_inherited + self.faces.len() >= self.growth.max_faces {
                any_moved |= self.move_a_face(boundary);
                continue;
            }
            // A sliver beside a face is that face's; only what is more asks for the search.
            let sliver = placing.shifted(&self.faces, boundary, SLIVER).map(|(_, face)| face);
            let face = sliver.or_else(|| {
                match placing.nearest_face(boundary) {
                    Some(face) if !is_cut(&self.faces, &face.boundary) => Some(face),
                    // The search has slid to what is cut already: the collision itself is still there.
                    _ => {
                        let moved = placing.shifted(&self.faces, boundary, WEDGE);
                        moved.map(|(_, face)| face).or_else(|| placing.face(boundary))
                    }
                }
            });
            if let Some(face) = face {
                self.push(face);
            }
        }
        any_moved || self.faces.len() > first_new
    }

    fn push(&mut self, face: Face) {
        self.walk.push_row(&face.a, face.b);
        self.faces.push(face);
    }

    /// Cuts a collision off without spending a face: of those there are, and of the domain's sides, the one that loses
    /// least moves inwards.
    fn move_a_face(&mut self, boundary: &Boundary) -> bool {
        let k = self.domain.dim();
        let face = |a: DVector<f64>, b: f64| Face { a, b, boundary: boundary.boundary.clone() };
        let mut faces = self.faces.clone();
        let first = self.start.n_faces() - self.n_inherited;
        faces.extend(
            (first..self.start.n_faces()).map(|i| face(self.start.A.row(i).transpose(), self.start.b[i])),
        );
        let n_placed = faces.len();
        faces.extend((0..2 * k).map(|side| face(self.start.A.row(side).transpose(), self.sides[side])));
        let Some((place, mut moved)) = self.placing.shifted(&faces, boundary, 0.0) else { return false };
        // A little more than this collision asks for: many small moves would take as many passes.
        moved.b -= OVERSHOOT * self.placing.room(&moved);
        self.walk.push_row(&moved.a, moved.b);
        if place >= n_placed {
            self.sides[place - n_placed] = moved.b;
        } else if place >= self.faces.len() {
            self.start.b[first + place - self.faces.len()] = moved.b;
        } else {
            self.faces[place] = moved;
        }
        true
    }

    /// The start with all faces, then the domain's sides that have moved.
    fn polyhedron(&self) -> HPolyhedron {
        let k = self.domain.dim();
        let mut rows: Vec<(DVector<f64>, f64)> =
            self.faces.iter().map(|face| (face.a.clone(), face.b)).collect();
        let moved = (0..2 * k).filter(|&side| self.sides[side] < self.start.b[side]);
        rows.extend(moved.map(|side| (self.start.A.row(side).transpose(), self.sides[side])));
        let A = DMatrix::from_fn(rows.len(), k, |i, j| rows[i].0[j]);
        let b = DVector::from_fn(rows.len(), |i, _| rows[i].1);
        self.start.intersection(&HPolyhedron { A, b })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_size_of_werner_2024() {
        let growth =
            Growth { epsilon: 0.01, delta: 0.05, ..Growth::new(&crate::options::Options::default()) };
        // 2 ln(π² / 0.3) / (0.01 · 0.25) = 2794.6.
        assert_eq!(test_size(&growth, 1), (2795, 13));
        assert!(test_size(&growth, 9).0 > 2795);
    }
}
