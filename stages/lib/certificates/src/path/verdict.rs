//! What is known of a piece of a path.

use scene::CollisionPair;

/// A pair at a configuration of a piece.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstruction {
    /// Parameter in [0, 1].
    pub t: f64,
    /// Configuration there.
    pub q: Vec<f64>,
    /// The bodies.
    pub pair: CollisionPair,
    /// Their signed distance there, metres: minus the depth where they overlap.
    pub gap: f64,
    /// The clearance that is asked of them, metres.
    pub clearance: f64,
}

/// What is known of a piece.
#[derive(Debug, Clone, PartialEq)]
pub enum PieceVerdict {
    /// Every pair keeps more than its clearance all along: proven.
    Certified,
    /// The pair is closer than its clearance by more than rounding explains.
    Collision(Obstruction),
    /// The pair is at its clearance within [`super::TOL_GAP`], such as a grasp held at contact: it can neither be
    /// proven apart nor be said to be closer.
    Touching(Obstruction),
    /// The pair passes so close that the limits of the search were not enough.
    Undecided(Obstruction),
    /// A control point lies outside the joint limits.
    OutsideLimits {
        /// Position of the control point.
        point_idx: usize,
        /// The coordinate.
        coordinate_idx: usize,
        /// Its value.
        value: f64,
    },
    /// The piece does not begin where the one before it ended.
    Jump {
        /// The coordinate that differs most.
        coordinate_idx: usize,
        /// By how much.
        distance: f64,
    },
    /// Where the holding ends, what was held is not where the path puts it from there on.
    Released {
        /// By how much, metres.
        distance: f64,
    },
    /// A form that the task keeps in the piece's mode changes.
    NotKept {
        /// Position of the form among those of the mode.
        form_idx: usize,
        /// By how much, from the beginning of the motion in this mode.
        residual: f64,
    },
}

impl PieceVerdict {
    /// Whether the piece is certified.
    pub fn is_certified(&self) -> bool {
        *self == PieceVerdict::Certified
    }
}
