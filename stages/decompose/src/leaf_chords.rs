//! How far one transfer can turn: the longest free chord of a transfer leaf inside CG, and how much of it one
//! connected piece of the regions covers.
//!
//! Only where a transfer leaf, seen in the coordinates that collisions depend on, is a line: then its free part is a
//! set of intervals, and the longest one bounds how far the object moves with one grasp.

use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::coordinates::Coordinates;
use crate::problem::Problem;
use crate::streams::Streams;
use crate::target::{Target, TargetKind};

/// Lengths are along the leaf, in units of its direction in C-space.
#[derive(Debug, Clone, PartialEq)]
pub struct ChordCoverage {
    /// Length of the longest free chord found.
    pub free: f64,
    /// Length of the longest piece of a free chord that overlapping regions cover without a gap.
    pub covered: f64,
    /// Points of CG near the ends of the longest free chord that regions leave uncovered.
    pub uncovered: Vec<Vec<f64>>,
}

impl ChordCoverage {
    /// `covered` / `free`.
    pub fn share(&self) -> f64 {
        if self.free > 0.0 { self.covered / self.free } else { 1.0 }
    }
}

/// Leaves that are measured.
const N_LEAVES: usize = 60;
/// Steps along the extent of CG in which a chord is followed.
const N_STEPS: usize = 200;
/// Distance, as a share of CG, that a leaf on the boundary of CG keeps from it.
const INSET: f64 = 1e-4;

/// The free piece {q + t·direction : low ≤ t ≤ high} of a transfer leaf inside CG.
#[derive(Debug, Clone)]
pub(crate) struct FreeChord {
    q: DVector<f64>,
    direction: DVector<f64>,
    low: f64,
    high: f64,
}

/// What `regions` cover of `chords`.
pub(crate) fn chord_coverage(chords: &[FreeChord], regions: &[HPolyhedron]) -> ChordCoverage {
    let mut result = ChordCoverage { free: 0.0, covered: 0.0, uncovered: Vec::new() };
    for FreeChord { q, direction, low, high } in chords {
        let (low, high) = (*low, *high);
        let (piece_low, piece_high) = longest_piece(regions, q, direction, low, high);
        result.covered = result.covered.max(piece_high - piece_low);
        if high - low > result.free {
            result.free = high - low;
            result.uncovered.clear();
            let mut gap = |from: f64, to: f64| {
                if to - from > 1e-6 * (high - low) {
                    result.uncovered.push((q + 0.5 * (from + to) * direction).as_slice().to_vec());
                }
            };
            gap(low, piece_low);
            gap(piece_high, high);
        }
    }
    result
}

/// Measures chords of transfer leaves; `None` without a task, or if leaves are not lines. `seed` chooses the leaves.
pub fn longest_chord_coverage(
    problem: &Problem<'_>,
    regions: &[HPolyhedron],
    seed: u64,
) -> Option<ChordCoverage> {
    let coordinates = Coordinates::new(problem.limits.clone(), &problem.relevant);
    let leaves = Leaves::new(problem, &coordinates)?;
    Some(leaves.measure(problem, regions, &mut Streams::new(seed).take()))
}

/// The leaves of a problem.
#[derive(Debug, Clone)]
pub(crate) struct Leaves {
    coordinates: Coordinates,
    grasp: Target,
    /// Direction of the leaf [n], scaled so that its largest coordinate crosses CG in 1.
    direction: DVector<f64>,
}

impl Leaves {
    pub(crate) fn new(problem: &Problem<'_>, coordinates: &Coordinates) -> Option<Self> {
        let grasp = Target::new(TargetKind::Grasp, problem.grasp.as_ref()?)?;
        let direction = leaf_direction(problem.transfer_keep.as_ref()?, coordinates)?;
        Some(Self { coordinates: coordinates.clone(), grasp, direction })
    }

    pub(crate) fn measure(
        &self,
        problem: &Problem<'_>,
        regions: &[HPolyhedron],
        rng: &mut ChaCha8Rng,
    ) -> ChordCoverage {
        chord_coverage(&self.free_chords(problem, &[], rng), regions)
    }

    /// Free chords of leaves through samples of CG. What lies in `known` counts as free without a check.
    pub(crate) fn free_chords(
        &self,
        problem: &Problem<'_>,
        known: &[HPolyhedron],
        rng: &mut ChaCha8Rng,
    ) -> Vec<FreeChord> {
        let samples = self.grasp.sample_free(problem.free, N_LEAVES, rng).free;
        let mut chords = Vec::new();
        for (idx, sample) in samples.iter().enumerate() {
            let x = self.coordinates.project(sample);
            let q = self.on_boundary(&self.coordinates.lift(x.as_slice()), idx);
            if !problem.free.is_free(&q) {
                continue;
            }
            let q = DVector::from_vec(q);
            if let Some((low, high)) = self.free_chord(problem, known, &q) {
                chords.push(FreeChord { q, direction: self.direction.clone(), low, high });
            }
        }
        chords
    }

