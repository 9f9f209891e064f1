//! What is to be decomposed, as plain data.

use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use crate::free_space::FreeSpace;

/// A configuration that a region must contain.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchor {
    /// What it is, for messages: `start`, `goal`.
    pub name: String,
    /// The configuration [n].
    pub q: DVector<f64>,
}

/// The space to decompose.
#[derive(Clone)]
pub struct Problem<'a> {
    /// Joint limits [n].
    pub limits: Hyperrectangle,
    /// For each coordinate, whether collisions depend on it.
    pub relevant: Vec<bool>,
    /// Metres of displacement that one unit of each coordinate brings about [n], > 0 where relevant.
    pub displacement: DVector<f64>,
    /// CS_free.
    pub free: &'a dyn FreeSpace,
    /// CG, if there is a task.
    pub grasp: Option<HPolyhedron>,
    /// CP, if there is a task.
    pub placement: Option<HPolyhedron>,
    /// Forms that are constant while the object is held, one a row [r × n].
    pub transfer_keep: Option<DMatrix<f64>>,
    /// Configurations that regions must contain.
    pub anchors: Vec<Anchor>,
}

/// What is wrong with a problem.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ProblemError {
    /// A vector of another dimension.
    #[error("{what} has {found} entries, the joint limits have {expected}")]
    Dimension {
        /// Which.
        what: String,
        /// Its length.
        found: usize,
        /// The dimension of C-space.
        expected: usize,
    },
    /// An anchor outside the joint limits.
    #[error("{name} is outside the joint limits: coordinate {coordinate} is {value}")]
    OutsideLimits {
        /// The anchor.
        name: String,
        /// 0-based position of the coordinate.
        coordinate: usize,
        /// Its value.
        value: f64,
    },
    /// An anchor in collision.
    #[error("{name} is in collision")]
    NotFree {
        /// The anchor.
        name: String,
    },
    /// A segment that is none.
    #[error(
        "option region-along is {text:?}, expected two configurations of {expected} numbers each, separated by ;"
    )]
    Segment {
        /// What was given.
        text: String,
        /// Number of coordinates.
        expected: usize,
    },
    /// A segment that is not free.
    #[error("the segment {name} is not free: {reason}")]
    SegmentNotFree {
        /// As it was given.
        name: String,
        /// Where, and which bodies.
        reason: String,
    },
    /// A method that cannot grow regions here.
    #[error("option method is {method}: {reason}")]
    Method {
        /// The method.
        method: &'static str,
        /// Why not, and what to choose.
        reason: String,
    },
    /// A configuration that is none.
    #[error("option region-at is {text:?}, expected {expected} numbers separated by commas")]
    Configuration {
        /// What was given.
        text: String,
        /// Number of coordinates.
        expected: usize,
    },
    /// An option outside its range.
    #[error("option {name} is {value}, expected {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is expected.
        expected: &'static str,
    },
}

impl Problem<'_> {
    /// The same space without a task: CS_free is all that there is to cover.
    #[must_use]
    pub fn without_task(self) -> Self {
        Self { grasp: None, placement: None, transfer_keep: None, anchors: Vec::new(), ..self }
    }

    /// The part of it within `radius` of `q` in every coordinate that collisions depend on; others keep their range.
    #[must_use]
    pub fn within(mut self, q: &DVector<f64>, radius: f64) -> Self {
        for j in (0..q.len()).filter(|&j| self.relevant[j]) {
            self.limits.lower[j] = self.limits.lower[j].max(q[j] - radius);
            self.limits.upper[j] = self.limits.upper[j].min(q[j] + radius);
        }
        self
    }

    /// Whether dimensions agree and all anchors are free and inside the limits.
    pub fn check(&self) -> Result<(), ProblemError> {
        let n = self.limits.lower.len();
        let mut lengths = vec![
            ("upper limits".to_owned(), self.limits.upper.len()),
            ("relevance".to_owned(), self.relevant.len()),
            ("displacement".to_owned(), self.displacement.len()),
        ];
        for (name, set) in [("CG", &self.grasp), ("CP", &self.placement)] {
            lengths.extend(set.iter().map(|set| (name.to_owned(), set.ambient_dimension())));
        }
        lengths.extend(self.transfer_keep.iter().map(|forms| ("transfer forms".to_owned(), forms.ncols())));
        lengths.extend(self.anchors.iter().map(|anchor| (anchor.name.clone(), anchor.q.len())));
        for (what, found) in lengths {
            if found != n {
                return Err(ProblemError::Dimension { what, found, expected: n });
            }
        }
        for anchor in &self.anchors {
            for j in 0..n {
                let value = anchor.q[j];
                if !(self.limits.lower[j] <= value && value <= self.limits.upper[j]) {
                    return Err(ProblemError::OutsideLimits {
                        name: anchor.name.clone(),
                        coordinate: j,
                        value,
                    });
                }
            }
            if !self.free.is_free(anchor.q.as_slice()) {
                return Err(ProblemError::NotFree { name: anchor.name.clone() });
            }
        }
        Ok(())
    }
}
