//! What is asked: bring the object from start to goal.

use nalgebra::DVector;

/// A linear form of q: one coefficient a coordinate.
pub type LinearForm = DVector<f64>;

/// `lower ≤ form · q ≤ upper`.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedRow {
    /// Coefficients, one a coordinate; not all zero.
    pub form: LinearForm,
    /// Lower bound; may be -∞.
    pub lower: f64,
    /// Upper bound; may be +∞.
    pub upper: f64,
}

/// A polytope of C-space given by bounds on coordinates and rows: the grasp space `CG` or the placement
/// space `CP` (thesis 2, section 5.3.1).
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Lower bound of each coordinate; the joint limit where the scene gives none.
    pub lower: DVector<f64>,
    /// Upper bound of each coordinate; the joint limit where the scene gives none.
    pub upper: DVector<f64>,
    /// Further rows.
    pub rows: Vec<BoundedRow>,
}

/// A task of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Name of the task.
    pub name: String,
    /// `q_init`.
    pub start: DVector<f64>,
    /// `q_goal`.
    pub goal: DVector<f64>,
    /// Most grasps K that a plan may have.
    pub max_grasps: usize,
    /// Distance in metres that all pairs keep but those of a robot link with an object link.
    pub clearance: f64,
    /// `CG`.
    pub grasp: Space,
    /// `CP`.
    pub placement: Space,
    /// Forms that are constant while the object is held (thesis 2, eq. 5.5a, 5.5b).
    pub transfer_keep: Vec<LinearForm>,
    /// Forms that are constant while the object rests (thesis 2, eq. 5.5c).
    pub transit_keep: Vec<LinearForm>,
}
