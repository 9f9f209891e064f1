//! Where a region grows: a first ellipsoid, and the witness, a free point or segment that stays in the region.

use convex_sets::{Hyperellipsoid, min_enclosing_ellipsoid};
use nalgebra::DVector;

/// What stays inside: a free point, or a free segment. In the domain's units u.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Witness {
    Point(DVector<f64>),
    Segment(DVector<f64>, DVector<f64>),
}

/// Where to grow; all in the domain's units u.
#[derive(Debug, Clone)]
pub(crate) struct Seed {
    /// The first ellipsoid.
    pub(crate) ellipsoid: Hyperellipsoid,
    /// What stays in the region.
    pub(crate) witness: Witness,
}

/// Half-width of a segment's first ellipsoid across it, as a share of the domain's.
const SEGMENT_HALF_AXIS: f64 = 0.05;

impl Seed {
    /// An ellipsoid about a free point.
    pub(crate) fn new(ellipsoid: Hyperellipsoid, witness: DVector<f64>) -> Self {
        Self { ellipsoid, witness: Witness::Point(witness) }
    }

    /// A ball of half the domain's size around a free point.
    pub(crate) fn ball(witness: DVector<f64>) -> Self {
        Self::new(Hyperellipsoid::ball(witness.clone(), 0.5), witness)
    }

    /// A long ellipsoid about a free segment; a ball if both ends are one point.
    pub(crate) fn segment(end_0: DVector<f64>, end_1: DVector<f64>) -> Self {
        let middle = 0.5 * (&end_0 + &end_1);
        let around = min_enclosing_ellipsoid(&[end_0.clone(), end_1.clone()], SEGMENT_HALF_AXIS);
        let ellipsoid = match around {
            Some(around) if end_0 != end_1 => Hyperellipsoid { A: around.A, center: middle },
            _ => Hyperellipsoid::ball(middle, 0.5),
        };
        Self { ellipsoid, witness: Witness::Segment(end_0, end_1) }
    }
}

impl Witness {
    /// One of its points: where walks start.
    pub(crate) fn point(&self) -> DVector<f64> {
        match self {
            Self::Point(w) => w.clone(),
            Self::Segment(w_0, w_1) => 0.5 * (w_0 + w_1),
        }
    }

    /// The points whose hull it is.
    pub(crate) fn ends(&self) -> Vec<&DVector<f64>> {
        match self {
            Self::Point(w) => vec![w],
            Self::Segment(w_0, w_1) => vec![w_0, w_1],
        }
    }

    /// Whether all of it lies strictly below the face a·u = b.
    pub(crate) fn is_below(&self, a: &DVector<f64>, b: f64) -> bool {
        self.ends().into_iter().all(|end| a.dot(end) < b)
    }

    /// Its point nearest to `s` in the metric of `ellipsoid`.
    pub(crate) fn nearest(&self, ellipsoid: &Hyperellipsoid, s: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::Point(w) => w.clone(),
            Self::Segment(w_0, w_1) => nearest_on_segment(ellipsoid, w_0, w_1, s),
        }
    }

    /// The point of the hull of the ellipsoid's center and the witness that is nearest to `s` in the metric.
    pub(crate) fn nearest_with_center(&self, ellipsoid: &Hyperellipsoid, s: &DVector<f64>) -> DVector<f64> {
        let c = &ellipsoid.center;
        match self {
            Self::Point(w) => nearest_on_segment(ellipsoid, c, w, s),
            Self::Segment(w_0, w_1) => nearest_on_triangle(ellipsoid, [c, w_0, w_1], s),
        }
    }
}

/// The point of the segment from `p` to `q` nearest to `s` in the metric.
fn nearest_on_segment(
    ellipsoid: &Hyperellipsoid,
    p: &DVector<f64>,
    q: &DVector<f64>,
    s: &DVector<f64>,
) -> DVector<f64> {
    let along = q - p;
    let A_along = &ellipsoid.A * &along;
    let A_s = &ellipsoid.A * (s - p);
    let square = A_along.norm_squared();
    let t = if square > 0.0 { (A_along.dot(&A_s) / square).clamp(0.0, 1.0) } else { 0.0 };
    p + t * along
}

/// The point of a triangle nearest to `s` in the metric: inside it, or on one of its sides.
fn nearest_on_triangle(
    ellipsoid: &Hyperellipsoid,
    [c, p, q]: [&DVector<f64>; 3],
    s: &DVector<f64>,
) -> DVector<f64> {
    let (e, f, r) = (&ellipsoid.A * (p - c), &ellipsoid.A * (q - c), &ellipsoid.A * (s - c));
    let (ee, ef, ff) = (e.dot(&e), e.dot(&f), f.dot(&f));
    let determinant = ee * ff - ef * ef;
    if determinant > 1e-12 * ee * ff {
        let alpha = (ff * e.dot(&r) - ef * f.dot(&r)) / determinant;
        let beta = (ee * f.dot(&r) - ef * e.dot(&r)) / determinant;
        if alpha >= 0.0 && beta >= 0.0 && alpha + beta <= 1.0 {
            return c + alpha * (p - c) + beta * (q - c);
        }
    }
    let mut best = nearest_on_segment(ellipsoid, p, q, s);
    for end in [p, q] {
        let other = nearest_on_segment(ellipsoid, c, end, s);
        let distance = |y: &DVector<f64>| (&ellipsoid.A * (s - y)).norm();
        if distance(&other) < distance(&best) {
            best = other;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    #[test]
    fn nearest_points_of_a_triangle_against_a_grid() {
        let A = DMatrix::from_row_slice(2, 2, &[1.0, 0.3, 0.0, 5.0]);
        let ellipsoid = Hyperellipsoid { A: A.clone(), center: vector(&[0.1, -0.2]) };
        let (p, q) = (vector(&[0.9, 0.1]), vector(&[-0.3, 0.8]));
        let witness = Witness::Segment(p.clone(), q.clone());
        for s in [[2.0, 1.0], [-1.0, -1.0], [0.2, 0.2], [1.0, -0.5], [-2.0, 0.3], [-0.2, 3.0]] {
            let s = vector(&s);
            let y = witness.nearest_with_center(&ellipsoid, &s);
            let mut least = f64::INFINITY;
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let (alpha, beta) = (i as f64 / 200.0, j as f64 / 200.0);
                    let point = &ellipsoid.center
                        + alpha * (&p - &ellipsoid.center)
                        + beta * (&q - &ellipsoid.center);
                    least = least.min((&A * (&s - point)).norm());
                }
            }
            let found = (&A * (&s - &y)).norm();
            assert!(found <= least + 1e-12 && found > least - 0.02, "{s} {y} {found} {least}");
        }
    }

    #[test]
    fn a_segment_of_one_point_is_a_ball() {
        let w = vector(&[0.5, 0.5]);
        let seed = Seed::segment(w.clone(), w.clone());
        assert_eq!(seed.ellipsoid, Hyperellipsoid::ball(w.clone(), 0.5));
        assert_eq!(seed.witness.nearest(&seed.ellipsoid, &vector(&[3.0, 0.0])), w);
    }
}