    /// Every other leaf is moved to the boundary of CG's box: the longest chord is often there.
    fn on_boundary(&self, q: &[f64], idx: usize) -> Vec<f64> {
        let mut q = q.to_vec();
        let Hyperrectangle { lower, upper } = &self.grasp.bounds;
        for (place, &j) in self.coordinates.relevant.iter().enumerate() {
            let inset = INSET * (upper[j] - lower[j]);
            match (idx >> (2 * place)) & 3 {
                _ if self.direction[j] != 0.0 => {}
                0 => q[j] = lower[j] + inset,
                1 => q[j] = upper[j] - inset,
                _ => {}
            }
        }
        q
    }

    /// The free interval of q + t d around t = 0 inside CG.
    fn free_chord(
        &self,
        problem: &Problem<'_>,
        known: &[HPolyhedron],
        q: &DVector<f64>,
    ) -> Option<(f64, f64)> {
        let (low, high) = clip(&self.grasp.polyhedron, q, &self.direction)?;
        let known: Vec<(f64, f64)> = known.iter().filter_map(|P| clip(P, q, &self.direction)).collect();
        let is_free = |t: f64| {
            known.iter().any(|(from, to)| *from <= t && t <= *to)
                || problem.free.is_free((q + t * &self.direction).as_slice())
        };
        let end = |bound: f64| {
            let mut last_free = 0.0;
            for step in 1..=N_STEPS {
                let t = bound * step as f64 / N_STEPS as f64;
                if !is_free(t) {
                    let (mut free, mut blocked) = (last_free, t);
                    for _ in 0..30 {
                        let middle = 0.5 * (free + blocked);
                        *(if is_free(middle) { &mut free } else { &mut blocked }) = middle;
                    }
                    return free;
                }
                last_free = t;
            }
            bound
        };
        Some((end(low), end(high)))
    }
}

/// The direction in which coordinates change while all `forms` are constant, if in the relevant coordinates there is
/// exactly one.
fn leaf_direction(forms: &DMatrix<f64>, coordinates: &Coordinates) -> Option<DVector<f64>> {
    let n = coordinates.dim();
    let extent = &coordinates.limits.upper - &coordinates.limits.lower;
    // In units of the joint ranges; padded so that the decomposition has all n right singular vectors.
    let mut scaled = DMatrix::zeros(forms.nrows().max(n), n);
    for i in 0..forms.nrows() {
        let row = forms.row(i).transpose().component_mul(&extent);
        let norm = row.norm().max(f64::MIN_POSITIVE);
        scaled.row_mut(i).copy_from(&(row / norm).transpose());
    }
    let svd = scaled.svd(false, true);
    let v_t = svd.v_t?;
    let kernel: Vec<DVector<f64>> =
        (0..n).filter(|&k| svd.singular_values[k] < 1e-9).map(|k| v_t.row(k).transpose()).collect();
    let shadow = DMatrix::from_fn(coordinates.n_relevant(), kernel.len(), |row, k| {
        kernel[k][coordinates.relevant[row]]
    });
    if shadow.is_empty() {
        return None;
    }
    let svd = shadow.svd(false, true);
    let n_moving = svd.singular_values.iter().filter(|&&s| s > 1e-9).count();
    if n_moving != 1 {
        return None;
    }
    let (k, _) = svd.singular_values.argmax();
    let weights = svd.v_t?.row(k).transpose();
    let mut direction = DVector::zeros(n);
    for (vector, weight) in kernel.iter().zip(weights.iter()) {
        direction += *weight * vector.component_mul(&extent);
    }
    // Rounding must not move coordinates that the leaf keeps.
    let largest = direction.amax();
    direction.apply(|v| *v = if v.abs() < 1e-9 * largest { 0.0 } else { *v });
    Some(direction)
}

/// The interval of t with q + t d in `P`.
fn clip(P: &HPolyhedron, q: &DVector<f64>, d: &DVector<f64>) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for face_idx in 0..P.n_faces() {
        let row = P.A.row(face_idx).transpose();
        let (slack, speed) = (P.b[face_idx] - row.dot(q), row.dot(d));
        if speed > 0.0 {
            high = high.min(slack / speed);
        } else if speed < 0.0 {
            low = low.max(slack / speed);
        } else if slack < 0.0 {
            return None;
        }
    }
    (low < high && low.is_finite() && high.is_finite()).then_some((low, high))
}

