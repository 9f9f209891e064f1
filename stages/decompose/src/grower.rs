//! How a region grows, behind one interface: domain and seed in, polyhedron out.
//!
//! All methods alternate (Deits & Tedrake 2015): faces part an ellipsoid from what collides, and the largest ellipsoid
//! inside them takes its place, until it no longer grows. They differ in how they find the faces: see [`Method`].

use clap::ValueEnum;
use convex_sets::{HPolyhedron, Hyperellipsoid};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::c_iris::{CIrisGrower, TangentBudget};
use crate::domain::Domain;
use crate::iris::IrisGrower;
use crate::iris_np::IrisNpGrower;
use crate::options::Options;
use crate::placing::Search;
use crate::problem::{Problem, ProblemError};
use crate::provable::MAX_TANGENT_COORDINATES;
use crate::sampled::SampledGrower;
use crate::seed::{Seed, Witness};

/// Which faces part the ellipsoid from what collides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Exact separating planes; only where bodies translate, so that what collides is convex
    Iris,
    /// Nearest collisions of each pair by nonlinear programming from random starts; tested by samples
    IrisNp,
    /// Sampled collisions, then along gradients to the nearest one; tested by samples
    IrisNp2,
    /// Sampled collisions, then by collision checks to the nearest one; tested by samples
    #[default]
    IrisZo,
    /// Sum-of-squares certificates in TC-space, for few coordinates
    CIris,
}

/// How to grow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Growth {
    pub(crate) method: Method,
    pub(crate) epsilon: f64,
    pub(crate) delta: f64,
    /// Metres of displacement.
    pub(crate) margin: f64,
    pub(crate) max_iterations: usize,
    /// Faces beside those of the domain.
    pub(crate) max_faces: usize,
    /// IRIS-NP: starts in a row without a collision that end a pair.
    pub(crate) max_failures: usize,
    /// C-IRIS.
    pub(crate) tangent: TangentBudget,
    /// Rounds of certification that guide growth.
    pub(crate) certify_rounds: usize,
}

/// One method at work on one region.
pub(crate) trait Grower {
    /// `start` (the unit box and faces placed before) with faces that part `ellipsoid` from what collides, and keep
    /// the witness inside.
    fn separate(
        &mut self,
        domain: &Domain<'_>,
        ellipsoid: &Hyperellipsoid,
        witness: &Witness,
        start: HPolyhedron,
        growth: &Growth,
        rng: &mut ChaCha8Rng,
    ) -> HPolyhedron;

    /// Whether it goes on until the test (ε, δ) passes, so that a coarse test first saves work.
    fn is_tested(&self) -> bool {
        false
    }

    /// Whether one separation alternates until it is done, whatever the ellipsoid.
    fn is_whole(&self) -> bool {
        false
    }
}

/// The test's ε before the last separation, in units of the requested one.
const COARSE: f64 = 8.0;
/// The ellipsoid must grow by this factor, or the alternation ends.
const LEAST_GROWTH: f64 = 1.02;

impl Method {
    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Iris => "iris",
            Self::IrisNp => "iris-np",
            Self::IrisNp2 => "iris-np2",
            Self::IrisZo => "iris-zo",
            Self::CIris => "c-iris",
        }
    }

    /// Whether the method can grow regions of `problem`; `name` tells what a coordinate is called.
    pub fn check(self, problem: &Problem<'_>, name: &dyn Fn(usize) -> String) -> Result<(), ProblemError> {
        let refused = |reason: String| Err(ProblemError::Method { method: self.name(), reason });
        match (self, problem.free.pairs()) {
            (Self::IrisZo, _) => Ok(()),
            (Self::CIris, _) if problem.free.bodies().is_none() => {
                refused("it needs the bodies of a scene; choose iris-zo".into())
            }
            (Self::CIris, _) => match problem.relevant.iter().filter(|relevant| **relevant).count() {
                k if k > MAX_TANGENT_COORDINATES => refused(format!(
                    "collisions depend on {k} coordinates, and sums of squares are out of reach over more than \
                     {MAX_TANGENT_COORDINATES}; choose iris-zo or iris-np2"
                )),
                _ => Ok(()),
            },
            (Self::IrisNp | Self::IrisNp2, Some(_)) => Ok(()),
            (_, None) => refused("it needs distances between pairs of bodies; choose iris-zo".into()),
            (Self::Iris, Some(pairs)) => {
                match (0..pairs.n_pairs()).find_map(|pair_idx| pairs.convex_obstacle(pair_idx).err()) {
                    None => Ok(()),
                    Some(coordinate_idx) => refused(format!(
                        "it needs obstacles that are convex in C-space, but joint {} is revolute and moves bodies \
                         that may collide; choose iris-zo or iris-np2",
                        name(coordinate_idx)
                    )),
                }
            }
        }
    }

    pub(crate) fn grower(self, domain: &Domain<'_>) -> Option<Box<dyn Grower>> {
        Some(match self {
            Self::IrisZo => Box::new(SampledGrower::new(Search::Compass)),
            Self::IrisNp2 => Box::new(SampledGrower::new(Search::Gradient)),
            Self::IrisNp => Box::new(IrisNpGrower),
            Self::Iris => Box::new(IrisGrower::new(domain)?),
            Self::CIris => Box::new(CIrisGrower),
        })
    }
}

