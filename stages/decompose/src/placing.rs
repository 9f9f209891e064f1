//! Faces that cut collisions away.
//!
//! In the metric of the ellipsoid ‖A (u - c)‖, a collision is walked by bisection towards the center, and then along
//! the boundary of the obstacle to where it comes nearest (`iris_zo`, `iris_np2`). The face there is tangent to the
//! ellipsoid's level set, as the pair that collides sees it (`pair_metric`).
//!
//! What must stay inside, the *witness*, changes the target: the nearest point y of the hull of c and the witness
//! takes the place of c. The face is then orthogonal, in the metric, to s - y, so the whole hull stays on its inner
//! side.

use convex_sets::Hyperellipsoid;
use nalgebra::DVector;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use crate::domain::Domain;
use crate::iris_np2::gradient_search;
use crate::iris_zo::{FIRST_STEP, compass_search};
use crate::pair_metric::PairMetric;
use crate::seed::Witness;

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
    pub(crate) boundary: DVector<f64>,
    /// Free point that it was walked to.
    pub(crate) y: DVector<f64>,
    /// Distance from y in the metric.
    pub(crate) distance: f64,
    /// Distances as the pair sees them that collides there.
    metric: Rc<PairMetric>,
}

/// How the nearest collision is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Search {
    /// By collision checks alone.
    Compass,
    /// Along gradients of gaps.
    Gradient,
}

/// Places faces around one ellipsoid.
pub(crate) struct Placing<'a, 'd> {
    domain: &'a Domain<'d>,
    ellipsoid: &'a Hyperellipsoid,
    witness: &'a Witness,
    center_is_free: bool,
    /// Metres of displacement between a face and its collision.
    margin: f64,
    search: Search,
    /// Metrics of the pairs met so far.
    metrics: RefCell<BTreeMap<Option<usize>, Rc<PairMetric>>>,
}

impl<'a, 'd> Placing<'a, 'd> {
    /// `witness` is free.
    pub(crate) fn new(
        domain: &'a Domain<'d>,
        ellipsoid: &'a Hyperellipsoid,
        witness: &'a Witness,
        margin: f64,
        search: Search,
    ) -> Self {
        let center_is_free = domain.is_free(&ellipsoid.center);
        let metrics = RefCell::default();
        Self { domain, ellipsoid, witness, center_is_free, margin, search, metrics }
    }

    pub(crate) fn domain(&self) -> &'a Domain<'d> {
        self.domain
    }

    /// Walks a collision towards the center, or to what takes its place.
    pub(crate) fn walk(&self, collision: &DVector<f64>) -> Boundary {
        if self.center_is_free {
            let boundary = self.walk_to(collision, &self.ellipsoid.center);
            if self.face(&boundary).is_some() {
                return boundary;
            }
            let y = self.witness.nearest_with_center(self.ellipsoid, collision);
            if self.domain.is_free(&y) {
                let boundary = self.walk_to(collision, &y);
                if self.face(&boundary).is_some() {
                    return boundary;
                }
            }
        }
        self.walk_to(collision, &self.witness.nearest(self.ellipsoid, collision))
    }

    /// The face where the obstacle comes nearest; `None` if rounding leaves no room before the witness.
    pub(crate) fn nearest_face(&self, from: &Boundary) -> Option<Face> {
        let nearest = match self.search {
            Search::Compass => compass_search(self, &from.metric, &from.boundary, &from.y, FIRST_STEP),
            Search::Gradient => gradient_search(self, &from.metric, from),
        };
        self.face_at(&nearest, from)
    }

    /// The face where the collision was walked to.
    pub(crate) fn face(&self, from: &Boundary) -> Option<Face> {
        self.face_at(&from.boundary, from)
    }

