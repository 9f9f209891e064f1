//! Grows many regions, on any number of threads, and keeps the ones that add something.

use convex_sets::HPolyhedron;
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::coverage::contains;
use crate::domain::Domain;
use crate::iris_zo::{Growth, Seed, grow};
use crate::streams::Streams;

/// A region of all coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Grown {
    pub(crate) polyhedron: HPolyhedron,
    /// Strictly inside.
    pub(crate) center: DVector<f64>,
    /// How it was seeded.
    pub(crate) method: &'static str,
}

/// A region to grow.
pub(crate) struct GrowthJob<'a, 'd> {
    pub(crate) domain: &'a Domain<'d>,
    pub(crate) seed: Seed,
    pub(crate) method: &'static str,
}

/// Grows all jobs; `None` where there is no region. Each job has a random stream of its own, so the result does not
/// depend on `threads`. Jobs not begun when `is_stopped` turns true are `None`.
pub(crate) fn grow_all(
    jobs: &[GrowthJob<'_, '_>],
    growth: &Growth,
    threads: usize,
    streams: &mut Streams,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Vec<Option<Grown>> {
    let rngs: Vec<ChaCha8Rng> = jobs.iter().map(|_| streams.take()).collect();
    let results: Vec<Mutex<Option<Grown>>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let job_idx = next.fetch_add(1, Ordering::Relaxed);
            if job_idx >= jobs.len() || is_stopped() {
                return;
            }
            let grown = grow_one(&jobs[job_idx], growth, &mut rngs[job_idx].clone());
            // A poisoned lock only says that another thread panicked; the slot itself is whole.
            *results[job_idx].lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = grown;
        }
    };
    if threads <= 1 || jobs.len() <= 1 {
        work();
    } else {
        std::thread::scope(|scope| {
            for _ in 0..threads.min(jobs.len()) {
                scope.spawn(work);
            }
        });
    }
    results.into_iter().map(|slot| slot.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())).collect()
}

fn grow_one(job: &GrowthJob<'_, '_>, growth: &Growth, rng: &mut ChaCha8Rng) -> Option<Grown> {
    let P = grow(job.domain, &job.seed, growth, rng)?;
    let polyhedron = job.domain.region(&P);
    let center = polyhedron.interior_point().ok()?.center;
    let inside = (0..polyhedron.n_faces())
        .all(|face_idx| polyhedron.A.row(face_idx).transpose().dot(&center) < polyhedron.b[face_idx]);
    inside.then_some(Grown { polyhedron, center, method: job.method })
}

/// The positions of candidates that cover `uncovered` greedily, each adding at least `least_gain` samples.
pub(crate) fn select(candidates: &[Option<Grown>], uncovered: &[Vec<f64>], least_gain: usize) -> Vec<usize> {
    let covers: Vec<Vec<bool>> = candidates
        .iter()
        .map(|candidate| {
            uncovered
                .iter()
                .map(|q| candidate.as_ref().is_some_and(|grown| contains(&grown.polyhedron, q)))
                .collect()
        })
        .collect();
    let mut is_left = vec![true; uncovered.len()];
    let mut chosen = Vec::new();
    loop {
        let gain = |idx: usize| covers[idx].iter().zip(&is_left).filter(|(c, left)| **c && **left).count();
        // Of equal gains the first candidate: it came from the larger clique.
        let best = (0..candidates.len()).map(|idx| (gain(idx), std::cmp::Reverse(idx))).max();
        match best {
            Some((gain, std::cmp::Reverse(idx))) if gain >= least_gain.max(1) => {
                is_left.iter_mut().zip(&covers[idx]).for_each(|(left, covered)| *left &= !covered);
                chosen.push(idx);
            }
            _ => return chosen,
        }
    }
}
