//! `regrasp-certify path SCENE PATH`: certifies the path of any planner.

use certificates::path::{
    AttachRequest, CertifiedPath, Obstruction, PathOptions, PieceVerdict, TOL_GAP, certify_held_path,
};
use ipc_types::artefact::Attachment;
use ipc_types::path_input::{self, InputPiece};
use ipc_types::store;
use scene::{Scene, Task};
use serde::Serialize;
use stage_kit::{Outcome, StageError};
use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `path`.
#[derive(Debug, Clone, clap::Args)]
pub struct PathArgs {
    /// Scene folder, or its `scene.toml`.
    pub scene: PathBuf,
    /// A table with every coordinate of the scene by name, optionally `t` and `mode`, rows joined by straight lines; or
    /// Bézier pieces as a `trajectory.json`.
    pub path: PathBuf,
    /// Task whose clearance holds, and whose kept forms say in each mode what is held. Without it nothing is held.
    #[arg(long, value_name = "T")]
    pub task: Option<String>,
    /// Distance to prove, metres, for all pairs but those of a robot link with an object link, which are proven not to
    /// touch. Default: the task's, or 0.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    pub clearance: Option<f64>,
    /// How much a kept form may change while its mode lasts.
    #[arg(long, value_name = "R", value_parser = not_negative, default_value_t = PathOptions::default().tol_kept)]
    pub tol_kept: f64,
    /// What a gripper holds on which pieces (numbered from 0, both ends included; without LAST to the end of the path):
    /// the object's link moves rigidly with the gripper's from where piece FIRST begins, whatever the path says of its own
    /// coordinates; no form need be kept there. It counts against all bodies but those rigid on the gripper's link, which
    /// are proven free where the holding begins, and those that a joint of the scene joins to it. Repeat for more.
    #[arg(long, value_name = "OBJECT_LINK=GRIPPER_LINK@FIRST..LAST")]
    pub attach: Vec<AttachRequest>,
    /// How far from where the path puts it what was held may be when it is released, metres.
    #[arg(long, value_name = "M", value_parser = not_negative, default_value_t = PathOptions::default().tol_held)]
    pub tol_held: f64,
    /// Most halvings of a piece before it is undecided.
    #[arg(long, value_name = "N", default_value_t = PathOptions::default().max_depth)]
    pub max_depth: u32,
    /// Most intervals of a piece before it is undecided.
    #[arg(long, value_name = "N", default_value_t = PathOptions::default().max_intervals)]
    pub max_intervals: usize,
    /// Folder for the certificate (`path.bin`, `path.json`), for `regrasp-check --path`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the verdict on every piece as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1e9).contains(&value) => Ok(value),
        _ => Err("expected a number from 0 to 1e9".into()),
    }
}

/// Certifies the path; machine output goes to `out`. Whether all pieces are certified is the outcome, its words name
/// the first that is not.
pub fn run(args: &PathArgs, out: &mut dyn Write) -> Result<Outcome, StageError> {
    let scene = Scene::load(&args.scene).map_err(StageError::bad_input)?;
    let task = args.task.as_deref().map(|name| scene.task(Some(name))).transpose();
    let task = task.map_err(StageError::bad_input)?;
    let names: Vec<String> = scene.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect();
    let pieces = path_input::read(&args.path, &names).map_err(StageError::bad_input)?;
    let options = PathOptions {
        clearance: args.clearance,
        tol_kept: args.tol_kept,
        tol_held: args.tol_held,
        max_depth: args.max_depth,
        max_intervals: args.max_intervals,
    };
    let certified =
        certify_held_path(&scene, task, &pieces, &options, &args.attach).map_err(StageError::bad_input)?;
    if let Some(folder) = &args.out {
        store::write_artefact(folder, "path", &certified.certificate, &scene.digest)
            .map_err(StageError::failed)?;
    }
    let report = Report::new(&scene, task, &pieces, &certified);
    if args.json {
        let text = ipc_types::json::to_text(&report).map_err(StageError::failed)?;
        // A closed pipe is the reader's choice.
        let _ = out.write_all(&text);
    }
    Ok(if report.certified { Outcome::Done(report.summary) } else { Outcome::Negative(report.summary) })
}

