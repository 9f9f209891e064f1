//! Searches the hard pairs of a region, several at a time.
//!
//! The pairs begin in their order. Each sees the cuts of all but the [`N_UNSEEN`] before it, which may still be at work: so
//! what comes out depends neither on the number of threads nor on which pair ends first, and two threads seldom wait.
//! Source: mathematics.md 2.1, *Order*; there all pairs run against the same region, which cuts away more.

use crate::assemble::SharedProof;
use crate::control_net::ControlNet;
use crate::cut_region::CutRegion;
use crate::options::CertifyOptions;
use crate::pair_model::PairModel;
use crate::pair_search::{PairOutcome, PairProof, search};
use crate::region_data::RegionData;
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// So many pairs before one are still at work when it begins, or count as if they were.
const N_UNSEEN: usize = 2;
/// After so many pairs rows that others imply are taken out of use.
const PAIRS_BETWEEN_PRUNINGS: usize = 2;

/// What is searched.
pub struct Pipeline<'a> {
    /// The pairs, in their order.
    pub models: &'a [&'a PairModel],
    /// What they share; its rows and samples are those of the region as it came.
    pub region: RegionData<'a>,
    /// Options.
    pub options: &'a CertifyOptions,
    /// Whether the caller wants an end.
    pub is_stopped: &'a (dyn Fn() -> bool + Sync),
}

/// How far the pairs are.
struct Progress {
    /// The pair that begins next.
    next: usize,
    /// Proofs of pairs that wait for one before them, with the number of rows that they began with.
    found: BTreeMap<usize, (usize, PairProof)>,
    /// Proofs of the first pairs, in their order.
    joined: Vec<SharedProof>,
    /// The region with the cuts of `joined`.
    region: CutRegion,
    /// By number of pairs joined, as long as a pair may begin with it.
    states: BTreeMap<usize, Arc<CutRegion>>,
    /// The first pair that found no proof, of those that ended, and how it did.
    failed: Option<(usize, PairOutcome)>,
    /// A thread panicked: the others end.
    is_broken: bool,
}

impl Progress {
    fn has_failed_before(&self, idx: usize) -> bool {
        self.is_broken || self.failed.as_ref().is_some_and(|(failed, _)| *failed < idx)
    }
}

/// Where the first pair failed; else the proofs of all, and what their cuts leave of `region`.
pub fn search_pairs(
    pipeline: &Pipeline<'_>,
    region: CutRegion,
    n_threads: usize,
) -> Result<(Vec<SharedProof>, CutRegion), (usize, PairOutcome)> {
    let first = Arc::new(region.clone());
    let progress = Mutex::new(Progress {
        next: 0,
        found: BTreeMap::new(),
        joined: Vec::new(),
        region,
        states: BTreeMap::from([(0, first)]),
        failed: None,
        is_broken: false,
    });
    let changed = Condvar::new();
    std::thread::scope(|scope| {
        for _ in 1..n_threads {
            scope.spawn(|| pipeline.work(&progress, &changed));
        }
        pipeline.work(&progress, &changed);
    });
    let progress = progress.into_inner().unwrap_or_else(PoisonError::into_inner);
    match progress.failed {
        Some(failed) => Err(failed),
        None => Ok((progress.joined, progress.region)),
    }
}

impl Pipeline<'_> {
    /// Searches pairs until none is left or one failed.
    fn work(&self, progress: &Mutex<Progress>, changed: &Condvar) {
        let _alarm = Alarm { progress, changed };
        let mut net = ControlNet::default();
        let mut at = lock(progress);
        loop {
            let idx = at.next;
            if idx >= self.models.len() || at.has_failed_before(idx) {
                return;
            }
            let Some(state) = at.states.get(&idx.saturating_sub(N_UNSEEN)).cloned() else {
                at = changed.wait(at).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            at.next += 1;
            drop(at);
            let guide = || state.guide.clone().unwrap_or_else(self.region.guide);
            let region = RegionData { rows: &state.rows, guide: &guide, ..self.region };
            let outcome = search(self.models[idx], &region, self.options, &mut net, self.is_stopped);
            at = lock(progress);
            match outcome {
                PairOutcome::Proof(proof) => {
                    at.found.insert(idx, (state.rows.len(), proof));
                    self.join(&mut at);
                }
                outcome => {
                    if at.failed.as_ref().is_none_or(|(failed, _)| idx < *failed) {
                        at.failed = Some((idx, outcome));
                    }
                }
            }
            changed.notify_all();
        }
    }

    /// Joins the proofs that no pair before them is missing for.
    fn join(&self, at: &mut Progress) {
        while let Some((n_base, proof)) = at.found.remove(&at.joined.len()) {
            let joined = at.region.join(n_base, proof, self.region.guide);
            at.joined.push(joined);
            let n_joined = at.joined.len();
            if n_joined.is_multiple_of(PAIRS_BETWEEN_PRUNINGS) {
                at.region.prune(self.region.limits);
            }
            at.states.insert(n_joined, Arc::new(at.region.clone()));
            // Pairs that began have theirs.
            let oldest = at.next.saturating_sub(N_UNSEEN).min(n_joined);
            at.states.retain(|&n, _| n >= oldest);
        }
    }
}

