//! What all pairs of a region share while they are searched.

use crate::cell::CellBox;
use crate::guide::Guide;
use crate::rows::{Multipliers, Rows};

/// What all pairs of a region share.
#[derive(Clone, Copy)]
pub struct RegionData<'a> {
    /// Rows of the region as it came.
    pub rows: &'a Rows,
    /// Joint limits.
    pub limits: &'a CellBox,
    /// For each coordinate the proven lower and upper bound of the region and why, where it is inside the limits.
    pub bounds: &'a [[Option<(f64, Multipliers)>; 2]],
    /// A point of the region that stays.
    pub center: &'a [f64],
    /// Further points that stay.
    pub keep: &'a [Vec<f64>],
    /// Makes the samples by which cuts are judged, the same each time.
    pub guide: &'a (dyn Fn() -> Guide + Sync),
    /// A cut leaves the centre at least this room.
    pub min_room: f64,
}

/// Whether the cut keeps the centre well inside, and the points to keep.
pub fn keeps(region: &RegionData<'_>, a: &[f64], b: f64) -> bool {
    let slack = |q: &[f64]| b - a.iter().zip(q).map(|(a, q)| a * q).sum::<f64>();
    slack(region.center) > region.min_room && region.keep.iter().all(|q| slack(q) >= MIN_ROOM_KEPT)
}

/// A cut stays this far from points to keep.
const MIN_ROOM_KEPT: f64 = 1e-9;
