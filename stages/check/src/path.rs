//! A certified path: every piece is apart from collision by second-order bounds over intervals of its parameter.
//!
//! On [t_0, t_1] with middle m, all quantities in the interval's own parameter (length 1): gaps along the stored normal
//! are enclosed at t_0, m and t_1, M2 bounds the second derivative of each function whose least value the gap is, and
//! on each half the gap is at least a parabola; see [`least_on_half`].

mod at_parameter;
mod held;
mod motion_bound;

use crate::chain::{Side, Step};
use crate::interval::{self, Interval, Vec3};
use crate::region::asked_clearance;
use crate::{body, exact, pairs};
use at_parameter::{Stretch, Values};
use ipc_types::artefact::{
    CertifiedPiece, FrameChoice, Mode, PathCertificateFile, PathPair, SeparatedInterval,
};
use ipc_types::path_input::InputPiece;
use motion_bound::MotionBound;
use scene::{Scene, Shape, Task};
use serde::Serialize;
use std::collections::BTreeMap;

/// Why a path is not proven free.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PathError {
    /// The certificate and the scene or path do not fit.
    #[error("the certificate does not fit: {0}")]
    Foreign(String),
    /// A pair is missing, or is none of the scene.
    #[error("pair {pair_idx} of the certificate is not the scene's ({name_a} – {name_b} is expected)")]
    Pair {
        /// Position.
        pair_idx: usize,
        /// Body A.
        name_a: String,
        /// Body B.
        name_b: String,
    },
    /// Less clearance is claimed for a pair than for the path, or less than was asked for.
    #[error("{what}: a clearance of {found} m is certified, {asked} m are asked for")]
    Clearance {
        /// The pair, or the path.
        what: String,
        /// In the certificate.
        found: f64,
        /// Asked for.
        asked: f64,
    },
    /// The piece has no proof.
    #[error("piece {piece_idx} is not certified")]
    NotCertified {
        /// Piece.
        piece_idx: usize,
    },
    /// The piece itself is no motion of the scene.
    #[error("piece {piece_idx}: {problem}")]
    Piece {
        /// Piece.
        piece_idx: usize,
        /// What is wrong.
        problem: String,
    },
    /// What is held is not where the path has it.
    #[error(
        "{object} held by {gripper}: where that begins or ends it is up to {found:e} m from where the path has it, at most {asked:e} m are accepted"
    )]
    Held {
        /// The object's link.
        object: String,
        /// The gripper's.
        gripper: String,
        /// Upper bound of the distance.
        found: f64,
        /// Accepted.
        asked: f64,
    },
    /// An interval proves nothing.
    #[error("piece {piece_idx}, {name_a} – {name_b}, interval {interval_idx}: {problem}")]
    Interval {
        /// Piece.
        piece_idx: usize,
        /// Body A.
        name_a: String,
        /// Body B.
        name_b: String,
        /// Interval.
        interval_idx: usize,
        /// What is wrong.
        problem: String,
    },
}

/// What a path that passed has proven.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathVerdict {
    /// Pieces.
    pub n_pieces: usize,
    /// Pairs of bodies.
    pub n_pairs: usize,
    /// Intervals over all pieces and pairs.
    pub n_intervals: usize,
    /// Clearance of all pairs but those of a robot link with an object link, metres.
    pub clearance: f64,
    /// Largest change of a kept form while its mode lasts; `None` if the certificate names no task, or where no piece has
    /// a mode.
    pub kept_residual: Option<f64>,
    /// What is held, by what, on which pieces; nothing else is proven of an object's motion there.
    pub held: Vec<String>,
    /// Upper bound of how far what is held is from where the path has it when the holding begins or ends, metres;
    /// `None` if nothing is.
    pub held_residual: Option<f64>,
}

/// A body seen from a frame.
struct SeenBody {
    side: Side,
    bound: MotionBound,
    /// Upper bound of radius and inflation.
    radius: Interval,
}

