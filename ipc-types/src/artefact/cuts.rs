//! `cuts.bin` / `cuts.json`: leaf cuts, for segments that have no path in their leaf.

use crate::artefact::Mode;
use serde::{Deserialize, Serialize};

/// A leaf cut. A segment of `mode` whose start lies in a region of `reached` and whose end lies outside them has a
/// path only if the values λ of the mode's kept forms lie in the projection of P_a ∩ P_b ∩ (CP or CG) for one pair
/// (a, b) of `exits`: every way out of `reached` passes through one of these overlaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeafCut {
    /// Mode of the segment that had no path.
    pub mode: Mode,
    /// Ids of the regions S that were reached from its start inside its leaf; sorted.
    pub reached: Vec<u64>,
    /// All pairs (a, b) of region ids with a in S, b not in S, whose overlap within the mode's space is not proven
    /// empty; sorted.
    pub exits: Vec<(u64, u64)>,
}

/// All cuts of a run, in the order in which they were found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CutsFile {
    /// The cuts.
    pub cuts: Vec<LeafCut>,
}
