//! Rounds of growth until the requested shares of CS_free, CG_free and CP_free are covered.
//!
//! - Regions are grown around start and goal.
//! - For each set in turn, on fresh samples, what is uncovered becomes a visibility graph, its cliques become seeds,
//!   and the regions that add most are kept.
//! - Bridges join components that see each other; the longest chord of a transfer leaf is completed.
//! - Regions that others cover are dropped, the rest is handed over.
//! - What certification left uncovered is grown again.

mod extend;
mod joins;
mod measures;
mod superfluous;

use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::DVector;
use wire::Region;

use crate::anchors::contain_exactly;
use crate::clique_cover::{clique_cover, seed_of_clique};
use crate::coordinates::Coordinates;
use crate::coverage::{Estimate, covered, wilson_interval};
use crate::domain::Domain;
use crate::grow::{Candidate, Growing, Grown, GrowthJob, covers, select};
use crate::grower::Growth;
use crate::leaf_chords::{ChordCoverage, FreeChord, Leaves};
use crate::options::Options;
use crate::problem::Problem;
use crate::seed::Seed;
use crate::sink::Sink;
use crate::streams::Streams;
use crate::target::{Target, TargetKind};
use crate::visibility::VisibilityGraph;
use measures::Shortfall;

pub use extend::{Kept, extend};