/// Pairs of bodies in a scene, and both bodies of each seen from its frames.
struct Counted<'a> {
    scene: &'a Scene,
    pairs: &'a [PathPair],
    frames: Vec<Vec<[SeenBody; 2]>>,
}

impl<'a> Counted<'a> {
    /// `pairs` are exactly those that count in `scene`, each with the clearance that is due.
    fn new(scene: &'a Scene, pairs: &'a [PathPair], clearance: f64) -> Result<Self, PathError> {
        verify_pairs(scene, pairs, clearance)?;
        let of_pair = |pair: &PathPair| pair.frames.iter().map(|frame| seen(scene, pair, frame)).collect();
        let frames = pairs.iter().map(of_pair).collect::<Option<Vec<Vec<[SeenBody; 2]>>>>();
        let frames = frames.ok_or_else(|| {
            PathError::Foreign(
                "a frame is not a link of the scene, or drops what is not symmetric".to_owned(),
            )
        })?;
        Ok(Self { scene, pairs, frames })
    }

    /// Every pair is apart on the piece; returns the number of intervals.
    fn verify(
        &self,
        piece_idx: usize,
        control_points: &[Vec<f64>],
        intervals: &[Vec<SeparatedInterval>],
    ) -> Result<usize, PathError> {
        if intervals.len() != self.pairs.len() {
            return Err(PathError::NotCertified { piece_idx });
        }
        let (mut stretches, mut n_intervals) = (BTreeMap::new(), 0);
        for ((pair, frames), intervals) in self.pairs.iter().zip(&self.frames).zip(intervals) {
            let name = |body: u32| self.scene.bodies[body as usize].name.clone();
            verify_intervals(self.scene, pair, frames, control_points, intervals, &mut stretches).map_err(
                |(interval_idx, problem)| PathError::Interval {
                    piece_idx,
                    name_a: name(pair.body_a),
                    name_b: name(pair.body_b),
                    interval_idx,
                    problem,
                },
            )?;
            n_intervals += intervals.len();
        }
        Ok(n_intervals)
    }
}

