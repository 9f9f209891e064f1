//! Grows many regions, on any number of threads, and keeps the ones that add something. Each unit of work has a
//! random stream of its own, so the result does not depend on the number of threads.
//!
//! Drafts pass a coarse test only; the fine one, with many more samples, is for the drafts that are kept.

use convex_sets::HPolyhedron;
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;

use crate::certified_growth::grow_certified;
use crate::coverage::contains;
use crate::domain::Domain;
use crate::grower::{Draft, Growth, Method, grow, refine};
use crate::parallel::for_each;
use crate::seed::Seed;
use crate::streams::Streams;

/// A region of all coordinates.
#[derive(Debug, Clone)]
pub(crate) struct Grown {
    pub(crate) polyhedron: HPolyhedron,
    /// Strictly inside.
    pub(crate) center: DVector<f64>,
    /// How it was grown and seeded.
    pub(crate) method: String,
}

/// A region to grow.
#[derive(Clone)]
pub(crate) struct GrowthJob<'a, 'd> {
    pub(crate) domain: &'a Domain<'d>,
    pub(crate) seed: Seed,
    pub(crate) method: &'static str,
}

/// How to grow many regions.
pub(crate) struct Growing<'a> {
    pub(crate) growth: Growth,
    /// The result does not depend on it.
    pub(crate) threads: usize,
    /// Work not begun when this turns true has no result.
    pub(crate) is_stopped: &'a (dyn Fn() -> bool + Sync),
}

/// A draft with the region that it stands for.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    draft: Draft,
    /// The draft in all coordinates.
    pub(crate) polyhedron: HPolyhedron,
}

impl Growing<'_> {
    /// Grows all jobs to drafts; `None` where there is no region.
    pub(crate) fn drafts(&self, jobs: &[GrowthJob<'_, '_>], streams: &mut Streams) -> Vec<Option<Candidate>> {
        let rngs: Vec<ChaCha8Rng> = jobs.iter().map(|_| streams.take()).collect();
        for_each(jobs.len(), self.threads, self.is_stopped, &|idx| {
            let job = &jobs[idx];
            let draft = grow(job.domain, &job.seed, &self.growth, &mut rngs[idx].clone())?;
            Some(Candidate { polyhedron: job.domain.region(&draft.polyhedron), draft })
        })
    }

    /// Refines the candidates `chosen` to regions, in that order.
    pub(crate) fn refined(
        &self,
        jobs: &[GrowthJob<'_, '_>],
        candidates: &[Option<Candidate>],
        chosen: &[usize],
        streams: &mut Streams,
    ) -> Vec<Grown> {
        let rngs: Vec<ChaCha8Rng> = chosen.iter().map(|_| streams.take()).collect();
        let refined = for_each(chosen.len(), self.threads, self.is_stopped, &|place| {
            let (job, candidate) = (&jobs[chosen[place]], candidates[chosen[place]].as_ref()?);
            let P = refine(job.domain, &candidate.draft, &self.growth, &mut rngs[place].clone())?;
            let certified = match self.growth.certify_rounds {
                0 => None,
                _ => {
                    let (draft, rng) = (&candidate.draft, &mut rngs[place].clone());
                    grow_certified(job.domain, draft, &P, &self.growth, rng, self.is_stopped)
                }
            };
            // What cannot be certified here is left to the certifier, which will say why.
            let polyhedron = certified.unwrap_or_else(|| job.domain.region(&P));
            let center = polyhedron.interior_point().ok()?.center;
            let inside = (0..polyhedron.n_faces())
                .all(|face_idx| polyhedron.A.row(face_idx).transpose().dot(&center) < polyhedron.b[face_idx]);
            // Jobs name their seeds after the default method.
            let method = job.method.replacen(Method::IrisZo.name(), self.growth.method.name(), 1);
            inside.then_some(Grown { polyhedron, center, method })
        });
        refined.into_iter().flatten().collect()
    }
}

/// Whether one of the candidates contains `q`.
pub(crate) fn covers(candidates: &[Option<Candidate>], q: &[f64]) -> bool {
    candidates.iter().flatten().any(|candidate| contains(&candidate.polyhedron, q))
}

/// The positions of candidates that cover `uncovered` greedily, each adding at least `least_gain` samples, until
/// `enough` or fewer are left.
pub(crate) fn select(
    candidates: &[Option<Candidate>],
    uncovered: &[Vec<f64>],
    least_gain: usize,
    enough: usize,
) -> Vec<usize> {
    let covers: Vec<Vec<bool>> = candidates
        .iter()
        .map(|candidate| {
            uncovered
                .iter()
                .map(|q| candidate.as_ref().is_some_and(|candidate| contains(&candidate.polyhedron, q)))
                .collect()
        })
        .collect();
    let mut is_left = vec![true; uncovered.len()];
    let mut chosen = Vec::new();
    while is_left.iter().filter(|left| **left).count() > enough {
        let gain = |idx: usize| covers[idx].iter().zip(&is_left).filter(|(c, left)| **c && **left).count();
        // Of equal gains the first candidate: it came from the larger clique.
        let best = (0..candidates.len()).map(|idx| (gain(idx), std::cmp::Reverse(idx))).max();
        match best {
            Some((gain, std::cmp::Reverse(idx))) if gain >= least_gain.max(1) => {
                is_left.iter_mut().zip(&covers[idx]).for_each(|(left, covered)| *left &= !covered);
                chosen.push(idx);
            }
            _ => break,
        }
    }
    chosen
}
