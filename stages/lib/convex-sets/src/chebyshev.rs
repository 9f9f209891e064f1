//! Largest balls inside a polyhedron, and what follows from them: interior points and overlap.
//!
//! max r  s.t.  A x + r ‖A_i W‖ ≤ b: the largest copy of the ellipsoid W·(unit ball) inside P (Boyd &
//! Vandenberghe 2004, §8.5.1; W = I is the Chebyshev ball).

use nalgebra::{DMatrix, DVector};

use crate::lp::{LpOutcome, minimize};
use crate::{HPolyhedron, Hyperrectangle, SetError};

/// Two sets overlap if a ball of this radius fits into both, in units of their common box. Erring side: misses
/// overlaps that are thinner.
pub const TOL_OVERLAP: f64 = 1e-7;

/// A ball, or in a scaled metric an axis-aligned ellipsoid, inside a set.
#[derive(Debug, Clone, PartialEq)]
pub struct InscribedBall {
    /// Its center [n].
    pub center: DVector<f64>,
    /// Its radius; not positive if the set has no interior.
    pub radius: f64,
}

impl HPolyhedron {
    /// The Chebyshev ball: center and radius of the largest Euclidean ball inside P. Mixes the units of the
    /// coordinates; [`HPolyhedron::interior_point`] does not.
    pub fn chebyshev_center(&self) -> Result<InscribedBall, SetError> {
        let bounds = self.enclosing_box()?;
        let unit = DVector::from_element(self.ambient_dimension(), 1.0);
        self.largest_scaled_ball(&bounds, &unit)
    }

    /// A point deep inside P: center of the largest ball after scaling P's bounding box to [-1, 1]ⁿ. The radius
    /// is in units of that box: a box itself has radius 1. An error if P has no interior.
    pub fn interior_point(&self) -> Result<InscribedBall, SetError> {
        let bounds = self.bounding_box()?;
        let half = bounds.half_widths();
        if half.iter().any(|&h| h <= 0.0) {
            return Err(SetError::NoInterior);
        }
        let ball = self.largest_scaled_ball(&bounds, &half)?;
        if ball.radius > 0.0 { Ok(ball) } else { Err(SetError::NoInterior) }
    }

    /// The largest r and its x with x + r·diag(`scale`)·(unit ball) ⊂ P ∩ rows of `within`.
    ///
    /// `within` must contain P; it is only the box that the programme searches.
    pub fn largest_scaled_ball(
        &self,
        within: &Hyperrectangle,
        scale: &DVector<f64>,
    ) -> Result<InscribedBall, SetError> {
        let (m, n) = (self.n_faces(), self.ambient_dimension());
        let mut A = DMatrix::zeros(m, n + 1);
        A.columns_mut(0, n).copy_from(&self.A);
        let mut lower = within.lower.clone().insert_row(n, 0.0);
        let mut upper = within.upper.clone().insert_row(n, 0.0);
        let mut reach: f64 = 0.0;
        for i in 0..m {
            A[(i, n)] = self.A.row(i).transpose().component_mul(scale).norm();
        }
        for j in 0..n {
            if scale[j] > 0.0 {
                reach = reach.max((within.upper[j] - within.lower[j]) / scale[j]);
            }
        }
        // A negative radius measures how far the rows miss each other, so thin sets stay decidable.
        lower[n] = -reach.max(f64::MIN_POSITIVE);
        upper[n] = reach.max(f64::MIN_POSITIVE);
        let mut c = DVector::zeros(n + 1);
        c[n] = -1.0;
        match minimize(&c, &A, &self.b, &lower, &upper) {
            LpOutcome::Optimal { x, .. } => {
                Ok(InscribedBall { radius: x[n], center: x.rows(0, n).into_owned() })
            }
            LpOutcome::Infeasible { .. } => Err(SetError::Empty),
            LpOutcome::Undecided { .. } => Err(SetError::Undecided),
        }
    }

    /// Whether P and `other` share a ball of radius [`TOL_OVERLAP`], in units of their common box: overlap with
    /// non-empty interior (thesis 2, section 5.3.3).
    pub fn interior_intersects(&self, other: &Self) -> bool {
        self.overlap(other).is_some()
    }

    /// The ball that witnesses [`HPolyhedron::interior_intersects`]; its radius is in units of the common box.
    pub fn overlap(&self, other: &Self) -> Option<InscribedBall> {
        let both = self.intersection(other);
        let bounds = both.enclosing_box().ok()?;
        let half = bounds.half_widths();
        if half.iter().any(|&h| h <= 0.0) {
            return None;
        }
        both.largest_scaled_ball(&bounds, &half).ok().filter(|ball| ball.radius > TOL_OVERLAP)
    }

    /// Whether P is empty; `true` is proven, `false` may be rounding.
    pub fn is_empty(&self) -> bool {
        let Ok(bounds) = self.enclosing_box() else {
            return matches!(self.enclosing_box(), Err(SetError::Empty));
        };
        let nothing = DVector::zeros(self.ambient_dimension());
        minimize(&nothing, &self.A, &self.b, &bounds.lower, &bounds.upper).is_infeasible()
    }
}