/// Ends the other threads where one panics: they may wait for it.
struct Alarm<'a> {
    progress: &'a Mutex<Progress>,
    changed: &'a Condvar,
}

impl Drop for Alarm<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            lock(self.progress).is_broken = true;
            self.changed.notify_all();
        }
    }
}

fn lock<'a>(progress: &'a Mutex<Progress>) -> MutexGuard<'a, Progress> {
    progress.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::coordinate_bounds;
    use crate::cell::CellBox;
    use crate::guide::Guide;
    use crate::rows::Rows;
    use convex_sets::HPolyhedron;
    use nalgebra::DVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use std::path::Path;

    /// Searches the pairs that meet in a box beside the top shelf, but not at its centre.
    fn searched(
        max_cells: u64,
        n_threads: usize,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<(Vec<SharedProof>, CutRegion), (usize, PairOutcome)> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes/iiwa14-shelf");
        let scene = scene::Scene::load(&folder).expect("the scene of this project loads");
        let center = DVector::from_vec(vec![0.0, 0.397, 0.0, -1.367, 0.0, -0.193, 1.570]);
        let polyhedron = HPolyhedron::from_box(&center.add_scalar(-0.1), &center.add_scalar(0.1));
        let rows = Rows::new(&polyhedron);
        let limits = CellBox {
            lower: scene.lower().iter().copied().collect(),
            upper: scene.upper().iter().copied().collect(),
        };
        let pairs = scene.collision_pairs();
        let models: Vec<PairModel> =
            pairs.into_iter().map(|pair| PairModel::new(&scene, pair, 0.0)).collect();
        let guide = || Guide::new(&polyhedron, &center, &[], 2000, &mut ChaCha8Rng::seed_from_u64(5));
        let samples = guide();
        let meet = |model: &&PairModel| {
            model.corners.is_some()
                && model.gap(center.as_slice()) > 0.02
                && samples.samples().any(|q| model.gap(&q) < 0.0)
        };
        let models: Vec<&PairModel> = models.iter().filter(meet).collect();
        assert!(models.len() > 3, "{} pairs", models.len());
        let region = RegionData {
            rows: &rows,
            limits: &limits,
            bounds: &coordinate_bounds(&rows, &limits),
            center: center.as_slice(),
            keep: &[],
            guide: &guide,
            min_room: 1e-3,
        };
        let options = CertifyOptions { max_cells, ..CertifyOptions::default() };
        let pipeline = Pipeline { models: &models, region, options: &options, is_stopped };
        search_pairs(&pipeline, CutRegion { rows: rows.clone(), guide: None }, n_threads)
    }

    #[test]
    fn any_number_of_threads_finds_the_same() {
        let found = |n_threads: usize| {
            let (proofs, region) = searched(20_000, n_threads, &|| false).expect("the pairs are certified");
            let of_proof = |proof: &SharedProof| {
                let SharedProof { n_base, offset, proof } = proof;
                (*n_base, *offset, proof.n_tried, proof.cells.clone(), proof.cuts.clone())
            };
            (proofs.iter().map(of_proof).collect::<Vec<_>>(), region.rows)
        };
        let one = found(1);
        assert!(one.0.iter().any(|(.., cuts)| !cuts.is_empty()), "nothing was cut");
        assert!(one.0.iter().any(|(n_base, ..)| *n_base > one.0[0].0), "no pair saw cuts of others");
        for n_threads in [2, 3, 8] {
            assert!(found(n_threads) == one, "{n_threads} threads");
        }
    }

    #[test]
    fn the_first_pair_that_fails_is_named_whichever_ends_first() {
        let failed = |n_threads: usize| match searched(30, n_threads, &|| false) {
            Err((idx, PairOutcome::Limit { n_cells })) => (idx, n_cells),
            _ => panic!("a pair was certified with 30 cells"),
        };
        let one = failed(1);
        for n_threads in [2, 3, 8] {
            assert_eq!(failed(n_threads), one, "{n_threads} threads");
        }
    }

    #[test]
    fn a_stop_ends_all_threads() {
        for n_threads in [1, 2] {
            let outcome = searched(20_000, n_threads, &|| true);
            assert!(matches!(outcome, Err((_, PairOutcome::Stopped))));
        }
    }
}
