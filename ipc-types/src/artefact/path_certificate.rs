//! `path.bin` / `path.json`: why a path is free of collision, to be re-checked without a search.
//!
//! Theory: second-order bounds along curves (mathematics 2.1, Paths). A piece is a Bézier curve q(t), t in [0, 1]. For
//! a pair of bodies (A, B), a frame F and a direction n fixed in F, the gap
//!
//! ```text
//! gap(t) = min { n·x : x in A at q(t) } − max { n·x : x in B at q(t) },      both seen from F
//! ```
//!
//! is a least value of functions whose second derivative is at most M2 in magnitude. So on an interval of length l
//! with middle m it stays above the clearance if, on each half, the line between the gaps at the half's ends minus
//! M2 s (l/2 − s) / 2 does, s the distance from the half's begin; it suffices that the three gaps exceed it by
//! M2 l² / 32. A verifier recomputes gaps and M2 from these data alone; nothing here has to be believed.

use crate::artefact::{FrameChoice, Mode};
use serde::{Deserialize, Serialize};

/// A path and, for each of its pieces that is certified, the proof.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PathCertificateFile {
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// The task whose clearance holds and whose kept forms were checked; `null` if none was named.
    pub task: Option<String>,
    /// Distance that is proven for all pairs but those of a robot link with an object link, metres; these are proven
    /// not to touch.
    pub clearance: f64,
    /// Every pair of bodies that may collide, sorted by (body_a, body_b).
    pub pairs: Vec<PathPair>,
    /// What is held on which pieces, sorted, no piece twice.
    #[serde(default)]
    pub attachments: Vec<Attachment>,
    /// The pieces of the path in their order.
    pub pieces: Vec<CertifiedPiece>,
}

/// A link of an object, with all that hangs on it, moves rigidly with a link of a robot over some pieces: the scene for
/// these pieces has the object's link fixed on the gripper's, with the pose X_GO that the path gives it where the first
/// of them begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attachment {
    /// Name of the object's link, `model/link`.
    pub object: String,
    /// Name of the gripper's link.
    pub gripper: String,
    /// First piece.
    pub first: u32,
    /// Last piece.
    pub last: u32,
    /// Rotation of X_GO as a quaternion (i, j, k, w), of unit length within rounding.
    pub rotation: [f64; 4],
    /// Translation of X_GO, metres.
    pub translation: [f64; 3],
    /// Every pair that may collide in that scene, sorted by (body_a, body_b): bodies on links that are rigid to each other
    /// do not count.
    pub pairs: Vec<PathPair>,
    /// Why the configuration where it begins is free as the path gives it, the gripper and what it holds included: one
    /// list for each of the file's `pairs`, as for a piece that stays there.
    pub grasp: Vec<Vec<SeparatedInterval>>,
}

/// A pair of bodies and the frames in which its normals are fixed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PathPair {
    /// Index of body A in the scene's bodies.
    pub body_a: u32,
    /// Index of body B, greater than `body_a`.
    pub body_b: u32,
    /// Distance that is proven, metres.
    pub clearance: f64,
    /// The frames that intervals name by position. Any link may serve. The rotations that are counted as dropped are
    /// the last ones on the way from the frame's link to the body.
    pub frames: Vec<FrameChoice>,
}

/// One piece of the path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertifiedPiece {
    /// Whether the object rests or is held; `null` if the path does not say.
    pub mode: Option<Mode>,
    /// Bézier control points, each of n coordinates; two for a straight piece.
    pub control_points: Vec<Vec<f64>>,
    /// One list for each pair, in the order of the file's `pairs`, or of those of the attachment that holds here: intervals in order, the first from 0, each from the end of
    /// the one before it, the last to 1. No list at all for a piece that is not certified.
    pub intervals: Vec<Vec<SeparatedInterval>>,
}

/// An interval of t on which a pair is apart along one direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SeparatedInterval {
    /// Begin.
    pub t_0: f64,
    /// End.
    pub t_1: f64,
    /// Position in `PathPair::frames`.
    pub frame: u16,
    /// Normal in the frame's link; points from B to A; of unit length within rounding (a verifier divides by a bound
    /// on its length).
    pub normal: [f64; 3],
}
