//! Regions of an earlier run, in a scene that has changed: what is still free is kept as it is, so that certificates
//! can be verified instead of found again; what collides is cut; what is uncovered then grows.

use convex_sets::{HPolyhedron, HitAndRun, Hyperellipsoid};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use wire::Region;

use super::{Cover, Decomposition, Sink, decompose};
use crate::coordinates::Coordinates;
use crate::grower::cut;
use crate::options::Options;
use crate::problem::Problem;
use crate::seed::Seed;

/// What became of the earlier regions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Kept {
    /// Regions that are still free.
    pub n_free: usize,
    /// Regions of which a part is still free, and was cut from the rest.
    pub n_cut: usize,
    /// Regions of which nothing is left.
    pub n_lost: usize,
}

/// Points by which an earlier region is judged. Collisions that they miss are the certifier's.
const N_TEST_POINTS: usize = 150;
/// Steps of the walk between two of them, and before the first, for each dimension.
const MIXING_STEPS: usize = 2;
const BURN_IN: usize = 5;
/// A chord's end is tested this far inside, as a share of the chord.
const INSET: f64 = 1e-9;
/// ε with which regions are cut and grown, in units of the requested one: little is new, and the certifier cuts the rest.
const COARSE: f64 = 10.0;
const MAX_EPSILON: f64 = 0.2;
/// Of its free test points, what a region must keep when it is cut: else what grows in its place covers more.
const LEAST_KEPT: f64 = 0.5;
/// So many times what candidates may leave out may stay uncovered: those that were certified lose less to certification.
const SLACK: f64 = 1.25;
/// Alternations of a region: where it is to grow is known, and most of what is around it is covered.
const MAX_ITERATIONS: usize = 1;
/// Cliques that are grown in a round, samples of their graph, and of an estimate: less is missing than at first.
const MAX_CLIQUES: usize = 5;
const MAX_VISIBLE: usize = 40;
const MAX_COVERAGE_SAMPLES: usize = 2000;