/// What `--json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Report {
    certified: bool,
    summary: String,
    n_pieces: usize,
    n_certified: usize,
    n_pairs: usize,
    clearance: f64,
    task: Option<String>,
    /// Largest change of a kept form; `null` where nothing is kept.
    kept_residual: Option<f64>,
    /// What is held on which pieces.
    attached: Vec<String>,
    /// Furthest that something held is from where the path puts it when released, metres; `null` where nothing is.
    held_residual: Option<f64>,
    /// Pairs that the scene excludes.
    excluded: Vec<[String; 2]>,
    first_failure: Option<usize>,
    pieces: Vec<PieceLine>,
}

/// One piece of the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct PieceLine {
    place: String,
    verdict: &'static str,
    n_intervals: usize,
    kept_residual: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    obstruction: Option<ObstructionLine>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

/// Where a pair is in the way.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct ObstructionLine {
    t: f64,
    q: Vec<f64>,
    body_a: String,
    body_b: String,
    gap: f64,
    clearance: f64,
}

impl Report {
    fn new(scene: &Scene, task: Option<&Task>, pieces: &[InputPiece], certified: &CertifiedPath) -> Report {
        let lines: Vec<PieceLine> = pieces
            .iter()
            .zip(&certified.pieces)
            .map(|(piece, report)| PieceLine {
                place: piece.place.clone(),
                verdict: word(&report.verdict),
                n_intervals: report.n_intervals,
                kept_residual: report.kept_residual,
                obstruction: obstruction(&report.verdict).map(|found| ObstructionLine::new(scene, found)),
                reason: reason(scene, task, piece, &report.verdict),
            })
            .collect();
        let first_failure = certified.first_failure();
        let (n_pieces, n_certified) = (lines.len(), certified.n_certified());
        let n_pairs = certified.certificate.pairs.len();
        let clearance = certified.certificate.clearance;
        let mut summary = format!("{n_certified} of {n_pieces} pieces certified against {n_pairs} pairs");
        // Writing to a string does not fail.
        let _ = write!(summary, " with a clearance of {clearance} m");
        if let Some(residual) = certified.kept_residual() {
            let _ = write!(summary, ", kept forms change by at most {residual:e}");
        } else if task.is_some() && pieces.iter().all(|piece| piece.mode.is_none()) {
            let _ = write!(summary, "; the path has no mode, so no kept form was checked");
        }
        let attached: Vec<String> = certified.certificate.attachments.iter().map(held_words).collect();
        if !attached.is_empty() {
            let _ = write!(summary, "; held: {}", attached.join(", "));
        }
        if let Some(residual) = certified.held_residual() {
            let _ = write!(summary, ", put down within {residual:e} m of where the path has it");
        }
        if let Some((piece_idx, line)) = first_failure.and_then(|idx| Some((idx, lines.get(idx)?))) {
            let reason = line.reason.as_deref().unwrap_or(line.verdict);
            let _ = write!(summary, "; the first that is not: piece {piece_idx} ({}): {reason}", line.place);
        }
        let name = |link_idx: usize| scene.links[link_idx].name.clone();
        if !scene.excluded_links.is_empty() {
            let pairs: Vec<String> =
                scene.excluded_links.iter().map(|&(a, b)| format!("{} - {}", name(a), name(b))).collect();
            let _ = write!(summary, "; excluded by the scene: {}", pairs.join(", "));
        }
        Report {
            certified: first_failure.is_none(),
            summary,
            n_pieces,
            n_certified,
            n_pairs,
            clearance,
            task: task.map(|task| task.name.clone()),
            kept_residual: certified.kept_residual(),
            attached,
            held_residual: certified.held_residual(),
            excluded: scene.excluded_links.iter().map(|&(a, b)| [name(a), name(b)]).collect(),
            first_failure,
            pieces: lines,
        }
    }
}