/// Verifies the certificate of the path `pieces`. `least_clearance` is what the certificate must claim at the least,
/// metres; what is held may be `tol_held` metres from where the path has it when the holding begins or ends.
pub fn verify(
    scene: &Scene,
    certificate: &PathCertificateFile,
    pieces: &[InputPiece],
    least_clearance: f64,
    tol_held: f64,
) -> Result<PathVerdict, PathError> {
    let foreign = |what: &str| PathError::Foreign(what.to_owned());
    if certificate.coordinates.iter().ne(scene.coordinates.iter().map(|c| &c.name)) {
        return Err(foreign("its coordinates are not the scene's"));
    }
    let clearance = certificate.clearance;
    if !(clearance >= least_clearance && clearance.is_finite()) {
        let what = "the path".to_owned();
        return Err(PathError::Clearance { what, found: clearance, asked: least_clearance });
    }
    let task = match &certificate.task {
        Some(name) => {
            Some(scene.tasks.get(name).ok_or_else(|| foreign("it names a task that the scene has not"))?)
        }
        None => None,
    };
    let base = Counted::new(scene, &certificate.pairs, clearance)?;
    if certificate.pieces.len() != pieces.len() {
        return Err(foreign("it has another number of pieces than the path"));
    }
    let attachments = &certificate.attachments;
    let held_scenes = (0..attachments.len())
        .map(|idx| {
            let before = idx.checked_sub(1).map(|before| &attachments[before]);
            held::scene_of(scene, &attachments[idx], before, pieces.len())
        })
        .collect::<Result<Vec<Scene>, PathError>>()?;
    let held = attachments
        .iter()
        .zip(&held_scenes)
        .map(|(attachment, scene)| Counted::new(scene, &attachment.pairs, clearance))
        .collect::<Result<Vec<Counted<'_>>, PathError>>()?;
    let holds = |idx: usize, piece_idx: usize| {
        (attachments[idx].first as usize..=attachments[idx].last as usize).contains(&piece_idx)
    };
    let mut n_intervals = 0;
    for (piece_idx, (piece, given)) in certificate.pieces.iter().zip(pieces).enumerate() {
        let before = piece_idx.checked_sub(1).and_then(|idx| pieces[idx].control_points.last());
        verify_motion(scene, piece, given, before)
            .map_err(|problem| PathError::Piece { piece_idx, problem })?;
        let holding = (0..held.len()).find(|&idx| holds(idx, piece_idx));
        let counted = holding.map_or(&base, |idx| &held[idx]);
        n_intervals += counted.verify(piece_idx, &piece.control_points, &piece.intervals)?;
        if let Some(attachment) =
            holding.map(|idx| &attachments[idx]).filter(|a| a.first as usize == piece_idx)
        {
            // Where it begins the gripper and what it holds count against each other too; from then on they are rigid.
            let start = &piece.control_points[0];
            n_intervals += base.verify(piece_idx, &[start.clone(), start.clone()], &attachment.grasp)?;
        }
    }
    let mut held_residual = None;
    for (attachment, held_scene) in attachments.iter().zip(&held_scenes) {
        let found = held::displacement(scene, held_scene, attachment, pieces).unwrap_or(f64::INFINITY);
        if !(found <= tol_held) {
            let (object, gripper) = (attachment.object.clone(), attachment.gripper.clone());
            return Err(PathError::Held { object, gripper, found, asked: tol_held });
        }
        held_residual = Some(found.max(held_residual.unwrap_or(0.0)));
    }
    let is_free = |piece_idx: usize| !(0..held.len()).any(|idx| holds(idx, piece_idx));
    Ok(PathVerdict {
        n_pieces: pieces.len(),
        n_pairs: certificate.pairs.len(),
        n_intervals,
        clearance,
        kept_residual: task.and_then(|task| kept_residual(task, pieces, is_free)),
        held: attachments
            .iter()
            .map(|a| format!("{} by {} on pieces {} to {}", a.object, a.gripper, a.first, a.last))
            .collect(),
        held_residual,
    })
}

fn verify_pairs(scene: &Scene, pairs: &[PathPair], clearance: f64) -> Result<(), PathError> {
    let required = pairs::required_pairs(scene);
    for (pair_idx, &(a, b)) in required.iter().enumerate() {
        let name = |body: usize| scene.bodies[body].name.clone();
        let found = pairs.get(pair_idx);
        let Some(pair) = found.filter(|pair| (pair.body_a as usize, pair.body_b as usize) == (a, b)) else {
            return Err(PathError::Pair { pair_idx, name_a: name(a), name_b: name(b) });
        };
        let asked = asked_clearance(scene, a, b, clearance);
        if !(pair.clearance >= asked && pair.clearance.is_finite()) {
            let what = format!("{} – {}", name(a), name(b));
            return Err(PathError::Clearance { what, found: pair.clearance, asked });
        }
    }
    if pairs.len() != required.len() {
        return Err(PathError::Foreign("it has pairs that are none of the scene".to_owned()));
    }
    Ok(())
}

/// The piece is the given one, inside the joint limits, and begins where the one before it ended.
fn verify_motion(
    scene: &Scene,
    piece: &CertifiedPiece,
    given: &InputPiece,
    before: Option<&Vec<f64>>,
) -> Result<(), String> {
    // Numbers are compared, not bits: -0 is 0, and NaN is refused.
    if piece.control_points != given.control_points || piece.mode != given.mode {
        return Err("it is not the piece of the path".to_owned());
    }
    if piece.control_points.len() < 2 || piece.control_points.iter().any(|q| q.len() != scene.dim()) {
        return Err("it has fewer than 2 control points, or not one number a coordinate".to_owned());
    }
    for point in &piece.control_points {
        for (coordinate, q) in scene.coordinates.iter().zip(point) {
            if !(coordinate.lower <= *q && *q <= coordinate.upper) {
                return Err(format!("{} = {q} is outside its limits", coordinate.name));
            }
        }
    }
    match before {
        Some(before) if Some(before) != piece.control_points.first() => {
            Err("it does not begin where the piece before it ended".to_owned())
        }
        _ => Ok(()),
    }
}

