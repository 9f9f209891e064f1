//! Whether the motion of a run is what its task asks for. Failures are values.
//!
//! Joint limits, mode constraints at every control point, continuity, start and goal, every control point in its
//! certified region and its space, grasps and releases in CG ∩ CP, and a dense collision check by the collision
//! library, which shares nothing with the certifier.

use collision::CollisionChecker;
use convex_sets::HPolyhedron;
use ipc_types::artefact::{Mode, PlanFile, Region, RegionsFile, TrajectoryFile};
use ipc_types::store::{find_artefact, read_artefact};
use ipc_types::validate;
use manipulation::{contains_exactly, polytope_of_space};
use nalgebra::DVector;
use scene::{LinearForm, Scene, Task};
use stage_kit::StageError;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

/// Largest change of a kept form along a segment, relative to the size of its terms: rounding of the sum of a few
/// coordinates. Erring side: accepts a drift far below any geometry.
pub const TOL_KEPT: f64 = 1e-12;
/// Between two samples of the collision check bodies move by at most this, metres.
pub const SAMPLING_STEP: f64 = 1e-3;
/// Samples of a curved piece between two of its ends that the collision check joins by straight lines.
const SAMPLES_PER_CURVE: usize = 64;

/// Arguments of `regrasp-certify accept`.
#[derive(Debug, Clone, clap::Args)]
pub struct AcceptArgs {
    /// Scene folder, or its `scene.toml`.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Run directory.
    #[arg(long, alias = "in", value_name = "DIR")]
    pub run: PathBuf,
    /// Task of the scene; a single one needs no choice.
    #[arg(long)]
    pub task: Option<String>,
    /// Distance to keep between bodies, metres. Default: the task's.
    #[arg(long, value_name = "M")]
    pub clearance: Option<f64>,
}

/// A rule that the motion breaks.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// Segment, piece and control point, as far as they matter.
    pub place: Place,
    /// What is wrong.
    pub problem: String,
}

/// Where in the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// All of it.
    Motion,
    /// A segment.
    Segment(usize),
    /// A piece of a segment.
    Piece(usize, usize),
    /// A control point of a piece of a segment.
    Point(usize, usize, usize),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::Motion => write!(f, "{}", self.problem),
            Place::Segment(s) => write!(f, "segment {s}: {}", self.problem),
            Place::Piece(s, p) => write!(f, "segment {s}, piece {p}: {}", self.problem),
            Place::Point(s, p, c) => write!(f, "segment {s}, piece {p}, control point {c}: {}", self.problem),
        }
    }
}

/// What the check found.
#[derive(Debug, Clone, PartialEq)]
pub struct Acceptance {
    /// Broken rules, in the order of the motion.
    pub failures: Vec<Failure>,
    /// Segments looked at.
    pub n_segments: usize,
    /// Control points looked at.
    pub n_points: usize,
    /// Whether all regions on the way are certified.
    pub is_certified: bool,
}

impl Acceptance {
    /// In a line.
    pub fn words(&self) -> String {
        let certified =
            if self.is_certified { "in certified regions" } else { "in regions that are not certified" };
        format!("accepted: {} segments, {} control points, {certified}", self.n_segments, self.n_points)
    }
}

/// The parts of a run that the check reads.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// The regions that pieces name.
    pub regions: &'a [Region],
    /// The grasp plan, if there is one.
    pub plan: Option<&'a PlanFile>,
    /// The motion.
    pub trajectory: &'a TrajectoryFile,
}

/// Reads a run and checks its motion.
pub fn accept_run(args: &AcceptArgs) -> Result<Acceptance, StageError> {
    let scene = Scene::load(&args.scene).map_err(StageError::bad_input)?;
    let mut task = scene.task(args.task.as_deref()).map_err(StageError::bad_input)?.clone();
    if let Some(clearance) = args.clearance {
        task.clearance = clearance;
    }
    let digest = Some(&scene.digest);
    let names: Vec<String> = scene.coordinates.iter().map(|c| c.name.clone()).collect();
    let regions: RegionsFile =
        read_artefact(&args.run.join("certify"), "regions", digest).map_err(StageError::bad_input)?;
    validate::regions(&regions, &names).map_err(StageError::bad_input)?;
    let plan: Option<PlanFile> =
        find_artefact(&args.run.join("miqp"), "plan", digest).map_err(StageError::bad_input)?;
    if let Some(plan) = &plan {
        validate::plan(plan, scene.dim()).map_err(StageError::bad_input)?;
    }
    let trajectory: TrajectoryFile =
        read_artefact(&args.run.join("gcs"), "trajectory", digest).map_err(StageError::bad_input)?;
    for segment in &trajectory.segments {
        validate::segment(segment, scene.dim()).map_err(StageError::bad_input)?;
    }
    let motion = Motion { regions: &regions.regions, plan: plan.as_ref(), trajectory: &trajectory };
    accept(&scene, &task, &motion).map_err(StageError::bad_input)
}

