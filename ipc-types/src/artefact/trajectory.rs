//! `trajectory.bin` / `trajectory.json`: Bézier pieces.

use crate::artefact::Mode;
use serde::{Deserialize, Serialize};

/// Path between two consecutive configurations of the plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Mode.
    pub mode: Mode,
    /// Pieces, each with its Bézier control points, each of n coordinates.
    pub pieces: Vec<Vec<Vec<f64>>>,
    /// Id of the region that holds all control points of each piece.
    pub regions: Vec<u64>,
    /// Length of the control polygon's curve, in C-space units.
    pub length: f64,
    /// Proven lower bound on the length of any path of this segment inside its leaf of the regions.
    pub lower_bound: f64,
    /// Whether every region on the way is certified.
    pub certified: bool,
}

/// The whole motion (thesis 2, eq. 5.9).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryFile {
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// Segments in order.
    pub segments: Vec<Segment>,
    /// Sum of the lengths.
    pub length: f64,
    /// Duration; equal to the length until limits of velocity are used.
    pub duration: f64,
}
