//! A path through regions: straight pieces between bends, verified without a tolerance.

use crate::leaf_frame::LeafFrame;
use convex_sets::HPolyhedron;
use manipulation::contains_exactly;
use nalgebra::DVector;

/// Straight pieces; piece i runs from `points[i]` to `points[i + 1]` inside region `regions[i]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Positions of the regions, one a piece.
    pub regions: Vec<usize>,
    /// Start, bends, goal: one more than pieces.
    pub points: Vec<DVector<f64>>,
}

impl Path {
    /// Sum of the lengths of the pieces, in C-space units.
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|ends| (&ends[1] - &ends[0]).norm()).sum()
    }

    /// Whether every piece lies in its polytope and every bend on the leaf: both ends in the polytope, judged by
    /// outward rounding, so that all of the piece is, by convexity. The last point is the plan's, whatever it keeps.
    pub fn is_verified(&self, free: &[Option<HPolyhedron>], frame: &LeafFrame) -> bool {
        self.points.len() == self.regions.len() + 1
            && self.points[..self.regions.len()].iter().all(|q| frame.keeps_forms(q))
            && self.regions.iter().zip(self.points.windows(2)).all(|(&region_idx, ends)| {
                free.get(region_idx)
                    .and_then(Option::as_ref)
                    .is_some_and(|P| ends.iter().all(|q| contains_exactly(P, q)))
            })
    }

    /// The pieces as Bézier curves of `order` ≥ 1, all control points in their polytope and on the leaf. With
    /// continuity C0 a shortest curve of any order is made of straight pieces, so the control points are spread
    /// evenly along them; where a spread point rounds out of its polytope it moves to the nearer end of its piece.
    pub fn bezier_pieces(
        &self,
        order: usize,
        free: &[Option<HPolyhedron>],
        frame: &LeafFrame,
    ) -> Vec<Vec<DVector<f64>>> {
        let piece = |(&region_idx, ends): (&usize, &[DVector<f64>])| {
            let (first, last) = (&ends[0], &ends[1]);
            let (u_first, u_last) = (frame.u_of(first), frame.u_of(last));
            let control_point = |i: usize| {
                let t = i as f64 / order as f64;
                let nearer = if 2 * i <= order { first } else { last };
                if i == 0 || i == order {
                    return nearer.clone();
                }
                let inside = |q: &DVector<f64>| {
                    free.get(region_idx).and_then(Option::as_ref).is_some_and(|P| contains_exactly(P, q))
                };
                frame.place(&(&u_first * (1.0 - t) + &u_last * t)).filter(inside).unwrap_or(nearer.clone())
            };
            (0..=order.max(1)).map(control_point).collect()
        };
        self.regions.iter().zip(self.points.windows(2)).map(piece).collect()
    }
}
