//! A whole path: joint limits, continuity, kept forms, and every piece against all pairs.

use super::held::{AttachRequest, Held, HeldError};
use super::kept_forms::KeptForms;
use super::model::PathCertifier;
use super::search::PathWorkspace;
use super::verdict::PieceVerdict;
use ipc_types::artefact::{CertifiedPiece, PathCertificateFile};
use ipc_types::path_input::InputPiece;
use scene::{Scene, Task};

/// Options of [`certify_path`].
#[derive(Debug, Clone, PartialEq)]
pub struct PathOptions {
    /// Distance to prove, metres, for all pairs but those of a robot link with an object link, which are proven not to
    /// touch. `None`: the task's, or 0 without a task.
    pub clearance: Option<f64>,
    /// How much a kept form may change while its mode lasts, in units of the form. Larger: accepts paths whose numbers
    /// were rounded when they were written, and grasps that slip by as much. The proof is of the path as given.
    pub tol_kept: f64,
    /// How far what was held may be, where the holding ends, from where the path puts it from there on, metres.
    /// Larger: accepts objects that slip by as much when they are released.
    pub tol_held: f64,
    /// Most halvings of a piece; see [`PathCertifier::max_depth`].
    pub max_depth: u32,
    /// Most intervals of a piece; see [`PathCertifier::max_intervals`].
    pub max_intervals: usize,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { clearance: None, tol_kept: 1e-9, tol_held: 1e-6, max_depth: 30, max_intervals: 10_000 }
    }
}

/// What is known of one piece.
#[derive(Debug, Clone, PartialEq)]
pub struct PieceReport {
    /// Whether it is certified, and if not, why.
    pub verdict: PieceVerdict,
    /// Intervals of the search; 0 where it was not begun.
    pub n_intervals: usize,
    /// Largest change of a kept form since the mode began; `None` where nothing is kept.
    pub kept_residual: Option<f64>,
    /// Where a holding ends with this piece: how far what was held is from where the path puts it, metres.
    pub held_residual: Option<f64>,
}

/// What is known of a path.
#[derive(Debug, Clone, PartialEq)]
pub struct CertifiedPath {
    /// One report a piece.
    pub pieces: Vec<PieceReport>,
    /// The proof of all certified pieces.
    pub certificate: PathCertificateFile,
}

impl CertifiedPath {
    /// Number of certified pieces.
    pub fn n_certified(&self) -> usize {
        self.pieces.iter().filter(|piece| piece.verdict.is_certified()).count()
    }

    /// Position of the first piece that is not certified.
    pub fn first_failure(&self) -> Option<usize> {
        self.pieces.iter().position(|piece| !piece.verdict.is_certified())
    }

    /// Largest change of a kept form.
    pub fn kept_residual(&self) -> Option<f64> {
        self.pieces.iter().filter_map(|piece| piece.kept_residual).reduce(f64::max)
    }

    /// Furthest that something held is from where the path puts it when it is released, metres.
    pub fn held_residual(&self) -> Option<f64> {
        self.pieces.iter().filter_map(|piece| piece.held_residual).reduce(f64::max)
    }
}

/// Certifies all of `pieces`, whose coordinates are in the scene's order. With a task its clearance and the forms that
/// it keeps in each piece's mode hold.
///
/// The path gives every coordinate, the object's too: that the object is held means that the forms are kept, so the
/// proof covers the object where the path puts it. For objects that follow a gripper see [`certify_held_path`].
pub fn certify_path(
    scene: &Scene,
    task: Option<&Task>,
    pieces: &[InputPiece],
    options: &PathOptions,
) -> CertifiedPath {
    certify_pieces(scene, task, pieces, options, &[], &base_certifier(scene, task, options))
}

/// As [`certify_path`], with links of objects that move with a gripper on some pieces. On these no form has to be kept:
/// what is held is rigid on its gripper, whatever the path says of its own coordinates.
pub fn certify_held_path(
    scene: &Scene,
    task: Option<&Task>,
    pieces: &[InputPiece],
    options: &PathOptions,
    attach: &[AttachRequest],
) -> Result<CertifiedPath, HeldError> {
    let held = Held::all(scene, pieces, attach, |attached| base_certifier(attached, task, options))?;
    Ok(certify_pieces(scene, task, pieces, options, &held, &base_certifier(scene, task, options)))
}

fn clearance_of(task: Option<&Task>, options: &PathOptions) -> f64 {
    options.clearance.or(task.map(|task| task.clearance)).unwrap_or(0.0)
}

