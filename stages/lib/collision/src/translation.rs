//! Pairs whose bodies only translate against each other, so that what collides is convex in C-space.
//!
//! With D [3 × n] the velocities of A against B, the bodies A_0, B_0 at q = 0, and clearance c, the pair collides
//! exactly where D q ∈ M := B_0 ⊕ (-A_0) ⊕ ball c: the preimage of a convex set under a linear map.

use crate::checker::{CollisionChecker, Placements};
use crate::placement::Placement;
use crate::separation::{Placed, Separation, TOL_CONTACT, distance_separation};
use nalgebra::{Matrix3xX, Vector3};
use scene::Shape;

/// The convex obstacle {q : D q ∈ M} of a pair.
#[derive(Debug, Clone)]
pub struct TranslatingPair {
    /// Velocity of body A against body B, metres for each unit of each coordinate [3 × n].
    pub D: Matrix3xX<f64>,
    /// Shape of body A and its pose at q = 0.
    pub body_a: (Shape, Placement),
    /// Shape of body B and its pose at q = 0.
    pub body_b: (Shape, Placement),
    /// What the bodies have to keep beyond not touching, metres: the clearance, and what rounding and dropped
    /// rotations ask for.
    pub clearance: f64,
}

impl TranslatingPair {
    /// How far y = D q is from the obstacle, without the clearance: the gap of the bodies and its direction λ.
    pub fn separation(&self, y: &Vector3<f64>) -> Separation {
        let moved = Placement { R: self.body_a.1.R, p: self.body_a.1.p + y };
        let a = Placed { shape: &self.body_a.0, X: &moved };
        distance_separation(a, Placed { shape: &self.body_b.0, X: &self.body_b.1 })
    }

    /// max over M of λ·y, for λ of any length.
    pub fn support_value(&self, lambda: &Vector3<f64>) -> f64 {
        let length = lambda.norm();
        if length == 0.0 {
            return 0.0;
        }
        let n = lambda / length;
        let placed = |(shape, X): &(Shape, Placement), n: &Vector3<f64>| Placed { shape, X }.support_value(n);
        length * (placed(&self.body_b, &n) + placed(&self.body_a, &-n) + self.clearance)
    }
}

impl CollisionChecker {
    /// The obstacle of pair `pair_idx`, if all joints between its bodies are prismatic; otherwise the coordinate of the
    /// first revolute one.
    pub fn translating_pair(&self, pair_idx: usize) -> Result<TranslatingPair, usize> {
        let checked = &self.pairs[pair_idx];
        if let Some(coordinate_idx) = checked.revolute {
            return Err(coordinate_idx);
        }
        let mut q = vec![0.0; self.dim];
        let mut at = Placements::default();
        self.place(&q, &mut at);
        let pose = |body_idx: usize, at: &Placements| at.bodies[body_idx];
        let (body_a, body_b) = (checked.pair.body_a, checked.pair.body_b);
        let (X_a, X_b) = (pose(body_a, &at), pose(body_b, &at));
        let shapes = self.placed(pair_idx, &at);
        let (shape_a, shape_b) = (shapes.0.shape.clone(), shapes.1.shape.clone());
        let mut D = Matrix3xX::zeros(self.dim);
        for &j in &checked.coordinates {
            q[j] = 1.0;
            self.place(&q, &mut at);
            q[j] = 0.0;
            D.set_column(j, &((pose(body_a, &at).p - X_a.p) - (pose(body_b, &at).p - X_b.p)));
        }
        // Positions are off by rounding in proportion to the distances involved.
        let size =
            X_a.p.norm() + X_b.p.norm() + D.iter().map(|v| v.abs()).sum::<f64>() + self.radii(pair_idx);
        let clearance = checked.clearance + TOL_CONTACT + checked.inflation + 64.0 * f64::EPSILON * size;
        Ok(TranslatingPair { D, body_a: (shape_a, X_a), body_b: (shape_b, X_b), clearance })
    }
}