/// As [`decompose`], but starts from regions of an earlier run, whose scene may have been another one with the same
/// coordinates. Ids count from 0 again. Candidates leave out up to a quarter more than those of [`decompose`].
pub fn extend<S: Sink>(
    problem: &Problem<'_>,
    earlier: &[Region],
    options: &Options,
    seed: u64,
    sink: &mut S,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<(Decomposition, Kept), S::Error> {
    let coordinates = Coordinates::new(problem.limits.clone(), &problem.relevant);
    if coordinates.n_relevant() == 0 {
        return Ok((decompose(problem, options, seed, sink, is_stopped)?, Kept::default()));
    }
    let aim = |coverage: f64| (1.0 - SLACK * (1.0 - coverage)).max(0.0);
    let options = Options {
        coverage: aim(options.coverage),
        grasp_coverage: aim(options.grasp_coverage),
        chord_coverage: options.chord_coverage.min(options.certified_chord_coverage),
        epsilon: (COARSE * options.epsilon).min(MAX_EPSILON).max(options.epsilon),
        max_iterations: options.max_iterations.min(MAX_ITERATIONS),
        visibility_samples: options.visibility_samples.min(MAX_VISIBLE),
        coverage_samples: options.coverage_samples.min(MAX_COVERAGE_SAMPLES),
        ..options.clone()
    };
    let mut cover = Cover::new(problem, &options, seed, &coordinates, sink, is_stopped);
    cover.max_cliques = MAX_CLIQUES;
    cover.headroom = 1.0;
    cover.is_thrifty = true;
    let kept = cover.take_over(earlier);
    let ending = cover.run()?;
    Ok((cover.finish(ending)?, kept))
}

impl<S: Sink> Cover<'_, S> {
    /// Takes in what is free of `earlier`: first what is free as it is, which stays, then what was cut.
    fn take_over(&mut self, earlier: &[Region]) -> Kept {
        let mut kept = Kept::default();
        let (mut whole, mut cut) = (Vec::new(), Vec::new());
        for region in earlier {
            if (self.is_stopped)() {
                break;
            }
            let mut rng = self.streams.take();
            let P = with_limits(&region.polyhedron, &self.problem.limits.to_polyhedron());
            let part = self.shadow(&P).map(|shadow| self.free_part(&shadow, &region.center, &mut rng));
            let (polyhedron, taken) = match part.unwrap_or(Part::Nothing) {
                Part::All => (P, &mut whole),
                Part::Cut(faces) => (P.intersection(&faces), &mut cut),
                Part::Nothing => {
                    kept.n_lost += 1;
                    continue;
                }
            };
            let center = Some(region.center.clone()).filter(|center| is_strictly_inside(&polyhedron, center));
            let center = center.or_else(|| Some(polyhedron.interior_point().ok()?.center));
            let Some(center) = center.filter(|center| is_strictly_inside(&polyhedron, center)) else {
                kept.n_lost += 1;
                continue;
            };
            let margin = self.options.configuration_margin;
            let method = region.method.clone();
            taken.push(Region { id: 0, parent: None, polyhedron, center, method, certified: false, margin });
        }
        (kept.n_free, kept.n_cut) = (whole.len(), cut.len());
        for (id, region) in (0..).zip(whole.into_iter().chain(cut)) {
            self.covering.push(region.polyhedron.clone());
            self.regions.push(Region { id, ..region });
        }
        self.n_to_stay = kept.n_free;
        kept
    }

    /// The part of a region that is free, by samples. `shadow`: the region in the relevant coordinates x.
    fn free_part(&self, shadow: &HPolyhedron, center: &DVector<f64>, rng: &mut ChaCha8Rng) -> Part {
        let (mid, half) = (self.whole.bounds.center(), self.whole.bounds.half_widths());
        let k = half.len();
        let start = Some(self.coordinates.project(center.as_slice()));
        let start = start.filter(|x| is_strictly_inside(shadow, x));
        let Some(start) = start.or_else(|| Some(shadow.interior_point().ok()?.center)) else {
            return Part::Nothing;
        };
        let is_free = |x: &DVector<f64>| self.problem.free.is_free(&self.coordinates.lift(x.as_slice()));
        let mut walk = HitAndRun::new(shadow, &start, DMatrix::from_diagonal(&half));
        for _ in 0..BURN_IN * k {
            walk.step(rng);
        }
        let mut free_points = vec![start];
        free_points.retain(is_free);
        let mut collides = free_points.is_empty();
        for _ in 0..N_TEST_POINTS {
            for _ in 1..MIXING_STEPS {
                walk.step(rng);
            }
            let chord = walk.step(rng);
            let point = DVector::from_column_slice(walk.point());
            let direction = DVector::from_column_slice(walk.direction());
            let ends = [chord.t_min, chord.t_max].map(|t| &point + (t * (1.0 - INSET)) * &direction);
            collides |= ends.iter().any(|x| !is_free(x));
            if is_free(&point) {
                free_points.push(point);
            } else {
                collides = true;
            }
        }
        if !collides {
            return Part::All;
        }
        // In the domain's units, where a face (a, b) of x is a·diag(half) u ≤ b - a·mid.
        let units = HPolyhedron {
            A: DMatrix::from_fn(shadow.n_faces(), k, |i, j| shadow.A[(i, j)] * half[j]),
            b: &shadow.b - &shadow.A * &mid,
        };
        let Ok(ellipsoid) = units.max_inscribed_ellipsoid() else { return Part::Nothing };
        let middle = Some(ellipsoid.center.clone()).filter(|u| self.whole.is_free(u));
        let nearest = || {
            let points = free_points.iter().map(|x| self.whole.u_from_x(x));
            points.min_by(|u, v| ellipsoid.distance(u).total_cmp(&ellipsoid.distance(v)))
        };
        let Some(witness) = middle.or_else(nearest) else { return Part::Nothing };
        let seed = Seed::new(Hyperellipsoid { A: ellipsoid.A.clone(), center: witness.clone() }, witness);
        let start = self.whole.unit_box().intersection(&units);
        let Some(P) = cut(&self.whole, &start, &seed, &self.growing.growth, rng) else {
            return Part::Nothing;
        };
        let n_kept = free_points.iter().filter(|x| P.contains(&self.whole.u_from_x(x), 0.0)).count();
        if (n_kept as f64) < LEAST_KEPT * free_points.len() as f64 {
            return Part::Nothing;
        }
        let new: Vec<usize> = (start.n_faces()..P.n_faces()).collect();
        let columns = &self.coordinates.relevant;
        let mut A = DMatrix::zeros(new.len(), self.coordinates.dim());
        let mut b = DVector::zeros(new.len());
        for (row, &face_idx) in new.iter().enumerate() {
            let a = P.A.row(face_idx).transpose().component_div(&half);
            let norm = a.norm();
            b[row] = (P.b[face_idx] + a.dot(&mid)) / norm;
            for (column, &j) in columns.iter().enumerate() {
                A[(row, j)] = a[column] / norm;
            }
        }
        Part::Cut(HPolyhedron { A, b })
    }

    /// The region in the relevant coordinates; `None` if a face other than a joint limit depends on another one.
    fn shadow(&self, P: &HPolyhedron) -> Option<HPolyhedron> {
        let is_relevant = &self.problem.relevant;
        let mut rows = Vec::with_capacity(P.n_faces());
        for face_idx in 0..P.n_faces() {
            let row = P.A.row(face_idx);
            let moving = (0..row.len()).filter(|&j| row[j] != 0.0);
            let (relevant, other): (Vec<usize>, Vec<usize>) = moving.partition(|&j| is_relevant[j]);
            match (relevant.is_empty(), other.len()) {
                (_, 0) => rows.push(face_idx),
                (true, 1) => {}
                _ => return None,
            }
        }
        let columns = &self.coordinates.relevant;
        Some(HPolyhedron {
            A: DMatrix::from_fn(rows.len(), columns.len(), |i, j| P.A[(rows[i], columns[j])]),
            b: DVector::from_fn(rows.len(), |i, _| P.b[rows[i]]),
        })
    }
}

/// What is free of an earlier region.
enum Part {
    /// No collision was found in it.
    All,
    /// What lies inside these faces too.
    Cut(HPolyhedron),
    Nothing,
}

/// `P` with those joint limits appended that it does not have: its own faces keep their places.
fn with_limits(P: &HPolyhedron, limits: &HPolyhedron) -> HPolyhedron {
    let is_face = |row: usize, face_idx: usize| {
        P.A.row(face_idx) == limits.A.row(row) && P.b[face_idx] == limits.b[row]
    };
    let missing = |row: &usize| (0..P.n_faces()).all(|face_idx| !is_face(*row, face_idx));
    let missing: Vec<usize> = (0..limits.n_faces()).filter(missing).collect();
    if missing.is_empty() {
        return P.clone();
    }
    P.intersection(&HPolyhedron {
        A: DMatrix::from_fn(missing.len(), limits.A.ncols(), |i, j| limits.A[(missing[i], j)]),
        b: DVector::from_fn(missing.len(), |i, _| limits.b[missing[i]]),
    })
}

fn is_strictly_inside(P: &HPolyhedron, x: &DVector<f64>) -> bool {
    (0..P.n_faces()).all(|face_idx| P.A.row(face_idx).transpose().dot(x) < P.b[face_idx])
}