/// How the work ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// All targets are met.
    Covered,
    /// More rounds do not help, or `max_rounds` or `max_regions` is reached: a target is missed, the words say which.
    Short(String),
    /// None of this many samples of the set is free.
    NowhereFree {
        /// `CS_free` or `CG_free`.
        set: &'static str,
        /// Samples drawn.
        n_samples: usize,
    },
    /// `is_stopped` turned true.
    Stopped,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Decomposition {
    /// The candidates, by id.
    pub regions: Vec<Region>,
    /// Their share of CS_free.
    pub total: Estimate,
    /// Their share of CG_free, with a task.
    pub grasp: Option<Estimate>,
    /// Their share of CP_free, with a task.
    pub placement: Option<Estimate>,
    /// How much of the longest chord of a transfer leaf they cover.
    pub chord: Option<ChordCoverage>,
    /// The shares that certified versions cover, in the order of the sets' names.
    pub certified: Vec<(&'static str, Estimate)>,
    /// How the work ended.
    pub ending: Ending,
}

/// Rounds without gain after which a set is left.
const MAX_STALLED: usize = 3;
/// A region must add one in so many of the uncovered samples; after a round without gain, half of that.
const LEAST_GAIN: usize = 25;
/// Cliques that are grown in one round.
const MAX_CLIQUES: usize = 12;
/// Of what a cover may leave out, the share that its candidates may leave out: certification cuts the rest away.
const HEADROOM: f64 = 0.7;
/// A certified share has to rise by this for one more round.
const LEAST_RISE: f64 = 5e-4;

/// Decomposes the free part of `problem`. Same problem, options and seed give the same regions in the same order,
/// whatever `options.threads` is.
pub fn decompose<S: Sink>(
    problem: &Problem<'_>,
    options: &Options,
    seed: u64,
    sink: &mut S,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<Decomposition, S::Error> {
    let coordinates = Coordinates::new(problem.limits.clone(), &problem.relevant);
    if coordinates.n_relevant() == 0 {
        return without_collisions(problem, sink);
    }
    let mut cover = Cover::new(problem, options, seed, &coordinates, sink, is_stopped);
    let ending = cover.run()?;
    cover.finish(ending)
}

/// No pair depends on any coordinate: everything is free, or nothing.
fn without_collisions<S: Sink>(problem: &Problem<'_>, sink: &mut S) -> Result<Decomposition, S::Error> {
    let center = problem.limits.center();
    let everything = wilson_interval(1, 1);
    let mut decomposition = Decomposition {
        regions: Vec::new(),
        total: Estimate { low: 1.0, ..everything },
        grasp: problem.grasp.is_some().then_some(Estimate { low: 1.0, ..everything }),
        placement: problem.placement.is_some().then_some(Estimate { low: 1.0, ..everything }),
        chord: None,
        certified: Vec::new(),
        ending: Ending::Covered,
    };
    if !problem.free.is_free(center.as_slice()) {
        decomposition.ending = Ending::NowhereFree { set: TargetKind::Total.name(), n_samples: 1 };
        return Ok(decomposition);
    }
    let region = Region {
        id: 0,
        parent: None,
        polyhedron: problem.limits.to_polyhedron(),
        center,
        method: "joint-limits".into(),
        certified: false,
        margin: 0.0,
    };
    sink.region(&region)?;
    decomposition.regions.push(region);
    Ok(decomposition)
}

struct Cover<'a, S> {
    problem: &'a Problem<'a>,
    options: &'a Options,
    coordinates: &'a Coordinates,
    whole: Domain<'a>,
    targets: Vec<(Target, Domain<'a>)>,
    leaves: Option<Leaves>,
    growing: Growing<'a>,
    /// Samples of a visibility graph, and cliques of it that are grown.
    n_visible: usize,
    max_cliques: usize,
    /// Of what may stay uncovered after certification, the share that may stay uncovered before it.
    headroom: f64,
    /// Little is new: what is met is not measured again, no draft grows where earlier ones of a round are, what is
    /// dropped is chosen on the last round's samples, those that check the choice measure what is covered, and chords are
    /// searched once, where no region is yet.
    is_thrifty: bool,
    /// Samples of each target, and chords, that are to serve again.
    last_samples: Vec<Vec<Vec<f64>>>,
    chords: Option<Vec<FreeChord>>,
    streams: Streams,
    regions: Vec<Region>,
    /// The first ones, which others know already.
    n_handed_over: usize,
    /// The first ones, which stay even if others cover them.
    n_to_stay: usize,
    /// What counts as covered: the candidates, later their certified versions.
    covering: Vec<HPolyhedron>,
    certified: Vec<(&'static str, Estimate)>,
    /// Figures of the candidates, where nothing was certified.
    measured: Option<Shortfall>,
    sink: &'a mut S,
    is_stopped: &'a (dyn Fn() -> bool + Sync),
}

impl<'a, S: Sink> Cover<'a, S> {
    fn new(
        problem: &'a Problem<'a>,
        options: &'a Options,
        seed: u64,
        coordinates: &'a Coordinates,
        sink: &'a mut S,
        is_stopped: &'a (dyn Fn() -> bool + Sync),
    ) -> Self {
        let domain = |bounds: &Hyperrectangle| {
            Domain::new(coordinates, problem.free, &problem.displacement, &coordinates.project_box(bounds))
        };
        let mut targets = Vec::new();
        let mut add = |target: Option<Target>| {
            targets.extend(target.map(|target| {
                let domain = domain(&target.bounds);
                (target, domain)
            }));
        };
        // The thin set comes first, while its cliques are whole.
        if let Some(grasp) = &problem.grasp {
            add(Target::new(TargetKind::Grasp, grasp));
        }
        let placement = problem.placement.as_ref().and_then(|P| Target::new(TargetKind::Placement, P));
        let whole_is_placement = placement.as_ref().is_none_or(|target| target.contains_box(&problem.limits));
        if let (Some(grasp), Some(placement), false) =
            (&problem.grasp, &problem.placement, whole_is_placement)
        {
            add(Target::new(TargetKind::GraspPlacement, &grasp.intersection(placement)));
        }
        add(Target::new(TargetKind::Total, &problem.limits.to_polyhedron()));
        if !whole_is_placement {
            add(placement);
        }
        Self {
            problem,
            options,
            coordinates,
            whole: domain(&problem.limits),
            targets,
            leaves: Leaves::new(problem, coordinates),
            growing: Growing { growth: Growth::new(options), threads: options.threads, is_stopped },
            n_visible: options.visibility_samples,
            max_cliques: MAX_CLIQUES,
            headroom: if options.cover { HEADROOM } else { 1.0 },
            is_thrifty: false,
            last_samples: Vec::new(),
            chords: None,
            streams: Streams::new(seed),
            regions: Vec::new(),
            n_handed_over: 0,
            n_to_stay: 0,
            covering: Vec::new(),
            certified: Vec::new(),
            measured: None,
            sink,
            is_stopped,
        }
    }

    fn run(&mut self) -> Result<Ending, S::Error> {
        if let Some(ending) = self.grow_all(1.0, false)? {
            return Ok(ending);
        }
        let mut short: Option<Shortfall> = None;
        for feedback_round in 0..=self.options.max_feedback_rounds {
            if (self.is_stopped)() {
                return Ok(Ending::Stopped);
            }
            let ids: Vec<u64> = self.regions.iter().map(|region| region.id).collect();
            let Some(certified) = self.sink.certified(&ids)? else { break };
            self.covering = certified.into_iter().map(|region| region.polyhedron).collect();
            let now = self.shortfall(true);
            let risen = short.as_ref().is_none_or(|before| {
                before.shares.iter().zip(&now.shares).any(|(before, now)| *now > before + LEAST_RISE)
            });
            let is_last =
                now.words.is_empty() || !risen || feedback_round == self.options.max_feedback_rounds;
            short = Some(now);
            if is_last {
                break;
            }
            let n_before = self.regions.len();
            if let Some(ending) = self.grow_all(0.2_f64.powi(feedback_round as i32 + 1), true)? {
                return Ok(ending);
            }
            if self.regions.len() == n_before {
                break;
            }
        }
        let words = match short {
            Some(short) => short.words,
            None => {
                let now = self.shortfall(false);
                self.measured.insert(now).words.clone()
            }
        };
        Ok(if words.is_empty() { Ending::Covered } else { Ending::Short(words.join("; ")) })
    }

    /// Grows what is missing and hands over what others do not cover; an ending if the work cannot go on.
    /// `anchor_size`: domain of regions around start and goal, as a share of the joint ranges.
    fn grow_all(&mut self, anchor_size: f64, after_certification: bool) -> Result<Option<Ending>, S::Error> {
        self.grow_anchors(anchor_size);
        let ending = self.grow_until_covered(after_certification);
        if ending.is_none() {
            self.grow_bridges();
            self.grow_chord(self.wanted_chord(after_certification));
        }
        self.hand_over(after_certification)?;
        Ok(ending)
    }

    /// Takes a region in, made to contain `inside` exactly.
    fn take_in(&mut self, grown: &Grown, inside: &[&DVector<f64>]) {
        let mut polyhedron = grown.polyhedron.clone();
        for q in inside {
            contain_exactly(&mut polyhedron, q.as_slice());
        }
        let region = Region {
            id: self.regions.len() as u64,
            parent: None,
            polyhedron,
            center: grown.center.clone(),
            method: grown.method.to_owned(),
            certified: false,
            margin: self.options.configuration_margin,
        };
        self.covering.push(region.polyhedron.clone());
        self.regions.push(region);
    }

    /// Grows all jobs; where there is no region, there is none in the result.
    fn grow(&mut self, jobs: &[GrowthJob<'_, '_>]) -> Vec<Grown> {
        let candidates = self.growing.drafts(jobs, &mut self.streams);
        let all: Vec<usize> = (0..jobs.len()).collect();
        self.growing.refined(jobs, &candidates, &all, &mut self.streams)
    }

    /// Grows jobs, of which it keeps those whose drafts add at least `least_gain` of `uncovered`, best first, until
    /// `enough` or fewer are left; whether any does.
    fn grow_and_select(
        &mut self,
        jobs: &[GrowthJob<'_, '_>],
        uncovered: &[Vec<f64>],
        least_gain: usize,
        enough: usize,
    ) -> bool {
        let drafts = self.growing.drafts(jobs, &mut self.streams);
        self.take_best(jobs, &drafts, uncovered, least_gain, enough)
    }

    /// Refines and takes in those of the drafts of `jobs` that [`Cover::grow_and_select`] keeps.
    fn take_best(
        &mut self,
        jobs: &[GrowthJob<'_, '_>],
        drafts: &[Option<Candidate>],
        uncovered: &[Vec<f64>],
        least_gain: usize,
        enough: usize,
    ) -> bool {
        let chosen = select(drafts, uncovered, least_gain, enough);
        let grown = self.growing.refined(jobs, drafts, &chosen, &mut self.streams);
        for grown in &grown {
            if self.regions.len() < self.options.max_regions {
                self.take_in(grown, &[]);
            }
        }
        !grown.is_empty()
    }

    /// Regions around start and goal, where none contains them yet; `size` of the joint ranges is their domain.
    fn grow_anchors(&mut self, size: f64) {
        for anchor in &self.problem.anchors {
            if covered(&self.covering, anchor.q.as_slice()) || (self.is_stopped)() {
                continue;
            }
            let around = self.around(&anchor.q, size);
            let witness = around.u_from_q(anchor.q.as_slice());
            let jobs =
                [GrowthJob { domain: &around, seed: Seed::ball(witness), method: "iris-zo at an anchor" }];
            if let Some(grown) = self.grow(&jobs).first() {
                self.take_in(grown, &[&anchor.q]);
            }
        }
    }

    /// The part of the joint box around `q` with `size` of its extent.
    fn around(&self, q: &DVector<f64>, size: f64) -> Domain<'a> {
        let bounds = if size >= 1.0 {
            self.problem.limits.clone()
        } else {
            let half = self.problem.limits.half_widths() * size;
            let lower = (q - &half).zip_map(&self.problem.limits.lower, f64::max);
            Hyperrectangle { lower, upper: (q + &half).zip_map(&self.problem.limits.upper, f64::min) }
        };
        Domain::new(
            self.coordinates,
            self.problem.free,
            &self.problem.displacement,
            &self.coordinates.project_box(&bounds),
        )
    }

    /// The share of a set that is to be covered.
    fn wanted(&self, kind: TargetKind, after_certification: bool) -> f64 {
        match (kind, after_certification) {
            (TargetKind::Grasp | TargetKind::GraspPlacement, false) => self.options.grasp_coverage,
            (TargetKind::Grasp | TargetKind::GraspPlacement, true) => {
                self.options.certified_grasp_coverage.min(self.options.grasp_coverage)
            }
            (TargetKind::Total | TargetKind::Placement, _) if self.options.cover => self.options.coverage,
            (TargetKind::Total | TargetKind::Placement, false) => self.options.coverage,
            (TargetKind::Total | TargetKind::Placement, true) => {
                self.options.certified_coverage.min(self.options.coverage)
            }
        }
    }

    /// The share of a set at which growth aims.
    fn aim(&self, kind: TargetKind, after_certification: bool) -> f64 {
        let wanted = self.wanted(kind, after_certification);
        1.0 - self.headroom * (1.0 - wanted)
    }

    /// The share of the longest chord that is to be covered.
    fn wanted_chord(&self, after_certification: bool) -> f64 {
        match after_certification {
            false => self.options.chord_coverage,
            true => self.options.certified_chord_coverage.min(self.options.chord_coverage),
        }
    }

    /// Rounds over all sets; an ending if the work cannot go on.
    fn grow_until_covered(&mut self, after_certification: bool) -> Option<Ending> {
        let mut n_stalled = vec![0; self.targets.len()];
        let mut is_met = vec![false; self.targets.len()];
        for _ in 0..self.options.max_rounds {
            let mut all_met = true;
            for target_idx in 0..self.targets.len() {
                if (self.is_stopped)() {
                    return Some(Ending::Stopped);
                }
                // Regions are only added: what is met stays met.
                if self.is_thrifty && is_met[target_idx] {
                    continue;
                }
                if n_stalled[target_idx] >= MAX_STALLED || self.regions.len() >= self.options.max_regions {
                    continue;
                }
                let (target, domain) = self.targets[target_idx].clone();
                let samples = target.sample_free(
                    self.problem.free,
                    self.options.coverage_samples,
                    &mut self.streams.take(),
                );
                if samples.free.is_empty() {
                    if matches!(target.kind, TargetKind::Total | TargetKind::Grasp) && !after_certification {
                        let (set, n_samples) = (target.kind.name(), samples.n_drawn);
                        return Some(Ending::NowhereFree { set, n_samples });
                    }
                    continue;
                }
                let uncovered: Vec<Vec<f64>> =
                    samples.free.iter().filter(|q| !covered(&self.covering, q)).cloned().collect();
                let n_free = samples.free.len();
                let estimate = wilson_interval(n_free - uncovered.len(), n_free);
                if self.is_thrifty {
                    self.last_samples.resize(self.targets.len(), Vec::new());
                    self.last_samples[target_idx] = samples.free;
                }
                self.sink.progress(self.regions.len(), estimate.value, target.kind.name());
                if estimate.low >= self.aim(target.kind, after_certification) {
                    is_met[target_idx] = true;
                    continue;
                }
                all_met = false;
                // Half of what may stay uncovered: the next round's samples are not these.
                let may_stay = 0.5 * (1.0 - self.aim(target.kind, after_certification));
                let enough = (may_stay * n_free as f64) as usize;
                // Alternation has led away from what is left: without it regions stay where they are seeded.
                let alternating = self.growing.growth.max_iterations;
                if n_stalled[target_idx] > 0 {
                    self.growing.growth.max_iterations = 1;
                }
                let least_gain = (uncovered.len() / LEAST_GAIN) >> n_stalled[target_idx];
                let gained = self.grow_where_uncovered(target.kind, &domain, &uncovered, least_gain, enough);
                self.growing.growth.max_iterations = alternating;
                n_stalled[target_idx] = if gained { 0 } else { n_stalled[target_idx] + 1 };
            }
            if all_met {
                break;
            }
        }
        None
    }

    /// One clique cover of uncovered samples, until `enough` or fewer of them are left or no region adds `least_gain`;
    /// whether one was added.
    fn grow_where_uncovered(
        &mut self,
        kind: TargetKind,
        domain: &Domain<'a>,
        uncovered: &[Vec<f64>],
        least_gain: usize,
        enough: usize,
    ) -> bool {
        let points: Vec<DVector<f64>> =
            uncovered.iter().take(self.n_visible).map(|q| domain.u_from_q(q)).collect();
        let graph = VisibilityGraph::new(domain, &points, self.options.threads);
        let whole = self.whole.clone();
        let is_thin = matches!(kind, TargetKind::Grasp | TargetKind::GraspPlacement);
        let mut jobs = Vec::new();
        let mut drafts = Vec::new();
        for clique in clique_cover(&graph, self.options.max_exact_clique).into_iter().take(self.max_cliques) {
            // What the drafts of larger cliques cover needs no draft of its own.
            if self.is_thrifty && clique.iter().all(|&vertex| covers(&drafts, &uncovered[vertex])) {
                continue;
            }
            let members: Vec<DVector<f64>> = clique.iter().map(|&vertex| points[vertex].clone()).collect();
            let is_new = |u: &DVector<f64>| !covered(&self.covering, &domain.q_from_u(u));
            let Some(seed) = seed_of_clique(domain, &members, &is_new) else { continue };
            let n_before = jobs.len();
            if is_thin {
                // Its twin in the whole box joins the thin region to the rest.
                let witness = whole.u_from_q(&domain.q_from_u(&seed.witness.point()));
                jobs.push(GrowthJob { domain: &whole, seed: Seed::ball(witness), method: "iris-zo" });
                jobs.push(GrowthJob { domain, seed, method: "iris-zo in the grasp space" });
            } else {
                jobs.push(GrowthJob { domain, seed, method: "iris-zo" });
            }
            if self.is_thrifty {
                drafts.extend(self.growing.drafts(&jobs[n_before..], &mut self.streams));
                if uncovered.iter().filter(|q| !covers(&drafts, q)).count() <= enough {
                    break;
                }
            }
        }
        if !self.is_thrifty {
            drafts = self.growing.drafts(&jobs, &mut self.streams);
        }
        self.take_best(&jobs, &drafts, uncovered, least_gain, enough)
    }
}