/// Both bodies of `pair` seen from a frame.
fn seen(scene: &Scene, pair: &PathPair, frame: &FrameChoice) -> Option<[SeenBody; 2]> {
    let body = |body_idx: u32, n_dropped: u32| {
        let body_idx = body_idx as usize;
        let side = Side::new(scene, frame.link as usize, body_idx)?;
        let side = side.drop_rotations(scene, body_idx, n_dropped as usize)?;
        let shape = &scene.bodies[body_idx].shape;
        let bound = MotionBound::new(scene, &side.steps, shape)?;
        let radius = Interval::point(body::rounding_radius(shape)) + Interval::point(side.inflation);
        Some(SeenBody { side, bound, radius })
    };
    Some([body(pair.body_a, frame.n_dropped_a)?, body(pair.body_b, frame.n_dropped_b)?])
}

/// The intervals of one pair cover [0, 1] and separate the bodies on each; else the position of the one that does not.
fn verify_intervals(
    scene: &Scene,
    pair: &PathPair,
    frames: &[[SeenBody; 2]],
    control_points: &[Vec<f64>],
    intervals: &[SeparatedInterval],
    stretches: &mut BTreeMap<(u64, u64), Stretch>,
) -> Result<(), (usize, String)> {
    let mut at = 0.0;
    for (interval_idx, interval) in intervals.iter().enumerate() {
        let fail = |problem: String| (interval_idx, problem);
        if !(interval.t_0 == at && interval.t_0 < interval.t_1 && interval.t_1 <= 1.0) {
            return Err(fail(format!("[{}, {}] does not follow {at}", interval.t_0, interval.t_1)));
        }
        at = interval.t_1;
        let seen = frames.get(usize::from(interval.frame)).ok_or_else(|| fail("no such frame".to_owned()))?;
        let key = (interval.t_0.to_bits(), interval.t_1.to_bits());
        let stretch =
            stretches.entry(key).or_insert_with(|| Stretch::new(control_points, interval.t_0, interval.t_1));
        let shapes = [pair.body_a, pair.body_b].map(|body| &scene.bodies[body as usize].shape);
        let excess = least_excess(seen, shapes, stretch, interval.normal, pair.clearance);
        if !(excess > 0.0) {
            let missing = -excess;
            return Err(fail(format!(
                "the bodies are not proven apart on [{}, {}] (short by {missing:e} m)",
                interval.t_0, interval.t_1
            )));
        }
    }
    if at == 1.0 { Ok(()) } else { Err((intervals.len(), format!("nothing is proven from t = {at} on"))) }
}

/// Lower bound of (gap − clearance) · ‖n‖ over the stretch; NaN or minus infinity where nothing can be said.
fn least_excess(
    seen: &[SeenBody; 2],
    shapes: [&Shape; 2],
    stretch: &Stretch,
    normal: [f64; 3],
    clearance: f64,
) -> f64 {
    if !normal.iter().all(|x| x.is_finite()) {
        return f64::NEG_INFINITY;
    }
    let n = normal.map(Interval::point);
    let length = interval::norm(&n);
    if !(length.lo() > 0.0) {
        return f64::NEG_INFINITY;
    }
    let [a, b] = seen;
    let offset = length * (a.radius + b.radius + Interval::point(clearance));
    let excess_at = |values: &Values| {
        let a_least = least_value(&a.side.steps, shapes[0], values, &n);
        // max n·x over B is minus the least value of -n·x.
        let b_least = least_value(&b.side.steps, shapes[1], values, &n.map(|x| -x));
        (a_least + b_least - offset).lo()
    };
    let [g_0, g_m, g_1] = [0, 1, 2].map(|position| excess_at(&stretch.values[position]));
    let M2 = a.bound.second_order(&stretch.speed, &stretch.acceleration)
        + b.bound.second_order(&stretch.speed, &stretch.acceleration);
    let K = length * M2 * stretch.half.square();
    least_on_half(g_0, g_m, K).min(least_on_half(g_m, g_1, K))
}

