//! Regions that join what sampling left apart.
//!
//! Two sets of overlapping regions that see each other through free space are joined on purpose: a narrow passage
//! has little volume, so a cover of 99 % may miss it, yet a path may need it.

use convex_sets::{HPolyhedron, min_enclosing_ellipsoid};
use nalgebra::DVector;

use crate::coverage::contains;
use crate::domain::Domain;
use crate::seed::Seed;

/// Half-width of a bridge's first ellipsoid across its axis, in units of the domain.
const LEAST_HALF_AXIS: f64 = 0.02;
/// Pairs of points that are looked at for each two components, nearest first.
const N_PAIRS: usize = 40;
/// Points of a component that are looked at.
const MAX_MEMBERS: usize = 300;
/// Bridges tried for each two components.
const N_TRIES: usize = 3;

/// For each region the number of its component: regions overlap with non-empty interior along a chain.
pub(crate) fn components(regions: &[HPolyhedron]) -> Vec<usize> {
    let mut component: Vec<usize> = (0..regions.len()).collect();
    for i in 0..regions.len() {
        for j in 0..i {
            if component[i] != component[j] && regions[i].interior_intersects(&regions[j]) {
                let (from, to) = (component[i].max(component[j]), component[i].min(component[j]));
                component.iter_mut().filter(|c| **c == from).for_each(|c| *c = to);
            }
        }
    }
    // Number them from 0 in the order of their first regions.
    let mut seen: Vec<usize> = Vec::new();
    component
        .into_iter()
        .map(|c| {
            seen.iter().position(|&s| s == c).unwrap_or_else(|| {
                seen.push(c);
                seen.len() - 1
            })
        })
        .collect()
}

/// Seeds of regions that may join two components: for each two, the middle between `points` (free) that see each
/// other.
pub(crate) fn bridge_seeds(
    domain: &Domain<'_>,
    regions: &[HPolyhedron],
    component: &[usize],
    points: &[Vec<f64>],
) -> Vec<Seed> {
    let n_components = component.iter().max().map_or(0, |last| last + 1);
    let mut members: Vec<Vec<DVector<f64>>> = vec![Vec::new(); n_components];
    let mut seeds = Vec::new();
    for q in points {
        if let Some(region_idx) = regions.iter().position(|region| contains(region, q))
            && members[component[region_idx]].len() < MAX_MEMBERS
        {
            members[component[region_idx]].push(domain.u_from_q(q));
        }
    }
    for a in 0..n_components {
        for b in 0..a {
            let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
            for (i, u) in members[a].iter().enumerate() {
                let nearest = members[b].iter().enumerate().map(|(j, v)| ((u - v).norm(), j));
                pairs
                    .extend(nearest.min_by(|p, q| p.0.total_cmp(&q.0)).map(|(distance, j)| (distance, i, j)));
            }
            pairs.sort_by(|p, q| p.0.total_cmp(&q.0));
            let visible = pairs
                .iter()
                .take(N_PAIRS)
                .map(|&(_, i, j)| (&members[a][i], &members[b][j]))
                .filter(|(u, v)| domain.edge_is_free(u, v))
                .take(N_TRIES);
            for (u, v) in visible {
                let witness = 0.5 * (u + v);
                let ends = [u.clone(), v.clone(), witness.clone()];
                if let Some(mut ellipsoid) = min_enclosing_ellipsoid(&ends, LEAST_HALF_AXIS) {
                    ellipsoid.center = witness.clone();
                    seeds.push(Seed::new(ellipsoid, witness));
                }
            }
        }
    }
    seeds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_of_overlap_are_components() {
        let interval = |low: f64, high: f64| {
            HPolyhedron::from_box(&DVector::from_vec(vec![low]), &DVector::from_vec(vec![high]))
        };
        let regions = [
            interval(0.0, 1.0),
            interval(3.0, 4.0),
            interval(0.9, 2.0),
            interval(1.9, 2.5),
            interval(2.5, 3.0),
        ];
        assert_eq!(components(&regions), vec![0, 1, 0, 0, 2]);
        assert!(components(&[]).is_empty());
    }
}
