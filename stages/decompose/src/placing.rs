//! Faces that cut collisions away.
//!
//! In the metric of the ellipsoid ‖A (u - c)‖, a collision is walked by bisection towards the center, and then along
//! the boundary of the obstacle to where it comes nearest (a compass search over directions: IRIS-ZO's nearest
//! *sampled* collision is not the nearest one, and the face of a flat obstacle would come out tilted). The face
//! there is tangent to the ellipsoid's level set.
//!
//! A point that must stay inside, the *witness* w, changes the target: the nearest point y of the segment from c to
//! w takes the place of c. The face is then orthogonal, in the metric, to s - y, so the whole segment stays on its
//! inner side.

use convex_sets::Hyperellipsoid;
use nalgebra::{DMatrix, DVector};

use crate::domain::Domain;

/// a·u ≤ b, with ‖a‖ = 1.
#[derive(Debug, Clone)]
pub(crate) struct Face {
    pub(crate) a: DVector<f64>,
    pub(crate) b: f64,
    /// Where the collision begins.
    pub(crate) boundary: DVector<f64>,
}

/// A collision walked towards the center.
#[derive(Debug, Clone)]
pub(crate) struct Boundary {
    /// Where it was found.
    pub(crate) collision: DVector<f64>,
    /// Where it begins.
    boundary: DVector<f64>,
    /// Free point that it was walked to.
    y: DVector<f64>,
    /// Distance from y in the metric.
    pub(crate) distance: f64,
}

/// Places faces around one ellipsoid.
pub(crate) struct Placing<'a, 'd> {
    domain: &'a Domain<'d>,
    ellipsoid: &'a Hyperellipsoid,
    /// A⁻¹.
    inverse: Option<DMatrix<f64>>,
    witness: &'a DVector<f64>,
    center_is_free: bool,
    /// Metres of displacement between a face and its collision.
    margin: f64,
}

/// First step of the search, radians in the metric; then it is halved down to the last.
const FIRST_STEP: f64 = 0.4;
const LAST_STEP: f64 = 4e-4;
/// Steps of the search at most.
const MAX_SEARCH_STEPS: usize = 60;
/// Halvings of a bisection during the search: the last bisection is to the margin.
const SEARCH_HALVINGS: usize = 14;

impl<'a, 'd> Placing<'a, 'd> {
    /// `witness` is free.
    pub(crate) fn new(
        domain: &'a Domain<'d>,
        ellipsoid: &'a Hyperellipsoid,
        witness: &'a DVector<f64>,
        margin: f64,
    ) -> Self {
        let center_is_free = domain.is_free(&ellipsoid.center);
        Self { domain, ellipsoid, inverse: ellipsoid.image_of_ball(), witness, center_is_free, margin }
    }

    /// Walks a collision towards the center, or to what takes its place.
    pub(crate) fn walk(&self, collision: &DVector<f64>) -> Boundary {
        if self.center_is_free {
            let boundary = self.walk_to(collision, &self.ellipsoid.center);
            if self.face_at(&boundary.boundary, &boundary.y).is_some() {
                return boundary;
            }
            let y = self.nearest_on_segment(collision);
            if self.domain.is_free(&y) {
                let boundary = self.walk_to(collision, &y);
                if self.face_at(&boundary.boundary, &boundary.y).is_some() {
                    return boundary;
                }
            }
        }
        self.walk_to(collision, self.witness)
    }

    /// The face where the obstacle comes nearest; `None` if rounding leaves no room before the witness.
    pub(crate) fn nearest_face(&self, from: &Boundary) -> Option<Face> {
        self.face_at(&self.search(from), &from.y)
    }

    /// The face where the collision was walked to.
    pub(crate) fn face(&self, from: &Boundary) -> Option<Face> {
        self.face_at(&from.boundary, &from.y)
    }

