//! Certifies one region against all pairs of bodies.
//!
//! Each pair first gets a few cells against the region as it came. The pairs that need more follow in their order, after a
//! clean-up of what collides (`pair_pipeline.rs`). The certified region is the intersection of all cuts.
//! Source: mathematics.md 2.1, *Order*.

use crate::assemble::{Assembled, SharedProof, assemble};
use crate::bounds::coordinate_bounds;
use crate::cell::CellBox;
use crate::contact::least_gap;
use crate::control_net::ControlNet;
use crate::cut_region::CutRegion;
use crate::error::CertifyError;
use crate::guide::Guide;
use crate::lanes::{N_LANES, in_lanes};
use crate::options::{CertifyOptions, Method};
use crate::pair_model::PairModel;
use crate::pair_pipeline::{Pipeline, search_pairs};
use crate::pair_search::{PairOutcome, search};
use crate::region_data::RegionData;
use crate::reuse::{EarlierCertificates, EarlierRows, reused};
use crate::row_program::RowProgram;
use crate::rows::Rows;
use crate::sums::pair_sums::PairSums;
use crate::sums::region_sums::certify_by_sums;
use convex_sets::HPolyhedron;
use ipc_types::artefact::RegionCertificate;
use manipulation::polytope_of_space;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::{CollisionPair, Scene, Space, Task};
use std::sync::OnceLock;

/// A polytope of C-space that is believed to be free.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Its id; also the stream of random numbers.
    pub region_id: u64,
    /// Unit rows that include the joint limits.
    pub polyhedron: HPolyhedron,
    /// A point strictly inside.
    pub center: DVector<f64>,
}

/// What the regions are for.
#[derive(Debug, Clone, Default)]
pub struct Purpose {
    /// Spaces whose volume counts as well as the region's: CG, and CP where it is not the joint box.
    pub spaces: Vec<HPolyhedron>,
    /// Configurations that cuts must not remove: start and goal.
    pub keep: Vec<DVector<f64>>,
}

impl Purpose {
    /// Start and goal stay in the regions; CG counts, and CP where it is not the whole joint box.
    pub fn of_task(scene: &Scene, task: &Task) -> Self {
        let (lower, upper) = (scene.lower(), scene.upper());
        let is_all = |space: &Space| space.lower == lower && space.upper == upper && space.rows.is_empty();
        Self {
            spaces: [&task.grasp, &task.placement]
                .into_iter()
                .filter(|space| !is_all(space))
                .map(polytope_of_space)
                .collect(),
            keep: vec![task.start.clone(), task.goal.clone()],
        }
    }
}

/// A certified region.
#[derive(Debug, Clone)]
pub struct CertifiedRegion {
    /// The polytope; unit rows that include the joint limits.
    pub polyhedron: HPolyhedron,
    /// A point strictly inside.
    pub center: DVector<f64>,
    /// Why it is free; `region_id` is the candidate's.
    pub certificate: RegionCertificate,
    /// Share of the candidate's volume that is left, estimated from samples.
    pub volume_kept: f64,
    /// Cells tried, or semidefinite programmes solved, over all pairs.
    pub n_cells: u64,
    /// Cuts made, over all pairs.
    pub n_cuts: usize,
    /// Pairs whose proof is of an earlier run.
    pub n_reused: usize,
}

/// What became of a candidate.
#[derive(Debug, Clone)]
pub enum CertifyOutcome {
    /// Certified, perhaps smaller.
    Certified(Box<CertifiedRegion>),
    /// Not certified in one piece.
    Rejected {
        /// The pair that was not proven apart.
        pair: CollisionPair,
        /// Around which configuration.
        configuration: Vec<f64>,
        /// Why, in words.
        reason: String,
    },
    /// The budget of cells ended before the proof.
    Limit {
        /// The pair.
        pair: CollisionPair,
        /// Cells it used.
        n_cells: u64,
    },
    /// The caller asked to stop.
    Stopped,
}

/// What becomes of a candidate where the search for `pair` ended without a proof.
fn refusal(pair: CollisionPair, outcome: PairOutcome) -> CertifyOutcome {
    match outcome {
        PairOutcome::Failed { configuration, reason } => {
            CertifyOutcome::Rejected { pair, configuration, reason }
        }
        PairOutcome::Limit { n_cells } => CertifyOutcome::Limit { pair, n_cells },
        PairOutcome::Proof(_) | PairOutcome::Stopped => CertifyOutcome::Stopped,
    }
}

/// The pairs of a scene, ready to certify regions.
#[derive(Debug, Clone)]
pub struct Certifier {
    pairs: Vec<PairModel>,
    /// The same pairs; empty unless the method is sums of squares.
    sums: Vec<PairSums>,
    limits: CellBox,
    options: CertifyOptions,
    seed: u64,
}