/// The longest interval inside [low, high] that regions cover without a gap; empty at `low` if there is none.
fn longest_piece(
    regions: &[HPolyhedron],
    q: &DVector<f64>,
    d: &DVector<f64>,
    low: f64,
    high: f64,
) -> (f64, f64) {
    let mut intervals: Vec<(f64, f64)> = regions
        .iter()
        .filter_map(|P| clip(P, q, d))
        .map(|(from, to)| (from.max(low), to.min(high)))
        .filter(|(from, to)| from < to)
        .collect();
    intervals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let least_overlap = 1e-6 * (high - low);
    let mut best = (low, low);
    let mut current: Option<(f64, f64)> = None;
    for (from, to) in intervals {
        current = match current {
            Some((start, end)) if from + least_overlap <= end || to <= end => Some((start, end.max(to))),
            _ => Some((from, to)),
        };
        if let Some((start, end)) = current
            && end - start > best.1 - best.0
        {
            best = (start, end);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(low: f64, high: f64) -> HPolyhedron {
        HPolyhedron::from_box(&DVector::from_vec(vec![low]), &DVector::from_vec(vec![high]))
    }

    #[test]
    fn pieces_join_where_they_overlap() {
        let (q, d) = (DVector::from_vec(vec![0.0]), DVector::from_vec(vec![1.0]));
        let regions = [interval(0.0, 0.3), interval(0.2, 0.5), interval(0.5, 0.9)];
        assert_eq!(longest_piece(&regions, &q, &d, 0.0, 1.0), (0.0, 0.5));
        assert_eq!(longest_piece(&regions[..2], &q, &d, 0.1, 0.4), (0.1, 0.4));
        assert_eq!(longest_piece(&[], &q, &d, 0.1, 0.4), (0.1, 0.1));
    }

    /// What regions contain is not checked again, and chords go on beyond it as before.
    #[test]
    fn chords_are_searched_where_no_region_is() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        let n_checks = AtomicUsize::new(0);
        let free = crate::free_space::FreeWhere(|q: &[f64]| {
            n_checks.fetch_add(1, Ordering::Relaxed);
            (-0.6..=0.7).contains(&q[0])
        });
        let unit = |half: f64| Hyperrectangle {
            lower: DVector::from_element(2, -half),
            upper: DVector::from_element(2, half),
        };
        let problem = Problem {
            limits: unit(1.0),
            relevant: vec![true, true],
            displacement: DVector::from_element(2, 1.0),
            free: &free,
            grasp: Some(unit(1.0).to_polyhedron()),
            placement: None,
            transfer_keep: Some(DMatrix::from_row_slice(1, 2, &[0.0, 1.0])),
            anchors: Vec::new(),
        };
        let coordinates = Coordinates::new(problem.limits.clone(), &problem.relevant);
        let leaves = Leaves::new(&problem, &coordinates).unwrap();
        let search = |known: &[HPolyhedron]| {
            let before = n_checks.load(Ordering::Relaxed);
            let chords = leaves.free_chords(&problem, known, &mut Streams::new(5).take());
            let ends: Vec<(f64, f64)> = chords
                .iter()
                .map(|c| (c.q[0] + c.low * c.direction[0], c.q[0] + c.high * c.direction[0]))
                .collect();
            (ends, n_checks.load(Ordering::Relaxed) - before)
        };
        let (all, n_all) = search(&[]);
        let (few, n_few) = search(&[unit(0.5).to_polyhedron()]);
        assert!(all.len() > 10 && all.len() == few.len());
        for (x, y) in all.iter().zip(&few) {
            let (low, high) = (x.0.min(x.1), x.0.max(x.1));
            assert!((low + 0.6).abs() < 1e-6 && (high - 0.7).abs() < 1e-6, "{low} {high}");
            assert!((x.0 - y.0).abs() < 1e-6 && (x.1 - y.1).abs() < 1e-6);
        }
        assert!(n_few < n_all, "{n_few} of {n_all}");
    }

    #[test]
    fn leaf_of_the_bottle_cap_turns_gripper_and_cap() {
        let limits = Hyperrectangle {
            lower: DVector::from_vec(vec![-3.1, -1.0, -0.055]),
            upper: DVector::from_vec(vec![3.1, 1.0, 0.0]),
        };
        let coordinates = Coordinates::new(limits, &[false, true, true]);
        let forms = DMatrix::from_row_slice(2, 3, &[-1.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let d = leaf_direction(&forms, &coordinates).unwrap();
        assert!((d[0] - d[1]).abs() < 1e-9 * d[0].abs() && d[2] == 0.0, "{d}");
        // With one form fewer the leaf is a plane.
        assert!(leaf_direction(&forms.rows(0, 1).into_owned(), &coordinates).is_none());
    }
}