    /// Of `faces` the one that, moved inwards until it cuts `from` off, keeps the largest share of its distance from
    /// the center; `None` if none keeps the share `least`. A face that is tilted by the search's last step leaves a
    /// wedge of collisions; seen from the center, their own faces would cut across a passage.
    pub(crate) fn shifted(&self, faces: &[Face], from: &Boundary, least: f64) -> Option<Face> {
        let mut best: Option<(f64, &Face, f64)> = None;
        for face in faces {
            let b = face.b.min(face.a.dot(&from.boundary) - self.shift(&face.a));
            let distance = face.b - face.a.dot(&from.y);
            let share = (b - face.a.dot(&from.y)) / distance;
            let keeps = distance > 0.0 && share >= least && face.a.dot(self.witness) < b;
            if keeps && best.is_none_or(|(most, _, _)| share > most) {
                best = Some((share, face, b));
            }
        }
        best.map(|(_, face, b)| Face { a: face.a.clone(), b, boundary: from.boundary.clone() })
    }

    /// The margin along `a`, in units of the domain.
    fn shift(&self, a: &DVector<f64>) -> f64 {
        let per_unit = self.domain.displacement(a);
        if per_unit > 0.0 { self.margin / per_unit } else { 0.0 }
    }

    fn walk_to(&self, collision: &DVector<f64>, y: &DVector<f64>) -> Boundary {
        let boundary = self.bisect(collision, y, 60);
        let distance = (&self.ellipsoid.A * (&boundary - y)).norm();
        Boundary { collision: collision.clone(), boundary, y: y.clone(), distance }
    }

    /// The face through `boundary` as seen from `y`, unless it cuts the witness off.
    fn face_at(&self, boundary: &DVector<f64>, y: &DVector<f64>) -> Option<Face> {
        let normal = self.ellipsoid.A.transpose() * (&self.ellipsoid.A * (boundary - y));
        let norm = normal.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        let a = normal / norm;
        let room = a.dot(&(boundary - y));
        let b = a.dot(boundary) - self.shift(&a).min(0.5 * room);
        (a.dot(self.witness) < b).then(|| Face { a, b, boundary: boundary.clone() })
    }