/// Lower bound of a function on [0, 1] that is at least `g` and `h` at the ends and has a second derivative of at most
/// `K` in magnitude: of the parabola g + (h − g) s − K s (1 − s) / 2. Its least value over all s is
/// (g + h)/2 − K/8 − (h − g)²/(2 K); it lies outside (0, 1) if |h − g| ≥ K/2. It is at least min(g, h) − K/8 anyway.
fn least_on_half(g: f64, h: f64, K: Interval) -> f64 {
    let (half, eighth) = (Interval::point(0.5), Interval::point(0.125));
    let D = Interval::point(h) - Interval::point(g);
    let at_end = g.min(h);
    if D.abs().lo() >= (half * K).hi() {
        return at_end;
    }
    let coarse = (Interval::point(at_end) - eighth * K).lo();
    let vertex =
        half * (Interval::point(g) + Interval::point(h)) - eighth * K - half * D.square() * K.recip();
    // A comparison with NaN keeps the coarse bound.
    if vertex.lo() > coarse { vertex.lo() } else { coarse }
}

/// Enclosure of the least value of r·x over the core of a body at the end of `steps`.
fn least_value(steps: &[Step], shape: &Shape, values: &Values, r: &Vec3) -> Interval {
    let (r, d) = through(steps, values, r);
    d - body::core_support(shape, &r)
}

/// Row r' and offset d with r·x = r'·x_S + d for a point x_S at the end of `steps`.
fn through(steps: &[Step], values: &Values, r: &Vec3) -> (Vec3, Interval) {
    let (mut r, mut d) = (*r, Interval::ZERO);
    for step in steps {
        match step {
            Step::Fixed { R, p } => {
                d = d + interval::dot(&r, p);
                r = interval::row_times(&r, R);
            }
            Step::Turn { axis, sign, coordinate } => {
                let (sine, cosine) = values.sin_cos[*coordinate];
                // r R = c r + s (r × axis) + (1 − c) (r·axis) axis, the sign of the angle in s.
                let s = Interval::point(*sign) * sine;
                let along = (Interval::ONE - cosine) * interval::dot(&r, axis);
                let across = crate::chain::cross(&r, axis);
                r = std::array::from_fn(|i| cosine * r[i] + s * across[i] + along * axis[i]);
            }
            Step::Slide { axis, sign, coordinate } => {
                d = d + interval::dot(&r, axis) * Interval::point(*sign) * values.q[*coordinate];
            }
        }
    }
    (r, d)
}

/// Largest change of a kept form while its mode lasts, rounded up; over the pieces on which nothing is attached. `None`
/// where none of them has a mode.
fn kept_residual(task: &Task, pieces: &[InputPiece], is_free: impl Fn(usize) -> bool) -> Option<f64> {
    let mut largest: Option<f64> = None;
    let mut began: Option<(Mode, &Vec<f64>)> = None;
    for (piece_idx, piece) in pieces.iter().enumerate() {
        let Some(mode) = piece.mode.filter(|_| is_free(piece_idx)) else {
            began = None;
            continue;
        };
        if began.is_none_or(|(present, _)| present != mode) {
            began = piece.control_points.first().map(|q| (mode, q));
        }
        let Some((_, first)) = began else { continue };
        let mut change: f64 = 0.0;
        let forms = match mode {
            Mode::Transit => &task.transit_keep,
            Mode::Transfer => &task.transfer_keep,
        };
        for form in forms {
            for point in &piece.control_points {
                change = change.max(exact::difference(form.as_slice(), first, point));
            }
        }
        largest = Some(change.max(largest.unwrap_or(0.0)));
    }
    largest
}

#[cfg(test)]
mod tests;