impl Growth {
    pub(crate) fn new(options: &Options) -> Self {
        Self {
            method: options.method,
            epsilon: options.epsilon,
            delta: options.delta,
            margin: options.configuration_margin,
            max_iterations: options.max_iterations,
            max_faces: options.max_faces,
            max_failures: options.max_failures,
            tangent: TangentBudget::new(options),
            certify_rounds: options.certify_growth,
        }
    }
}

/// A region that has passed a coarse test only; [`refine`] makes it a region.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    /// In the domain's units; the first 2k faces are the unit box, the others are not redundant.
    pub(crate) polyhedron: HPolyhedron,
    pub(crate) inscribed: Hyperellipsoid,
    pub(crate) witness: Witness,
}

/// Grows a draft. `None` if the witness is not free, no region with an interior is left, or the method does not know
/// what collides (see [`Method::check`]).
pub(crate) fn grow(domain: &Domain<'_>, seed: &Seed, growth: &Growth, rng: &mut ChaCha8Rng) -> Option<Draft> {
    if !seed.witness.ends().into_iter().all(|end| domain.is_free(end)) {
        return None;
    }
    let mut grower = growth.method.grower(domain)?;
    let growth = match grower.is_tested() {
        true => Growth { epsilon: (COARSE * growth.epsilon).min(0.2), ..*growth },
        false => *growth,
    };
    let mut ellipsoid = seed.ellipsoid.clone();
    let mut best: Option<(HPolyhedron, Hyperellipsoid)> = None;
    for _ in 0..growth.max_iterations.max(1) {
        let P = grower.separate(domain, &ellipsoid, &seed.witness, domain.unit_box(), &growth, rng);
        let Ok(inscribed) = P.max_inscribed_ellipsoid() else { break };
        let last = best.as_ref().map_or(0.0, |(_, last)| last.relative_volume());
        let volume = inscribed.relative_volume();
        if volume > last {
            ellipsoid = inscribed.clone();
            best = Some((P, inscribed));
        }
        if grower.is_whole() || volume < LEAST_GROWTH * last {
            break;
        }
    }
    let (P, inscribed) = best?;
    let polyhedron = P.remove_redundant_keeping(2 * domain.dim()).ok()?;
    Some(Draft { polyhedron, inscribed, witness: seed.witness.clone() })
}

/// `start` (the unit box and faces placed before, all kept) with faces after them that cut off what collides.
pub(crate) fn cut(
    domain: &Domain<'_>,
    start: &HPolyhedron,
    seed: &Seed,
    growth: &Growth,
    rng: &mut ChaCha8Rng,
) -> Option<HPolyhedron> {
    let mut grower = growth.method.grower(domain)?;
    let P = grower.separate(domain, &seed.ellipsoid, &seed.witness, start.clone(), growth, rng);
    P.remove_redundant_keeping(start.n_faces()).ok()
}

/// The draft with what the requested test finds in it cut off; in the domain's units, first 2k faces the unit box.
pub(crate) fn refine(
    domain: &Domain<'_>,
    draft: &Draft,
    growth: &Growth,
    rng: &mut ChaCha8Rng,
) -> Option<HPolyhedron> {
    let mut grower = growth.method.grower(domain)?;
    if !grower.is_tested() {
        return Some(draft.polyhedron.clone());
    }
    let start = draft.polyhedron.clone();
    let P = grower.separate(domain, &draft.inscribed, &draft.witness, start, growth, rng);
    P.remove_redundant_keeping(2 * domain.dim()).ok()
}