/// Checks `motion` against `task`. An error only for a region that is malformed.
pub fn accept(scene: &Scene, task: &Task, motion: &Motion<'_>) -> Result<Acceptance, wire::RegionError> {
    let mut regions = BTreeMap::new();
    for region in motion.regions {
        regions.insert(region.id, wire::Region::from_artefact(region, scene.dim())?);
    }
    let mut check = Check { scene, task, regions, acceptance: Acceptance::new(motion) };
    check.ends(motion);
    check.points(motion);
    check.agreement(motion);
    check.collisions(motion);
    Ok(check.acceptance)
}

impl Acceptance {
    fn new(motion: &Motion<'_>) -> Self {
        let pieces = motion.trajectory.segments.iter().flat_map(|segment| &segment.pieces);
        Self {
            failures: Vec::new(),
            n_segments: motion.trajectory.segments.len(),
            n_points: pieces.map(Vec::len).sum(),
            is_certified: true,
        }
    }
}

struct Check<'a> {
    scene: &'a Scene,
    task: &'a Task,
    regions: BTreeMap<u64, wire::Region>,
    acceptance: Acceptance,
}

impl Check<'_> {
    fn fail(&mut self, place: Place, problem: impl Into<String>) {
        self.acceptance.failures.push(Failure { place, problem: problem.into() });
    }

    /// The motion begins at the start and ends at the goal; no motion is right where they are the same.
    fn ends(&mut self, motion: &Motion<'_>) {
        let pieces: Vec<&Vec<Vec<f64>>> =
            motion.trajectory.segments.iter().flat_map(|segment| &segment.pieces).collect();
        let (start, goal) = (self.task.start.as_slice(), self.task.goal.as_slice());
        let first = pieces.first().and_then(|piece| piece.first());
        let last = pieces.last().and_then(|piece| piece.last());
        match (first, last) {
            (Some(first), Some(last)) => {
                if first.as_slice() != start {
                    self.fail(
                        Place::Motion,
                        format!("the motion begins at {first:?}, not at the start {start:?}"),
                    );
                }
                if last.as_slice() != goal {
                    self.fail(
                        Place::Motion,
                        format!("the motion ends at {last:?}, not at the goal {goal:?}"),
                    );
                }
            }
            _ if start == goal => {}
            _ => self.fail(Place::Motion, "there is no motion, but start and goal differ"),
        }
    }

    /// Continuity, joint limits, spaces, kept forms and regions, at every control point.
    fn points(&mut self, motion: &Motion<'_>) {
        let limits = HPolyhedron::from_box(&self.scene.lower(), &self.scene.upper());
        let [grasp, placement] = [&self.task.grasp, &self.task.placement].map(polytope_of_space);
        let mut previous: Option<Vec<f64>> = None;
        let n_segments = motion.trajectory.segments.len();
        for (s, segment) in motion.trajectory.segments.iter().enumerate() {
            let expected = if s % 2 == 0 { Mode::Transit } else { Mode::Transfer };
            if segment.mode != expected {
                self.fail(Place::Segment(s), "modes do not alternate, beginning with transit");
            }
            if segment.regions.len() != segment.pieces.len() {
                self.fail(Place::Segment(s), "its pieces and the regions it names differ in number");
            }
            let (space, name, keep) = match segment.mode {
                Mode::Transit => (&placement, "CP", &self.task.transit_keep),
                Mode::Transfer => (&grasp, "CG", &self.task.transfer_keep),
            };
            let keep: Vec<LinearForm> = keep.clone();
            let begin = segment.pieces.first().and_then(|piece| piece.first()).cloned();
            for (p, piece) in segment.pieces.iter().enumerate() {
                if previous.is_some() && previous.as_ref() != piece.first() {
                    self.fail(Place::Piece(s, p), "it does not begin where the motion before it ended");
                }
                previous = piece.last().cloned();
                let region = segment.regions.get(p).and_then(|id| self.regions.get(id)).cloned();
                match &region {
                    None => self.fail(Place::Piece(s, p), "its region does not exist"),
                    Some(region) => {
                        self.acceptance.is_certified &= region.certified;
                        if segment.certified && !region.certified {
                            self.fail(Place::Piece(s, p), format!("region {} is not certified", region.id));
                        }
                    }
                }
                for (c, point) in piece.iter().enumerate() {
                    let place = Place::Point(s, p, c);
                    let q = DVector::from_column_slice(point);
                    if !contains_exactly(&limits, &q) {
                        self.fail(place, "outside the joint limits");
                    }
                    if !contains_exactly(space, &q) {
                        self.fail(place, format!("outside {name}"));
                    }
                    if let Some(region) = &region
                        && !contains_exactly(&region.polyhedron, &q)
                    {
                        self.fail(place, format!("outside region {}", region.id));
                    }
                    for (form_idx, form) in keep.iter().enumerate() {
                        let drift = begin.as_ref().map_or(0.0, |begin| drift(form, begin, point));
                        if !(drift <= TOL_KEPT) {
                            let mode = if segment.mode == Mode::Transit { "transit" } else { "transfer" };
                            self.fail(
                                place,
                                format!("kept form {form_idx} of the {mode} drifts by {drift:e}"),
                            );
                        }
                    }
                }
            }
            // Between two segments the object is grasped or released.
            if s + 1 < n_segments
                && let Some(q) = &previous
            {
                let q = DVector::from_column_slice(q);
                if !(contains_exactly(&grasp, &q) && contains_exactly(&placement, &q)) {
                    self.fail(
                        Place::Segment(s),
                        "it ends outside CG ∩ CP, where nothing can be grasped or released",
                    );
                }
            }
        }
        if n_segments > 0 && n_segments.is_multiple_of(2) {
            self.fail(Place::Motion, "the motion ends while the object is held");
        }
    }

    /// The trajectory passes the configurations of the plan.
    fn agreement(&mut self, motion: &Motion<'_>) {
        let Some(configurations) = motion.plan.and_then(|plan| plan.configurations.as_ref()) else { return };
        let segments = &motion.trajectory.segments;
        if segments.is_empty() && self.task.start == self.task.goal {
            return;
        }
        if configurations.len() != segments.len() + 1 {
            let problem = format!(
                "the plan has {} configurations, the motion {} segments",
                configurations.len(),
                segments.len()
            );
            self.fail(Place::Motion, problem);
            return;
        }
        for (s, segment) in segments.iter().enumerate() {
            let first = segment.pieces.first().and_then(|piece| piece.first());
            let last = segment.pieces.last().and_then(|piece| piece.last());
            for (end, configuration) in [(first, &configurations[s]), (last, &configurations[s + 1])] {
                let difference = end.map_or(f64::INFINITY, |end| {
                    end.iter().zip(configuration).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
                });
                if !(difference <= TOL_PLAN) {
                    self.fail(
                        Place::Segment(s),
                        format!("an end is {difference:e} away from the plan's configuration"),
                    );
                }
            }
        }
    }

    /// Samples of the whole motion are free, by the collision library.
    fn collisions(&mut self, motion: &Motion<'_>) {
        let checker = CollisionChecker::for_task(self.scene, self.task);
        for (s, segment) in motion.trajectory.segments.iter().enumerate() {
            for (p, piece) in segment.pieces.iter().enumerate() {
                let polyline = polyline(piece);
                if let Some(hit) = checker.path_first_collision(&polyline, SAMPLING_STEP) {
                    let name = |body: usize| self.scene.bodies[body].name.clone();
                    let problem = format!(
                        "{} – {} collide at {:?}",
                        name(hit.pair.body_a),
                        name(hit.pair.body_b),
                        hit.q
                    );
                    self.fail(Place::Piece(s, p), problem);
                }
            }
        }
    }
}

/// How far an end of a segment may be from the plan's configuration: paths are made exact within their leaf.
const TOL_PLAN: f64 = 1e-8;

/// |f·a − f·b| relative to the size of the terms, at least 1.
fn drift(form: &LinearForm, a: &[f64], b: &[f64]) -> f64 {
    let mut difference = 0.0;
    let mut size = 1.0_f64;
    for (f, (a, b)) in form.iter().zip(a.iter().zip(b)) {
        difference += f * (a - b);
        size = size.max((f * a).abs()).max((f * b).abs());
    }
    difference.abs() / size
}

/// A straight piece as it is; samples of a curved one (de Casteljau).
fn polyline(piece: &[Vec<f64>]) -> Vec<Vec<f64>> {
    if piece.len() <= 2 {
        return piece.to_vec();
    }
    (0..=SAMPLES_PER_CURVE)
        .map(|k| {
            let t = k as f64 / SAMPLES_PER_CURVE as f64;
            let mut points = piece.to_vec();
            while points.len() > 1 {
                points = points
                    .windows(2)
                    .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| a + t * (b - a)).collect())
                    .collect();
            }
            points.pop().unwrap_or_default()
        })
        .collect()
}

#[cfg(test)]
mod tests;
