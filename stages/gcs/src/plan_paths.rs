//! The paths of a whole plan: thesis 2, section 5.5 and eq. 5.9.

use crate::error::GcsError;
use crate::exact;
use crate::leaf_frame::TOL_KEPT;
use crate::options::Options;
use crate::search::Found;
use crate::segment::{SegmentOutcome, pieces, solve_segment};
use ipc_types::artefact::{LeafCut, Mode, PlanFile, Segment, TrajectoryFile};
use manipulation::{Manipulation, PathMode};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What paths are searched in.
#[derive(Debug, Clone, Copy)]
pub struct Regions<'a> {
    /// Spaces, kept forms and polytopes; polytope `j` belongs to `ids[j]`.
    pub manipulation: &'a Manipulation,
    /// Identifiers of the regions.
    pub ids: &'a [u64],
    /// Whether each is certified.
    pub certified: &'a [bool],
    /// Names of the coordinates.
    pub coordinates: &'a [String],
}

/// Takes what is found on the way, in the order of the segments.
pub trait Sink {
    /// A segment has its path.
    fn segment(&mut self, segment_idx: usize, segment: &Segment, found: &Found);
    /// A segment has no path in its leaf: proven.
    fn cut(&mut self, segment_idx: usize, cut: &LeafCut);
}

/// How the work ended.
#[derive(Debug, Clone, PartialEq)]
pub enum PathsOutcome {
    /// Every segment has a path.
    Found(TrajectoryFile),
    /// Segments without a path in their leaf, proven: one cut each, in order.
    NoPath(Vec<LeafCut>),
    /// No segment is proven to have no path, but some have none that could be verified.
    Undecided {
        /// Position of the first of them.
        segment_idx: usize,
        /// Why.
        reason: String,
    },
    /// The plan says that there is no plan.
    NoPlan,
    /// Stopped on request; what was found is with the sink.
    Cancelled,
}