    /// The colliding end of the last bisection step from `collision` towards the free point `y`.
    fn bisect(&self, collision: &DVector<f64>, y: &DVector<f64>, n_halvings: usize) -> DVector<f64> {
        let whole = collision - y;
        let length = self.domain.displacement(&whole);
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..n_halvings {
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

    /// Slides along the boundary of the obstacle to where it is nearest to y.
    fn search(&self, from: &Boundary) -> DVector<f64> {
        let Some(inverse) = &self.inverse else { return from.boundary.clone() };
        let k = self.domain.dim();
        // In w = A (u - y) distances are Euclidean and y is the origin.
        let mut w = &self.ellipsoid.A * (&from.boundary - &from.y);
        let mut step = FIRST_STEP;
        let mut moved = false;
        for _ in 0..MAX_SEARCH_STEPS {
            if step < LAST_STEP {
                break;
            }
            let radius = w.norm();
            let nearer = tangents(&w).into_iter().find_map(|tangent| {
                let turned = &w + step * radius * tangent;
                let turned = &turned * (radius * (1.0 - 0.05 * step * step) / turned.norm());
                let u = &from.y + inverse * &turned;
                // The obstacle may reach beyond the domain; faces may not be placed there.
                let inside = (0..k).all(|j| u[j].abs() <= 1.0);
                (inside && !self.domain.is_free(&u)).then_some(u)
            });
            match nearer {
                Some(u) => {
                    let boundary = self.bisect(&u, &from.y, SEARCH_HALVINGS);
                    w = &self.ellipsoid.A * (&boundary - &from.y);
                    moved = true;
                }
                None => step *= 0.5,
            }
        }
        if moved { self.bisect(&(&from.y + inverse * &w), &from.y, 60) } else { from.boundary.clone() }
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

/// Unit vectors orthogonal to `w`, each with its opposite: a basis of the tangent space.
fn tangents(w: &DVector<f64>) -> Vec<DVector<f64>> {
    let k = w.len();
    let mut basis: Vec<DVector<f64>> = vec![w.normalize()];
    // Axes that are nearly parallel to w come last, so that what is left of the others is long.
    let mut axes: Vec<usize> = (0..k).collect();
    axes.sort_by(|&i, &j| w[i].abs().total_cmp(&w[j].abs()));
    for j in axes {
        if basis.len() == k {
            break;
        }
        let mut tangent = DVector::zeros(k);
        tangent[j] = 1.0;
        for other in &basis {
            tangent -= tangent.dot(other) * other;
        }
        let norm = tangent.norm();
        if norm > 1e-6 {
            basis.push(tangent / norm);
        }
    }
    basis[1..].iter().flat_map(|t| [t.clone(), -t]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::Coordinates;
    use crate::free_space::FreeWhere;
    use convex_sets::Hyperrectangle;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    /// A face placed in the square [-1, 1]² where `is_free`, for an ellipsoid about the origin.
    fn placed(
        is_free: fn(&[f64]) -> bool,
        A: DMatrix<f64>,
        collision: &[f64],
        witness: &[f64],
    ) -> Option<Face> {
        let limits = Hyperrectangle { lower: vector(&[-1.0, -1.0]), upper: vector(&[1.0, 1.0]) };
        let coordinates = Coordinates::new(limits.clone(), &[true, true]);
        let free = FreeWhere(is_free);
        let domain = Domain::new(&coordinates, &free, &vector(&[1.0, 1.0]), &limits);
        let ellipsoid = Hyperellipsoid { A, center: vector(&[0.0, 0.0]) };
        let witness = vector(witness);
        let placing = Placing::new(&domain, &ellipsoid, &witness, 1e-6);
        placing.nearest_face(&placing.walk(&vector(collision)))
    }

    #[test]
    fn face_of_a_flat_obstacle_is_its_own() {
        let wall = |q: &[f64]| q[0] + 0.5 * q[1] < 0.4;
        let face = placed(wall, DMatrix::identity(2, 2), &[0.9, -0.7], &[0.0, 0.0]).unwrap();
        let normal = vector(&[1.0, 0.5]).normalize();
        assert!((&face.a - &normal).norm() < 2e-3, "{face:?}");
        assert!((face.b - 0.4 / 1.25_f64.sqrt()).abs() < 1e-4, "{face:?}");
    }

    #[test]
    fn face_of_a_disc_is_tangent_to_both() {
        let disc = |q: &[f64]| (q[0] - 0.8).hypot(q[1]) > 0.3;
        let face = placed(disc, DMatrix::identity(2, 2), &[0.75, 0.2], &[0.0, 0.0]).unwrap();
        assert!((face.a - vector(&[1.0, 0.0])).norm() < 5e-3);
        assert!((face.b - 0.5).abs() < 1e-4);
    }

    #[test]
    fn witness_stays_inside() {
        // The level set of a long ellipse would cut the witness off.
        let disc = |q: &[f64]| (q[0] - 0.5).hypot(q[1] - 0.5) > 0.1;
        let A = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 20.0]);
        for witness in [[0.0, 0.9], [0.9, 0.9], [0.49, 0.39]] {
            let face = placed(disc, A.clone(), &[0.5, 0.5], &witness).unwrap();
            assert!(face.a.dot(&vector(&witness)) < face.b, "{witness:?} {face:?}");
            assert!(face.a.dot(&vector(&[0.5, 0.5])) > face.b, "{witness:?} {face:?}");
        }
    }

    #[test]
    fn tangents_are_orthonormal() {
        let w = vector(&[0.0, 3.0, -1.0, 0.5]);
        let basis = tangents(&w);
        assert_eq!(basis.len(), 6);
        for (i, s) in basis.iter().enumerate() {
            assert!(s.dot(&w).abs() < 1e-12 && (s.norm() - 1.0).abs() < 1e-12);
            assert!(basis.iter().enumerate().all(|(j, t)| i / 2 == j / 2 || s.dot(t).abs() < 1e-12));
        }
    }
}
