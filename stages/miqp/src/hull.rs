//! Polytopes around unions of waypoint sets.
//!
//! The exact hull in perspective form costs variables and rows for every set. The polytope here costs one block: of all
//! faces of the sets those that hold for the whole union, and the bounding box. It contains the hull (each kept face is
//! proven for each set), and where sets are prisms over the same range it is the hull or nearly so.

use crate::instance::{Instance, WaypointSet};
use convex_sets::HPolyhedron;
use manipulation::{Outer, PathMode, proven_maximum};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// A group of at most this many sets is kept as it is: its perspective form is small.
const MAX_KEPT: usize = 2;

/// A face of one set may be exceeded by another one by this share of its extent and still be taken, moved out.
const TOL_SHARED: f64 = 1e-9;

/// Hulls that were made, by the sets they surround.
#[derive(Debug, Default)]
pub struct Hulls {
    known: BTreeMap<Vec<usize>, WaypointSet>,
}

impl Hulls {
    /// What stands for the union of the sets of `regions`: one block for all sets that share both connected regions, or
    /// the sets themselves where they are few. Sorted by region.
    pub fn blocks(&mut self, instance: &Instance, regions: &[usize]) -> Vec<WaypointSet> {
        let mut groups: BTreeMap<(Option<usize>, Option<usize>), Vec<usize>> = BTreeMap::new();
        for &idx in regions {
            let key = (instance.class(PathMode::Transfer, idx), instance.class(PathMode::Transit, idx));
            groups.entry(key).or_default().push(idx);
        }
        let mut blocks = Vec::new();
        for group in groups.into_values() {
            if group.len() <= MAX_KEPT {
                blocks.extend(sets(instance, &group).cloned());
            } else {
                blocks.push(self.around(instance, group));
            }
        }
        blocks.sort_by_key(|block| block.region_idx);
        blocks
    }

    fn around(&mut self, instance: &Instance, group: Vec<usize>) -> WaypointSet {
        if let Some(hull) = self.known.get(&group) {
            return hull.clone();
        }
        let hull = polytope_around(&sets(instance, &group).collect::<Vec<_>>());
        self.known.insert(group, hull.clone());
        hull
    }
}

/// The sets of `regions`.
pub fn sets<'a>(instance: &'a Instance, regions: &'a [usize]) -> impl Iterator<Item = &'a WaypointSet> {
    regions.iter().filter_map(|&idx| instance.waypoint_sets[idx].as_ref())
}

/// The box around all sets and the faces of single sets that hold for all of them. `sets` is not empty.
fn polytope_around(sets: &[&WaypointSet]) -> WaypointSet {
    let n = sets[0].outer.lower.len();
    let mut outer = sets[0].outer.clone();
    for set in &sets[1..] {
        outer.lower = outer.lower.inf(&set.outer.lower);
        outer.upper = outer.upper.sup(&set.outer.upper);
    }
    let mut faces: Vec<(DVector<f64>, f64)> = Vec::new();
    for (own_idx, own) in sets.iter().enumerate() {
        for face_idx in 0..own.polytope.n_faces() {
            let normal = own.polytope.A.row(face_idx).transpose();
            // Bounds on one coordinate are in the box already.
            if normal.iter().filter(|&&a| a != 0.0).count() > 1
                && let Some(offset) = shared_offset(sets, own_idx, &normal, own.polytope.b[face_idx])
            {
                faces.push((normal, offset));
            }
        }
    }
    let mut A = DMatrix::zeros(faces.len(), n);
    let mut b = DVector::zeros(faces.len());
    for (row_idx, (normal, offset)) in faces.iter().enumerate() {
        A.row_mut(row_idx).copy_from(&normal.transpose());
        b[row_idx] = *offset;
    }
    let polytope = HPolyhedron::from_box(&outer.lower, &outer.upper).intersection(&HPolyhedron { A, b });
    let polytope = polytope.remove_redundant().unwrap_or(polytope);
    WaypointSet { region_idx: sets[0].region_idx, polytope, outer, points: Vec::new() }
}

/// The offset with which `normal · x ≤ offset` is proven for all sets, if it is that of the face's own set or hardly
/// more. Known points of the other sets refute most faces without an LP.
fn shared_offset(
    sets: &[&WaypointSet],
    own_idx: usize,
    normal: &DVector<f64>,
    own_offset: f64,
) -> Option<f64> {
    let extent = |outer: &Outer| -> f64 {
        (0..normal.len()).map(|k| normal[k].abs() * (outer.upper[k] - outer.lower[k])).sum()
    };
    let most = own_offset + TOL_SHARED * extent(&sets[own_idx].outer);
    let others = || sets.iter().enumerate().filter(|&(idx, _)| idx != own_idx).map(|(_, set)| set);
    if others().any(|set| set.points.iter().any(|point| normal.dot(point) > most)) {
        return None;
    }
    let mut offset = own_offset;
    for set in others() {
        offset = offset.max(proven_maximum(normal, &set.polytope, &set.outer));
        if offset > most {
            return None;
        }
    }
    Some(offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(lower: [f64; 2], upper: [f64; 2], rows: &[[f64; 3]]) -> WaypointSet {
        let outer =
            Outer { lower: DVector::from_column_slice(&lower), upper: DVector::from_column_slice(&upper) };
        let extra = HPolyhedron {
            A: DMatrix::from_fn(rows.len(), 2, |row, k| rows[row][k]),
            b: DVector::from_fn(rows.len(), |row, _| rows[row][2]),
        };
        let polytope = HPolyhedron::from_box(&outer.lower, &outer.upper).intersection(&extra);
        WaypointSet { region_idx: 0, polytope, outer, points: Vec::new() }
    }

    #[test]
    fn faces_that_hold_for_all_stay_and_others_go() {
        // x + y ≤ 1.5 holds for both, x - y ≤ 0.2 only for the first.
        let first = set([0.0, 0.0], [1.0, 1.0], &[[1.0, 1.0, 1.5], [1.0, -1.0, 0.2]]);
        let second = set([0.5, 0.0], [1.0, 0.5], &[]);
        let hull = polytope_around(&[&first, &second]).polytope;
        let holds = |x: f64, y: f64| hull.contains(&DVector::from_vec(vec![x, y]), 1e-12);
        assert!(!holds(0.9, 0.7));
        assert!(holds(1.0, 0.0) && holds(0.0, 1.0) && holds(1.0, 0.5));
        assert!(!holds(1.1, 0.1));
    }

    proptest::proptest! {
        /// Every point of every set lies in the hull.
        #[test]
        fn the_hull_contains_the_sets(
            corners in proptest::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, 0.1..0.5_f64, 0.1..0.5_f64), 3..6),
            slopes in proptest::collection::vec(-1.0..1.0_f64, 6),
            at in (0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let sets: Vec<WaypointSet> = corners
                .iter()
                .zip(&slopes)
                .map(|(c, slope)| {
                    let middle = slope * (c.0 + 0.6 * c.2) + c.1 + 0.6 * c.3;
                    set([c.0, c.1], [c.0 + c.2, c.1 + c.3], &[[*slope, 1.0, middle]])
                })
                .collect();
            let hull = polytope_around(&sets.iter().collect::<Vec<_>>()).polytope;
            for (set, c) in sets.iter().zip(&corners) {
                let x = DVector::from_vec(vec![c.0 + at.0 * c.2, c.1 + at.1 * c.3]);
                if set.polytope.contains(&x, 0.0) {
                    proptest::prop_assert!(hull.contains(&x, 1e-12));
                }
            }
        }
    }
}
