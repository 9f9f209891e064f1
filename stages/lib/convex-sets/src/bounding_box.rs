//! Smallest box around a polyhedron: two linear programmes a coordinate.

use nalgebra::DVector;

use crate::lp::{LinearProgram, LpOutcome};
use crate::{HPolyhedron, Hyperrectangle, SetError};

/// A coordinate without a bound of its own is first searched for within this; a polyhedron that reaches it
/// counts as unbounded.
const FAR: f64 = 1e6;

impl HPolyhedron {
    /// The bounds that single rows give: rows with one coefficient that is not zero; ±∞ where there is none.
    pub fn explicit_bounds(&self) -> Hyperrectangle {
        let n = self.ambient_dimension();
        let mut lower = DVector::from_element(n, f64::NEG_INFINITY);
        let mut upper = DVector::from_element(n, f64::INFINITY);
        for i in 0..self.n_faces() {
            let mut entries = (0..n).filter(|&j| self.A[(i, j)] != 0.0);
            let (Some(j), None) = (entries.next(), entries.next()) else { continue };
            let a = self.A[(i, j)];
            if a > 0.0 {
                upper[j] = upper[j].min(self.b[i] / a);
            } else {
                lower[j] = lower[j].max(self.b[i] / a);
            }
        }
        Hyperrectangle { lower, upper }
    }

    /// A finite box that contains P: the explicit bounds where they exist, otherwise found by programmes over a
    /// large box, of which it keeps a small relative margin.
    pub fn enclosing_box(&self) -> Result<Hyperrectangle, SetError> {
        let explicit = self.explicit_bounds();
        if explicit.lower.iter().chain(explicit.upper.iter()).all(|v| v.is_finite()) {
            return match explicit.lower.iter().zip(explicit.upper.iter()).all(|(l, u)| l <= u) {
                true => Ok(explicit),
                false => Err(SetError::Empty),
            };
        }
        let mut within = Hyperrectangle {
            lower: explicit.lower.map(|v| if v.is_finite() { v } else { -FAR }),
            upper: explicit.upper.map(|v| if v.is_finite() { v } else { FAR }),
        };
        if within.lower.iter().zip(within.upper.iter()).any(|(l, u)| l > u) {
            return Err(SetError::Empty);
        }
        // Each pass is accurate relative to the box it searches, so the box shrinks onto P in a few passes.
        for pass in 0..3 {
            let tight = tight_box(self, &within)?;
            for j in 0..self.ambient_dimension() {
                let margin =
                    1e-3 * (tight.upper[j] - tight.lower[j]) + 1e-7 * (within.upper[j] - within.lower[j]);
                if explicit.lower[j] == f64::NEG_INFINITY {
                    if pass == 0 && tight.lower[j] < -0.99 * FAR {
                        return Err(SetError::Unbounded { coordinate: j });
                    }
                    within.lower[j] = within.lower[j].max(tight.lower[j] - margin);
                }
                if explicit.upper[j] == f64::INFINITY {
                    if pass == 0 && tight.upper[j] > 0.99 * FAR {
                        return Err(SetError::Unbounded { coordinate: j });
                    }
                    within.upper[j] = within.upper[j].min(tight.upper[j] + margin);
                }
            }
        }
        Ok(within)
    }

    /// The smallest box that contains P, up to rounding.
    pub fn bounding_box(&self) -> Result<Hyperrectangle, SetError> {
        tight_box(self, &self.enclosing_box()?)
    }
}

/// The smallest box around P ∩ `within`.
fn tight_box(P: &HPolyhedron, within: &Hyperrectangle) -> Result<Hyperrectangle, SetError> {
    let n = P.ambient_dimension();
    let program = LinearProgram::new(&P.A, &P.b, &within.lower, &within.upper);
    let mut bounds = within.clone();
    for j in 0..n {
        for sign in [1.0, -1.0] {
            let mut c = DVector::zeros(n);
            c[j] = sign;
            match program.minimize(&c) {
                LpOutcome::Optimal { value, .. } if sign > 0.0 => bounds.lower[j] = value,
                LpOutcome::Optimal { value, .. } => bounds.upper[j] = -value,
                LpOutcome::Infeasible { .. } => return Err(SetError::Empty),
                // The enclosing bound stays: larger than need be, never wrong.
                LpOutcome::Undecided { .. } => {}
            }
        }
    }
    Ok(bounds)
}