/// Paths of all segments of `plan`, each the shortest inside its leaf. Segments draw from their own random streams
/// of `seed`, so that none depends on another.
pub fn plan_paths(
    regions: Regions,
    plan: &PlanFile,
    options: &Options,
    seed: u64,
    sink: &mut dyn Sink,
    cancelled: &dyn Fn() -> bool,
) -> Result<PathsOutcome, GcsError> {
    validate_options(options)?;
    let (Some(configurations), Some(modes)) = (&plan.configurations, &plan.modes) else {
        return Ok(PathsOutcome::NoPlan);
    };
    let configurations = validated(regions, configurations, modes)?;
    let mut segments = Vec::new();
    let mut cuts = Vec::new();
    let mut undecided = None;
    for (segment_idx, &mode) in modes.iter().enumerate() {
        if cancelled() {
            return Ok(PathsOutcome::Cancelled);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(segment_idx as u64);
        let (s, g) = (&configurations[segment_idx], &configurations[segment_idx + 1]);
        let outcome =
            solve_segment(regions.manipulation, path_mode(mode), s, g, options, &mut rng, cancelled);
        match outcome {
            SegmentOutcome::Found(found) => {
                let segment = segment_of(regions, mode, &found, options.order);
                sink.segment(segment_idx, &segment, &found);
                segments.push(segment);
            }
            SegmentOutcome::NoPath { reached, exits } => {
                let cut = cut_of(regions, mode, &reached, &exits);
                sink.cut(segment_idx, &cut);
                // Segments in the same leaf give the same cut.
                if !cuts.contains(&cut) {
                    cuts.push(cut);
                }
            }
            SegmentOutcome::Undecided { reason } => {
                undecided.get_or_insert((segment_idx, reason));
            }
            SegmentOutcome::StartOutside => return Err(outside(segment_idx, mode)),
            SegmentOutcome::GoalOutside => return Err(outside(segment_idx + 1, mode)),
        }
    }
    if !cuts.is_empty() {
        return Ok(PathsOutcome::NoPath(cuts));
    }
    if let Some((segment_idx, reason)) = undecided {
        return Ok(PathsOutcome::Undecided { segment_idx, reason });
    }
    let length = segments.iter().map(|segment: &Segment| segment.length).sum();
    let coordinates = regions.coordinates.to_vec();
    Ok(PathsOutcome::Found(TrajectoryFile { coordinates, segments, length, duration: length }))
}

/// The mode in the words of the spaces.
fn path_mode(mode: Mode) -> PathMode {
    match mode {
        Mode::Transit => PathMode::Transit,
        Mode::Transfer => PathMode::Transfer,
    }
}

fn segment_of(regions: Regions, mode: Mode, found: &Found, order: usize) -> Segment {
    let pieces = pieces(&found.path, regions.manipulation, path_mode(mode), order);
    // Of the control polygon, which rounding makes no shorter than the straight pieces that it follows.
    let distance =
        |ends: &[Vec<f64>]| ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    let length: f64 = pieces.iter().flat_map(|piece| piece.windows(2).map(distance)).sum();
    Segment {
        mode,
        pieces,
        regions: found.path.regions.iter().map(|&region_idx| regions.ids[region_idx]).collect(),
        length,
        lower_bound: found.lower_bound.min(length),
        certified: found.path.regions.iter().all(|&region_idx| regions.certified[region_idx]),
    }
}

fn cut_of(regions: Regions, mode: Mode, reached: &[usize], exits: &[(usize, usize)]) -> LeafCut {
    let mut reached: Vec<u64> = reached.iter().map(|&idx| regions.ids[idx]).collect();
    let mut exits: Vec<(u64, u64)> = exits.iter().map(|&(a, b)| (regions.ids[a], regions.ids[b])).collect();
    reached.sort_unstable();
    exits.sort_unstable();
    LeafCut { mode, reached, exits }
}

fn outside(configuration_idx: usize, mode: Mode) -> GcsError {
    let space = match mode {
        Mode::Transit => "placement space",
        Mode::Transfer => "grasp space",
    };
    GcsError::OutsideRegions { configuration_idx, space }
}

fn validate_options(options: &Options) -> Result<(), GcsError> {
    let refuse = |option, value: String, expected| Err(GcsError::Option { option, value, expected });
    if !(1..=MAX_ORDER).contains(&options.order) {
        return refuse("order", options.order.to_string(), "1 to 20");
    }
    if !(options.tol_gap >= 0.0 && options.tol_gap < 1.0) {
        return refuse("tol-gap", options.tol_gap.to_string(), "at least 0, below 1");
    }
    Ok(())
}

/// Highest order of pieces.
const MAX_ORDER: usize = 20;

fn validated(
    regions: Regions,
    configurations: &[Vec<f64>],
    modes: &[Mode],
) -> Result<Vec<DVector<f64>>, GcsError> {
    let n = regions.manipulation.dim();
    let shape = |field, found, expected| Err(GcsError::PlanShape { field, found, expected });
    // Of a start that is the goal nothing has to move: configurations without segments are fine then.
    if !modes.is_empty() && configurations.len() != modes.len() + 1 {
        return shape("configurations", configurations.len(), modes.len() + 1);
    }
    for (configuration_idx, q) in configurations.iter().enumerate() {
        if q.len() != n {
            return shape("coordinates in a configuration", q.len(), n);
        }
        if let Some(j) = q.iter().position(|x| !x.is_finite()) {
            let coordinate = regions.coordinates.get(j).cloned().unwrap_or_default();
            return Err(GcsError::NotFinite { configuration_idx, coordinate, value: q[j] });
        }
    }
    let configurations: Vec<DVector<f64>> =
        configurations.iter().map(|q| DVector::from_column_slice(q)).collect();
    for (segment_idx, &mode) in modes.iter().enumerate() {
        let F = regions.manipulation.kept_forms(path_mode(mode));
        let (s, g) = (&configurations[segment_idx], &configurations[segment_idx + 1]);
        let difference = exact::leaf_distance(F, g, s);
        if difference > TOL_KEPT {
            return Err(GcsError::KeptForm { segment_idx, mode: mode.word(), difference });
        }
    }
    Ok(configurations)
}
