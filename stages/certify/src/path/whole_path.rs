//! A whole path: joint limits, continuity, kept forms, and every piece against all pairs.

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
    /// Most halvings of a piece; see [`PathCertifier::max_depth`].
    pub max_depth: u32,
    /// Most intervals of a piece; see [`PathCertifier::max_intervals`].
    pub max_intervals: usize,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { clearance: None, tol_kept: 1e-9, max_depth: 30, max_intervals: 10_000 }
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
}

/// Certifies all of `pieces`, whose coordinates are in the scene's order. With a task its clearance and the forms that
/// it keeps in each piece's mode hold.
///
/// The path gives every coordinate, the object's too: that the object is held means that the forms are kept, so the
/// proof covers the object where the path puts it.
pub fn certify_path(
    scene: &Scene,
    task: Option<&Task>,
    pieces: &[InputPiece],
    options: &PathOptions,
) -> CertifiedPath {
    let clearance = options.clearance.or(task.map(|task| task.clearance)).unwrap_or(0.0);
    let mut certifier = PathCertifier::new(scene, |pair| {
        // Bodies that come into contact by design are proven not to penetrate.
        if scene.is_contact_pair(pair) { 0.0 } else { clearance }
    });
    certifier.max_depth = options.max_depth;
    certifier.max_intervals = options.max_intervals;
    let mut workspace = PathWorkspace::default();
    let mut kept_forms = task.map(KeptForms::new);
    let mut at: Option<&Vec<f64>> = None;
    let mut reports = Vec::with_capacity(pieces.len());
    let mut certified = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let points = &piece.control_points;
        let kept = kept_forms.as_mut().and_then(|forms| forms.next_piece(piece.mode, points));
        let flaw = outside_limits(scene, points).or_else(|| jump(at, points)).or_else(|| {
            kept.filter(|kept| !(kept.residual <= options.tol_kept))
                .map(|kept| PieceVerdict::NotKept { form_idx: kept.form_idx, residual: kept.residual })
        });
        let kept_residual = kept.map(|kept| kept.residual);
        let mut proof = Vec::new();
        let report = match flaw {
            Some(verdict) => PieceReport { verdict, n_intervals: 0, kept_residual },
            None => {
                let verdict = certifier.certify_piece(points, &mut workspace);
                if verdict.is_certified() {
                    proof = workspace.proof(certifier.n_pairs());
                }
                PieceReport { verdict, n_intervals: workspace.n_intervals, kept_residual }
            }
        };
        reports.push(report);
        certified.push(CertifiedPiece { mode: piece.mode, control_points: points.clone(), intervals: proof });
        at = points.last();
    }
    let certificate = PathCertificateFile {
        coordinates: scene.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect(),
        task: task.map(|task| task.name.clone()),
        clearance,
        pairs: certifier.certificate_pairs(),
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
