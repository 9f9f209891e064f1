//! Faces that cut collisions away.
//!
//! In the metric of the ellipsoid ‖A (u - c)‖, a collision is walked by bisection towards the center, and the face
//! through the last colliding point is tangent to the ellipsoid's level set there. A point that must stay inside,
//! the *witness* w, changes the target: the nearest point y of the segment from c to w takes the place of c. The
//! face is then orthogonal, in the metric, to s - y, so the whole segment stays on its inner side.

use convex_sets::Hyperellipsoid;
use nalgebra::DVector;

use crate::domain::Domain;

/// a·u ≤ b, with ‖a‖ = 1.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) a: DVector<f64>,
    pub(crate) b: f64,
    /// Distance of the collision in the ellipsoid's metric: near ones are placed first.
    pub(crate) distance: f64,
    /// Where the collision begins.
    pub(crate) boundary: DVector<f64>,
}

/// Places faces around one ellipsoid.
pub(crate) struct Placing<'a, 'd> {
    domain: &'a Domain<'d>,
    ellipsoid: &'a Hyperellipsoid,
    witness: &'a DVector<f64>,
    center_is_free: bool,
    /// Metres of displacement between a face and its collision.
    margin: f64,
}

impl<'a, 'd> Placing<'a, 'd> {
    /// `witness` is free.
    pub(crate) fn new(
        domain: &'a Domain<'d>,
        ellipsoid: &'a Hyperellipsoid,
        witness: &'a DVector<f64>,
        margin: f64,
    ) -> Self {
        let center_is_free = domain.is_free(&ellipsoid.center);
        Self { domain, ellipsoid, witness, center_is_free, margin }
    }

    /// The face that cuts off `collision` and keeps the witness; `None` if rounding leaves no room between them.
    pub(crate) fn face(&self, collision: &DVector<f64>) -> Option<Face> {
        if self.center_is_free {
            let face = self.face_seen_from(collision, &self.ellipsoid.center)?;
            if face.a.dot(self.witness) < face.b {
                return Some(face);
            }
            let y = self.nearest_on_segment(collision);
            if self.domain.is_free(&y) {
                let face = self.face_seen_from(collision, &y)?;
                if face.a.dot(self.witness) < face.b {
                    return Some(face);
                }
            }
        }
        self.face_seen_from(collision, self.witness).filter(|face| face.a.dot(self.witness) < face.b)
    }

    fn face_seen_from(&self, collision: &DVector<f64>, y: &DVector<f64>) -> Option<Face> {
        let boundary = self.boundary(collision, y);
        let offset = &self.ellipsoid.A * (&boundary - y);
        let normal = self.ellipsoid.A.transpose() * &offset;
        let norm = normal.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        let a = normal / norm;
        let per_unit = self.domain.displacement(&a);
        let room = a.dot(&(&boundary - y));
        let shift = if per_unit > 0.0 { (self.margin / per_unit).min(0.5 * room) } else { 0.5 * room };
        let b = a.dot(&boundary) - shift;
        Some(Face { a, b, distance: offset.norm(), boundary })
    }

    /// The colliding end of the last bisection step from `collision` towards the free point `y`.
    fn boundary(&self, collision: &DVector<f64>, y: &DVector<f64>) -> DVector<f64> {
        let whole = collision - y;
        let length = self.domain.displacement(&whole);
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..60 {
            if (blocked - free) * length <= 0.25 * self.margin {
                break;
            }
            let middle = 0.5 * (free + blocked);
            if self.domain.is_free(&(y + middle * &whole)) {
                free = middle;
            } else {
                blocked = middle;
            }
        }
        y + blocked * whole
    }

    /// The point of the segment from center to witness nearest to `s` in the metric.
    fn nearest_on_segment(&self, s: &DVector<f64>) -> DVector<f64> {
        let along = self.witness - &self.ellipsoid.center;
        let A_along = &self.ellipsoid.A * &along;
        let A_s = &self.ellipsoid.A * (s - &self.ellipsoid.center);
        let square = A_along.norm_squared();
        let t = if square > 0.0 { (A_along.dot(&A_s) / square).clamp(0.0, 1.0) } else { 0.0 };
        &self.ellipsoid.center + t * along
    }
}
