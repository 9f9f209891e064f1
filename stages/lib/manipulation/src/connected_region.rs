//! Connected regions R_k: classes of polytopes that hang together by overlaps (thesis 2, section 5.3.3).
//!
//! They are unions of polytopes and are never replaced by a convex hull, which can contain collisions.

/// The connected regions of a union of polytopes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConnectedRegions {
    /// Class of each polytope; `None` for one that is proven empty.
    pub class_of: Vec<Option<usize>>,
    /// Polytopes of each class, sorted; classes in the order of their first polytope.
    pub members: Vec<Vec<usize>>,
}

impl ConnectedRegions {
    /// Whether polytopes `a` and `b` belong to the same class.
    pub fn same(&self, a: usize, b: usize) -> bool {
        matches!((self.class_of[a], self.class_of[b]), (Some(class_a), Some(class_b)) if class_a == class_b)
    }
}

/// Classes of the polytopes `0 .. present.len()` (those with `present`) under the relation that `pairs` generate:
/// give `Overlaps::open_pairs` for proofs, `Overlaps::interior_pairs` for paths.
pub fn connected_regions(present: &[bool], pairs: impl Iterator<Item = (usize, usize)>) -> ConnectedRegions {
    let mut parent: Vec<usize> = (0..present.len()).collect();
    fn root(parent: &mut [usize], mut idx: usize) -> usize {
        while parent[idx] != idx {
            parent[idx] = parent[parent[idx]];
            idx = parent[idx];
        }
        idx
    }
    for (a, b) in pairs {
        let (root_a, root_b) = (root(&mut parent, a), root(&mut parent, b));
        // The smaller index leads, so a class is named by its first polytope.
        parent[root_a.max(root_b)] = root_a.min(root_b);
    }
    let mut class_of = vec![None; present.len()];
    let mut members: Vec<Vec<usize>> = Vec::new();
    for idx in (0..present.len()).filter(|&idx| present[idx]) {
        let first = root(&mut parent, idx);
        let class = match class_of[first] {
            Some(class) => class,
            None => {
                members.push(Vec::new());
                members.len() - 1
            }
        };
        class_of[idx] = Some(class);
        members[class].push(idx);
    }
    ConnectedRegions { class_of, members }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlap::overlap_of_all;
    use crate::proof::Outer;
    use convex_sets::HPolyhedron;
    use nalgebra::DVector;

    fn square(x: f64, y: f64) -> Option<HPolyhedron> {
        let lower = DVector::from_vec(vec![x, y]);
        Some(HPolyhedron::from_box(&lower, &lower.add_scalar(1.0)))
    }

    #[test]
    fn classes_follow_overlaps_and_touching_counts_only_for_proofs() {
        let squares = [square(0.0, 0.0), square(2.5, 2.5), square(0.5, 0.5), None, square(1.5, 0.0)];
        let outer = Outer { lower: DVector::repeat(2, -5.0), upper: DVector::repeat(2, 5.0) };
        let overlaps = overlap_of_all(&squares, &outer);
        let present: Vec<bool> = squares.iter().map(Option::is_some).collect();
        let paths = connected_regions(&present, overlaps.interior_pairs());
        // Squares 2 and 4 share the edge x = 1.5 only.
        assert_eq!(paths.members, vec![vec![0, 2], vec![1], vec![4]]);
        let proofs = connected_regions(&present, overlaps.open_pairs());
        assert_eq!(proofs.members, vec![vec![0, 2, 4], vec![1]]);
        assert_eq!(proofs.class_of, vec![Some(0), Some(1), Some(0), None, Some(0)]);
        assert!(overlaps.open_pairs().all(|(a, b)| proofs.same(a, b)));
    }

    #[test]
    fn a_later_link_joins_two_classes() {
        let regions = connected_regions(&[true; 4], [(1, 3), (0, 2), (2, 3)].into_iter());
        assert_eq!(regions.members, vec![vec![0, 1, 2, 3]]);
    }
}