fn base_certifier(scene: &Scene, task: Option<&Task>, options: &PathOptions) -> PathCertifier {
    let clearance = clearance_of(task, options);
    let mut certifier = PathCertifier::new(scene, |pair| {
        // Bodies that come into contact by design are proven not to penetrate.
        if scene.is_contact_pair(pair) { 0.0 } else { clearance }
    });
    certifier.max_depth = options.max_depth;
    certifier.max_intervals = options.max_intervals;
    certifier
}

fn certify_pieces(
    scene: &Scene,
    task: Option<&Task>,
    pieces: &[InputPiece],
    options: &PathOptions,
    held: &[Held],
    base: &PathCertifier,
) -> CertifiedPath {
    let mut workspace = PathWorkspace::default();
    let mut kept_forms = task.map(KeptForms::new);
    let mut at: Option<&Vec<f64>> = None;
    let mut reports = Vec::with_capacity(pieces.len());
    let mut certified = Vec::with_capacity(pieces.len());
    let mut attachments = Vec::with_capacity(held.len());
    for (piece_idx, piece) in pieces.iter().enumerate() {
        let points = &piece.control_points;
        let holding = held.iter().find(|held| (held.first..=held.last).contains(&piece_idx));
        // A form that is kept ties the object's coordinates, which say nothing while it is held.
        let mode = if holding.is_some() { None } else { piece.mode };
        let kept = kept_forms.as_mut().and_then(|forms| forms.next_piece(mode, points));
        let flaw = outside_limits(scene, points).or_else(|| jump(at, points)).or_else(|| {
            kept.filter(|kept| !(kept.residual <= options.tol_kept))
                .map(|kept| PieceVerdict::NotKept { form_idx: kept.form_idx, residual: kept.residual })
        });
        let begins = holding.filter(|held| held.first == piece_idx);
        let grasp = begins.zip(points.first()).and_then(|(held, start)| {
            let (attachment, flaw) = held.attachment(base, start, &mut workspace);
            attachments.push(attachment);
            flaw
        });
        // At the end of the path nobody asks where it is put.
        let ends = holding.filter(|held| held.last == piece_idx && piece_idx + 1 < pieces.len());
        let held_residual = ends.zip(points.last()).map(|(held, q)| held.displacement(q));
        let flaw = flaw.or(grasp).or_else(|| {
            held_residual
                .filter(|distance| !(*distance <= options.tol_held))
                .map(|distance| PieceVerdict::Released { distance })
        });
        let kept_residual = kept.map(|kept| kept.residual);
        let mut proof = Vec::new();
        let (verdict, n_intervals) = match flaw {
            Some(verdict) => (verdict, 0),
            None => {
                let certifier = holding.map_or(base, |held| &held.certifier);
                let verdict = certifier.certify_piece(points, &mut workspace);
                if verdict.is_certified() {
                    proof = workspace.proof(certifier.n_pairs());
                }
                (verdict, workspace.n_intervals)
            }
        };
        reports.push(PieceReport { verdict, n_intervals, kept_residual, held_residual });
        certified.push(CertifiedPiece { mode: piece.mode, control_points: points.clone(), intervals: proof });
        at = points.last();
    }
    let certificate = PathCertificateFile {
        coordinates: scene.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect(),
        task: task.map(|task| task.name.clone()),
        clearance: clearance_of(task, options),
        pairs: base.certificate_pairs(),
        attachments,
        pieces: certified,
    };
    CertifiedPath { pieces: reports, certificate }
}

fn outside_limits(scene: &Scene, points: &[Vec<f64>]) -> Option<PieceVerdict> {
    points.iter().enumerate().find_map(|(point_idx, point)| {
        let outside =
            scene.coordinates.iter().zip(point).position(|(c, q)| !(c.lower <= *q && *q <= c.upper));
        outside.map(|coordinate_idx| PieceVerdict::OutsideLimits {
            point_idx,
            coordinate_idx,
            value: point[coordinate_idx],
        })
    })
}

fn jump(at: Option<&Vec<f64>>, points: &[Vec<f64>]) -> Option<PieceVerdict> {
    let distances = at?.iter().zip(points.first()?).map(|(a, b)| (a - b).abs());
    let (coordinate_idx, distance) = distances.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (distance > 0.0).then_some(PieceVerdict::Jump { coordinate_idx, distance })
}