impl ObstructionLine {
    fn new(scene: &Scene, found: &Obstruction) -> Self {
        Self {
            t: found.t,
            q: found.q.clone(),
            body_a: scene.bodies[found.pair.body_a].name.clone(),
            body_b: scene.bodies[found.pair.body_b].name.clone(),
            gap: found.gap,
            clearance: found.clearance,
        }
    }
}

fn held_words(attachment: &Attachment) -> String {
    let Attachment { object, gripper, first, last, .. } = attachment;
    format!("{object} by {gripper} on pieces {first} to {last}")
}

fn word(verdict: &PieceVerdict) -> &'static str {
    match verdict {
        PieceVerdict::Certified => "certified",
        PieceVerdict::Collision(_) => "collision",
        PieceVerdict::Touching(_) => "touching",
        PieceVerdict::Undecided(_) => "undecided",
        PieceVerdict::OutsideLimits { .. } => "outside-limits",
        PieceVerdict::Jump { .. } => "jump",
        PieceVerdict::Released { .. } => "released-elsewhere",
        PieceVerdict::NotKept { .. } => "not-kept",
    }
}

fn obstruction(verdict: &PieceVerdict) -> Option<&Obstruction> {
    match verdict {
        PieceVerdict::Collision(found) | PieceVerdict::Touching(found) | PieceVerdict::Undecided(found) => {
            Some(found)
        }
        _ => None,
    }
}

/// Why a piece is not certified, for people.
fn reason(scene: &Scene, task: Option<&Task>, piece: &InputPiece, verdict: &PieceVerdict) -> Option<String> {
    let at = |found: &Obstruction| {
        let name = |body_idx: usize| &scene.bodies[body_idx].name;
        let q: Vec<String> = found.q.iter().map(f64::to_string).collect();
        let pair = format!("{} and {}", name(found.pair.body_a), name(found.pair.body_b));
        (pair, format!("at t = {}, q = [{}]", found.t, q.join(", ")))
    };
    let coordinate = |coordinate_idx: usize| scene.coordinates[coordinate_idx].name.as_str();
    Some(match verdict {
        PieceVerdict::Certified => return None,
        PieceVerdict::Collision(found) if found.gap < 0.0 => {
            let (pair, place) = at(found);
            format!("{pair} overlap by {} m {place}", -found.gap)
        }
        PieceVerdict::Collision(found) => {
            let (pair, place) = at(found);
            format!("{pair} are {} m apart, asked for are {} m, {place}", found.gap, found.clearance)
        }
        PieceVerdict::Touching(found) => {
            let (pair, place) = at(found);
            format!(
                "{pair} are at their clearance of {} m within {:e} m {place}: neither provably apart nor closer; \
                 keep a gap of {:e} m or more",
                found.clearance,
                TOL_GAP,
                10.0 * TOL_GAP
            )
        }
        PieceVerdict::Undecided(found) => {
            let (pair, place) = at(found);
            format!("undecided: {pair} pass within {} m {place}; raise --max-intervals", found.gap)
        }
        PieceVerdict::OutsideLimits { point_idx, coordinate_idx, value } => {
            let limits = &scene.coordinates[*coordinate_idx];
            format!(
                "control point {point_idx}: {} = {value} is outside its limits [{}, {}]",
                limits.name, limits.lower, limits.upper
            )
        }
        PieceVerdict::Jump { coordinate_idx, distance } => format!(
            "it does not begin where the piece before it ended: {} jumps by {distance:e}",
            coordinate(*coordinate_idx)
        ),
        PieceVerdict::Released { distance } => format!(
            "what is held is {distance:e} m from where the path puts it from its end on; give its coordinates there as \
             they are, or raise --tol-held"
        ),
        PieceVerdict::NotKept { form_idx, residual } => {
            let mode = piece.mode.map_or("its mode", |mode| mode.word());
            let task = task.map_or("", |task| task.name.as_str());
            format!("form {form_idx} that task {task} keeps in {mode} changes by {residual:e}")
        }
    })
}
