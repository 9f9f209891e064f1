//! What is attached to the gripper on which pieces of a path (`--attach`).
//!
//! While a link of the object is held it moves rigidly with the gripper's, with the pose that the path gives it where
//! the holding begins; its own coordinates say nothing meanwhile. Where the holding ends it must be where the path puts
//! it from there on, but for a tolerance.

use super::model::PathCertifier;
use super::search::PathWorkspace;
use super::verdict::PieceVerdict;
use ipc_types::artefact::{Attachment, SeparatedInterval};
use ipc_types::path_input::InputPiece;
use kinematics::{Kinematics, Support};
use scene::{RigidTransform, Scene};
use std::str::FromStr;

/// `OBJECT_LINK=GRIPPER_LINK@FIRST..LAST`: pieces from 0, both ends included; without LAST to the end of the path, without
/// `@` on all of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttachRequest {
    /// The link that is held, `model/link`.
    pub object: String,
    /// The link that holds it.
    pub gripper: String,
    /// First piece.
    pub first: usize,
    /// Last piece; `None` is that of the path.
    pub last: Option<usize>,
}

impl FromStr for AttachRequest {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}`: expected OBJECT_LINK=GRIPPER_LINK@FIRST..LAST, such as cap/cap=gripper/wsg_body@1..3"
            )
        };
        let (object, rest) = text.split_once('=').ok_or_else(wrong)?;
        let (gripper, pieces) = rest.split_once('@').unwrap_or((rest, "0.."));
        let number = |word: &str| word.trim().parse::<usize>().map_err(|_| wrong());
        let (first, last) = match pieces.split_once("..") {
            Some((first, "")) => (number(first)?, None),
            Some((first, last)) => (number(first)?, Some(number(last)?)),
            None => (number(pieces)?, Some(number(pieces)?)),
        };
        if object.is_empty() || gripper.is_empty() || last.is_some_and(|last| last < first) {
            return Err(wrong());
        }
        Ok(Self { object: object.to_owned(), gripper: gripper.to_owned(), first, last })
    }
}

/// A request that does not fit the scene or the path.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum HeldError {
    #[error("--attach {object}={gripper}: {source}")]
    Links { object: String, gripper: String, source: scene::AttachError },
    #[error("--attach {object}: pieces {first} to {last}, but the path has pieces 0 to {of}; correct them")]
    Pieces { object: String, first: usize, last: usize, of: usize },
    #[error(
        "--attach {object}: piece {piece_idx} is held by another --attach too; one link is held at a time"
    )]
    Twice { object: String, piece_idx: usize },
}

/// A link that is held over some pieces.
#[derive(Debug, Clone)]
pub(super) struct Held {
    request: AttachRequest,
    pub first: usize,
    pub last: usize,
    X_GO: RigidTransform,
    pub certifier: PathCertifier,
    before: Placing,
    meanwhile: Placing,
    /// Bodies that are held.
    bodies: Vec<usize>,
}

/// Places the bodies of a scene.
#[derive(Debug, Clone)]
struct Placing {
    kinematics: Kinematics,
    shapes: Vec<scene::Shape>,
}

impl Placing {
    fn new(scene: &Scene) -> Self {
        let shapes = scene.bodies.iter().map(|body| body.shape.clone()).collect();
        Self { kinematics: Kinematics::new(scene), shapes }
    }

    fn body_pose(&self, q: &[f64], body_idx: usize) -> RigidTransform {
        let mut poses = Vec::new();
        self.kinematics.link_poses(q, &mut poses);
        self.kinematics.body_pose(&poses, body_idx)
    }
}

impl Held {
    /// All requests on the path `pieces` of `scene`, sorted by their pieces; `certifier` makes that of a scene.
    pub fn all(
        scene: &Scene,
        pieces: &[InputPiece],
        requests: &[AttachRequest],
        certifier: impl Fn(&Scene) -> PathCertifier,
    ) -> Result<Vec<Held>, HeldError> {
        let mut all = requests
            .iter()
            .map(|request| Held::new(scene, pieces, request, &certifier))
            .collect::<Result<Vec<Held>, HeldError>>()?;
        all.sort_by_key(|held| held.first);
        for both in all.windows(2) {
            if both[1].first <= both[0].last {
                let object = both[1].request.object.clone();
                return Err(HeldError::Twice { object, piece_idx: both[1].first });
            }
        }
        Ok(all)
    }

    fn new(
        scene: &Scene,
        pieces: &[InputPiece],
        request: &AttachRequest,
        certifier: impl Fn(&Scene) -> PathCertifier,
    ) -> Result<Held, HeldError> {
        let (object, gripper) = (request.object.clone(), request.gripper.clone());
        let of = pieces.len().saturating_sub(1);
        let (first, last) = (request.first, request.last.unwrap_or(of));
        let start = pieces.get(first).and_then(|piece| piece.control_points.first());
        let Some(start) = start.filter(|_| first <= last && last <= of) else {
            return Err(HeldError::Pieces { object, first, last, of });
        };
        let links = |source| HeldError::Links { object: object.clone(), gripper: gripper.clone(), source };
        // The pose does not matter for what can be wrong with the links.
        scene.with_attached(&object, &gripper, &RigidTransform::identity()).map_err(links)?;
        let before = Placing::new(scene);
        let mut poses = Vec::new();
        before.kinematics.link_poses(start, &mut poses);
        let pose = |name: &str| scene.link_idx(name).map_or_else(RigidTransform::identity, |idx| poses[idx]);
        let X_GO = pose(&gripper).inverse() * pose(&object);
        // As the certificate's reader will make it of the numbers stored.
        let (rotation, translation) = numbers(&X_GO);
        let X_GO = scene::pose_from_numbers(rotation, translation).unwrap_or(X_GO);
        let attached = scene.with_attached(&object, &gripper, &X_GO).map_err(links)?;
        let is_held = |body: &scene::Body| {
            scene.link_idx(&object).is_some_and(|object_idx| scene.moves_with(body.link_idx, object_idx))
        };
        let bodies = (0..scene.bodies.len()).filter(|&idx| is_held(&scene.bodies[idx])).collect();
        Ok(Held {
            request: request.clone(),
            first,
            last,
            X_GO,
            certifier: certifier(&attached),
            before,
            meanwhile: Placing::new(&attached),
            bodies,
        })
    }

    /// How far a point of what is held is at most from where the path puts it at `q`, metres.
    pub fn displacement(&self, q: &[f64]) -> f64 {
        let of_body = |&body_idx: &usize| {
            let shape = &self.before.shapes[body_idx];
            let [X_0, X_1] = [&self.before, &self.meanwhile].map(|placing| placing.body_pose(q, body_idx));
            let turn = X_0.rotation.angle_to(&X_1.rotation);
            let extent = shape.core_extent() + shape.rounding_radius();
            (X_0.translation.vector - X_1.translation.vector).norm() + 2.0 * (0.5 * turn).sin() * extent
        };
        self.bodies.iter().map(of_body).fold(0.0, f64::max)
    }

    /// The attachment as the certificate has it, with the proof that the configuration `start`, where it begins, is free
    /// as the path gives it: there the gripper and what it holds count against each other. `Err` is the verdict where
    /// it is not.
    pub fn attachment(
        &self,
        certifier: &PathCertifier,
        start: &[f64],
        workspace: &mut PathWorkspace,
    ) -> (Attachment, Option<PieceVerdict>) {
        let verdict = certifier.certify_piece(&[start.to_vec(), start.to_vec()], workspace);
        let is_free = verdict.is_certified();
        let grasp: Vec<Vec<SeparatedInterval>> =
            if is_free { workspace.proof(certifier.n_pairs()) } else { Vec::new() };
        let (rotation, translation) = numbers(&self.X_GO);
        let attachment = Attachment {
            object: self.request.object.clone(),
            gripper: self.request.gripper.clone(),
            first: self.first as u32,
            last: self.last as u32,
            rotation,
            translation,
            pairs: self.certifier.certificate_pairs(),
            grasp,
        };
        (attachment, (!is_free).then_some(verdict))
    }
}

fn numbers(X: &RigidTransform) -> ([f64; 4], [f64; 3]) {
    let q = X.rotation.quaternion();
    ([q.i, q.j, q.k, q.w], X.translation.vector.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_as_text() {
        let request = |first, last| {
            Ok(AttachRequest { object: "cap/cap".into(), gripper: "hand/palm".into(), first, last })
        };
        assert_eq!("cap/cap=hand/palm@1..3".parse(), request(1, Some(3)));
        assert_eq!("cap/cap=hand/palm@2..".parse(), request(2, None));
        assert_eq!("cap/cap=hand/palm@2".parse(), request(2, Some(2)));
        assert_eq!("cap/cap=hand/palm".parse(), request(0, None));
        for wrong in ["cap", "=b@1..2", "a=@1", "a=b@2..1", "a=b@x..2", "a=b@1..y", "a=b@-1"] {
            let refused = wrong.parse::<AttachRequest>().unwrap_err();
            assert!(refused.contains("OBJECT_LINK=GRIPPER_LINK@FIRST..LAST"), "{refused}");
        }
    }
}