/// Pairs that need no more cells than this are independent of the others; the rest share what is cut for them.
const EASY_CELLS: u64 = 400;
/// Samples by which cuts are judged where there are earlier certificates: little is cut then.
const MAX_EXTENSION_SAMPLES: usize = 500;
/// A cut leaves the centre this share of the distance that it had to the nearest face.
const MIN_ROOM_SHARE: f64 = 0.05;

impl Certifier {
    /// All pairs of `scene`, each with the distance that `clearance` asks of it.
    pub fn new(
        scene: &Scene,
        clearance: impl Fn(CollisionPair) -> f64,
        options: &CertifyOptions,
        seed: u64,
    ) -> Result<Self, CertifyError> {
        options.validate()?;
        let pairs = scene.collision_pairs();
        let sums = match options.method {
            Method::Swept => Vec::new(),
            Method::Sos => pairs.iter().map(|&pair| PairSums::new(scene, pair, clearance(pair))).collect(),
        };
        Ok(Self {
            pairs: pairs.into_iter().map(|pair| PairModel::new(scene, pair, clearance(pair))).collect(),
            sums,
            limits: CellBox {
                lower: scene.lower().iter().copied().collect(),
                upper: scene.upper().iter().copied().collect(),
            },
            options: options.clone(),
            seed,
        })
    }