    /// Of `faces` the one that, moved inwards until it cuts `from` off, keeps the largest share of its distance from
    /// the center, with its position; `None` if none keeps the share `least`. A face that is tilted by the search's last step leaves a
    /// wedge of collisions; seen from the center, their own faces would cut across a passage.
    pub(crate) fn shifted(&self, faces: &[Face], from: &Boundary, least: f64) -> Option<(usize, Face)> {
        let mut best: Option<(f64, usize, f64)> = None;
        for (place, face) in faces.iter().enumerate() {
            let b = face.b.min(face.a.dot(&from.boundary) - self.shift(&face.a));
            let distance = face.b - face.a.dot(&from.y);
            let share = (b - face.a.dot(&from.y)) / distance;
            let keeps = distance > 0.0 && share >= least && self.witness.is_below(&face.a, b);
            if keeps && best.is_none_or(|(most, _, _)| share > most) {
                best = Some((share, place, b));
            }
        }
        best.map(|(_, place, b)| {
            (place, Face { a: faces[place].a.clone(), b, boundary: from.boundary.clone() })
        })
    }

    /// Distance of the witness from a face that it lies below.
    pub(crate) fn room(&self, face: &Face) -> f64 {
        self.witness.ends().into_iter().map(|end| face.b - face.a.dot(end)).fold(f64::INFINITY, f64::min)
    }

    /// The margin along `a`, in units of the domain.
    fn shift(&self, a: &DVector<f64>) -> f64 {
        let per_unit = self.domain.displacement(a);
        if per_unit > 0.0 { self.margin / per_unit } else { 0.0 }
    }

    fn walk_to(&self, collision: &DVector<f64>, y: &DVector<f64>) -> Boundary {
        let all = self.metric(None);
        let boundary = self.bisect(&all, collision, y, 60);
        let distance = (&self.ellipsoid.A * (&boundary - y)).norm();
        let metric = self.metric(self.domain.colliding_pair(&boundary));
        Boundary { collision: collision.clone(), boundary, y: y.clone(), distance, metric }
    }

    /// Distances as a pair sees them.
    fn metric(&self, pair_idx: Option<usize>) -> Rc<PairMetric> {
        let metric = || {
            Rc::new(match (pair_idx, self.domain.pairs()) {
                (Some(pair_idx), Some(pairs)) => {
                    PairMetric::of_pair(self.domain, pairs, pair_idx, &self.ellipsoid.A)
                }
                _ => PairMetric::of_all(&self.ellipsoid.A),
            })
        };
        self.metrics.borrow_mut().entry(pair_idx).or_insert_with(metric).clone()
    }

    /// The face through `boundary` as seen from y, unless it cuts the witness off.
    fn face_at(&self, boundary: &DVector<f64>, from: &Boundary) -> Option<Face> {
        let y = &from.y;
        let normal = from.metric.normal(boundary, y);
        let norm = normal.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        let a = normal / norm;
        let room = a.dot(&(boundary - y));
        let b = a.dot(boundary) - self.shift(&a).min(0.5 * room);
        self.witness.is_below(&a, b).then(|| Face { a, b, boundary: boundary.clone() })
    }

    /// The end of the last bisection step, from `collision` towards the free point `y`, that the metric's pair blocks.
    pub(crate) fn bisect(
        &self,
        metric: &PairMetric,
        collision: &DVector<f64>,
        y: &DVector<f64>,
        n_halvings: usize,
    ) -> DVector<f64> {
        let whole = collision - y;
        let length = self.domain.displacement(&whole);
        let (mut free, mut blocked) = (0.0, 1.0);
        for _ in 0..n_halvings {
            if (blocked - free) * length <= 0.25 * self.margin {
                break;
            }
            let middle = 0.5 * (free + blocked);
            if metric.blocks(self.domain, &(y + middle * &whole)) {
                blocked = middle;
            } else {
                free = middle;
            }
        }
        y + blocked * whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::Coordinates;
    use crate::free_space::FreeWhere;
    use convex_sets::Hyperrectangle;
    use nalgebra::DMatrix;

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
        let witness = Witness::Point(vector(witness));
        let placing = Placing::new(&domain, &ellipsoid, &witness, 1e-6, Search::Compass);
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
}