    /// The pairs, sorted.
    pub fn pairs(&self) -> impl Iterator<Item = CollisionPair> + '_ {
        self.pairs.iter().map(|model| model.pair)
    }

    /// Certifies `candidate`, cutting it where needed, or shrinking it where the method is sums of squares. `is_stopped`
    /// is asked now and then.
    pub fn certify_region(
        &self,
        candidate: &Candidate,
        purpose: &Purpose,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<CertifyOutcome, CertifyError> {
        self.certify_region_reusing(candidate, purpose, &EarlierCertificates::default(), is_stopped)
    }

    /// As [`Certifier::certify_region`]; pairs whose proof in `earlier` still holds are not searched again.
    pub fn certify_region_reusing(
        &self,
        candidate: &Candidate,
        purpose: &Purpose,
        earlier: &EarlierCertificates,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<CertifyOutcome, CertifyError> {
        self.validate(candidate)?;
        if self.options.method == Method::Sos {
            let (shrinking, settings) = (self.options.shrinking(), self.options.sums_settings());
            let (sums, limits) = (&self.sums, &self.limits);
            return Ok(certify_by_sums(sums, limits, candidate, shrinking, &settings, is_stopped));
        }
        let rows = Rows::new(&candidate.polyhedron);
        let bounds = coordinate_bounds(&rows, &self.limits);
        // In more dimensions more of a region lies beside its faces, where cuts are made: more samples, smaller cuts.
        let scale = self.limits.lower.len().saturating_sub(3).max(1);
        let options =
            CertifyOptions { max_cut_loss: self.options.max_cut_loss / scale as f64, ..self.options.clone() };
        let most = if earlier.is_empty() { usize::MAX } else { MAX_EXTENSION_SAMPLES };
        let n_samples = if options.cuts_allowed() { options.guide_samples.min(most) * scale } else { 0 };
        // Regions that need no cut need no samples.
        let samples: OnceLock<Guide> = OnceLock::new();
        let guide = || {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(candidate.region_id);
            let (P, center) = (&candidate.polyhedron, &candidate.center);
            samples.get_or_init(|| Guide::new(P, center, &purpose.spaces, n_samples, &mut rng)).clone()
        };
        let center: Vec<f64> = candidate.center.iter().copied().collect();
        let keep: Vec<Vec<f64>> = purpose
            .keep
            .iter()
            .filter(|q| candidate.polyhedron.contains(q, 0.0))
            .map(|q| q.iter().copied().collect())
            .collect();
        let room = (0..rows.len()).map(|row| rows.slack(row, &center)).fold(f64::INFINITY, f64::min);
        let region = RegionData {
            rows: &rows,
            limits: &self.limits,
            bounds: &bounds,
            center: &center,
            keep: &keep,
            guide: &guide,
            min_room: MIN_ROOM_SHARE * room,
        };
        if !self.options.cuts_allowed()
            && let Some(refusal) = self.collision_in(&region)
        {
            return Ok(refusal);
        }
        // No search helps a pair that is too close at the centre, which stays.
        if let Some(model) = self.pairs.iter().find(|model| model.gap(&center) <= model.clearance) {
            let reason = "no plane separates the bodies at the centre of the region".to_owned();
            return Ok(CertifyOutcome::Rejected { pair: model.pair, configuration: center, reason });
        }
        let mut cut = CutRegion { rows: rows.clone(), guide: None };
        let mut proofs: Vec<Option<SharedProof>> = Vec::with_capacity(self.pairs.len());
        let first = CertifyOptions { max_cells: EASY_CELLS.min(options.max_cells), ..options.clone() };
        let earlier = earlier.of_candidate(&candidate.polyhedron);
        let earlier =
            earlier.map(|certificate| (certificate, EarlierRows::new(certificate, &rows, &self.limits)));
        let on_threads = self.options.workers != 1;
        let outcomes = in_lanes(&self.pairs, on_threads, |model, net: &mut ControlNet| {
            let known = earlier.as_ref().and_then(|(certificate, earlier_rows)| {
                reused(model, certificate, earlier_rows, rows.len(), &self.limits, net)
            });
            known.map_or_else(|| search(model, &region, &first, net, is_stopped), PairOutcome::Proof)
        });
        for outcome in outcomes {
            proofs.push(match outcome {
                PairOutcome::Proof(proof) => Some(cut.join(rows.len(), proof, &guide)),
                PairOutcome::Stopped => return Ok(CertifyOutcome::Stopped),
                PairOutcome::Failed { .. } | PairOutcome::Limit { .. } => None,
            });
        }
        let hard: Vec<usize> = (0..self.pairs.len()).filter(|&idx| proofs[idx].is_none()).collect();
        let models: Vec<&PairModel> = hard.iter().map(|&idx| &self.pairs[idx]).collect();
        if !hard.is_empty() && self.options.cuts_allowed() {
            cut.clean_up(&models, &region, &self.options, on_threads);
        }
        let pipeline = Pipeline { models: &models, region, options: &options, is_stopped };
        let found = search_pairs(&pipeline, cut, if on_threads { N_LANES } else { 1 });
        let (found, cut) = match found {
            Ok(found) => found,
            Err((idx, outcome)) => return Ok(refusal(models[idx].pair, outcome)),
        };
        for (idx, proof) in hard.into_iter().zip(found) {
            proofs[idx] = Some(proof);
        }
        let proofs: Vec<SharedProof> = proofs.into_iter().flatten().collect();
        let volume_kept = cut.guide.as_ref().map_or(1.0, Guide::kept);
        let n_cells = proofs.iter().map(|proof| proof.proof.n_tried).sum();
        let reused = || proofs.iter().filter(|proof| proof.proof.is_reused);
        let n_reused = reused().count();
        let n_cuts =
            cut.rows.len() - rows.len() - reused().map(|proof| proof.proof.cuts.len()).sum::<usize>();
        let Assembled { polyhedron, rows, pairs } =
            assemble(&cut.rows, rows.len(), &self.limits, &self.pairs, proofs);
        Ok(CertifyOutcome::Certified(Box::new(CertifiedRegion {
            polyhedron,
            center: candidate.center.clone(),
            certificate: RegionCertificate { region_id: candidate.region_id, rows, pairs },
            volume_kept,
            n_cells,
            n_cuts,
            n_reused,
        })))
    }

    /// The pair that a descent of its gap over the region finds deepest in collision.
    fn collision_in(&self, region: &RegionData<'_>) -> Option<CertifyOutcome> {
        let mut program = RowProgram::default();
        let deepest = self
            .pairs
            .iter()
            .map(|model| {
                let (gap, q) = least_gap(model, region.rows, region.limits, region.center, &mut program);
                (gap - model.clearance, q, model.pair)
            })
            .min_by(|x, y| x.0.total_cmp(&y.0));
        let (gap, configuration, pair) = deepest.filter(|(gap, ..)| *gap < 0.0)?;
        let depth = -gap;
        let reason =
            format!("the bodies are {depth:.4} m closer than they may be there, and cuts are forbidden");
        Some(CertifyOutcome::Rejected { pair, configuration, reason })
    }

    fn validate(&self, candidate: &Candidate) -> Result<(), CertifyError> {
        let refuse = |problem: String| Err(CertifyError::Region { region_id: candidate.region_id, problem });
        let n = self.limits.lower.len();
        let P = &candidate.polyhedron;
        if P.ambient_dimension() != n || candidate.center.len() != n || P.A.nrows() != P.b.len() {
            return refuse(format!("it has {} coordinates, the scene has {n}", P.ambient_dimension()));
        }
        if !P.A.iter().chain(&P.b).chain(&candidate.center).all(|v| v.is_finite()) {
            return refuse("it has a number that is not finite".to_owned());
        }
        for i in 0..P.n_faces() {
            let slack = P.b[i] - P.A.row(i).transpose().dot(&candidate.center);
            if !(slack > 0.0) {
                return refuse(format!("its centre is not strictly inside: face {i} has slack {slack:e}"));
            }
        }
        for j in 0..n {
            let q = candidate.center[j];
            if !(self.limits.lower[j] <= q && q <= self.limits.upper[j]) {
                return refuse(format!("its centre has {q} at coordinate {j}, outside the joint limits"));
            }
        }
        Ok(())
    }
}
