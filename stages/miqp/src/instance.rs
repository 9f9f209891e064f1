//! The combinatorial data of a task: which regions each waypoint may lie in.

use crate::cut::Cut;
use crate::error::MiqpError;
use crate::exact::contains;
use crate::proof::Relations;
use convex_sets::HPolyhedron;
use ipc_types::artefact::LeafCut;
use manipulation::{Manipulation, Outer, PathMode, proven_box, proven_contained, solve};
use nalgebra::DVector;

/// A set that a grasp or release may lie in: CG ∩ CP ∩ P_j.
#[derive(Debug, Clone)]
pub struct WaypointSet {
    /// Position j of the region.
    pub region_idx: usize,
    /// CG ∩ CP ∩ P_j with faces that others imply left out: a superset by rounding at most, so bounds stay valid.
    pub polytope: HPolyhedron,
    /// A box proven to contain it.
    pub outer: Outer,
    /// Some of its points, up to rounding: its extremes along the axes.
    pub points: Vec<DVector<f64>>,
}

/// Task, sets and cuts.
#[derive(Debug, Clone)]
pub struct Instance<'a> {
    /// The sets of the task.
    pub manipulation: &'a Manipulation,
    /// x_0.
    pub start: DVector<f64>,
    /// x_{2ℓ+1}.
    pub goal: DVector<f64>,
    /// Regions whose part in CP holds the start (exactly).
    pub start_regions: Vec<usize>,
    /// Regions whose part in CP holds the goal (exactly).
    pub goal_regions: Vec<usize>,
    /// CG ∩ CP ∩ P_j by j; `None` if proven empty, or contained in another one of the same connected regions.
    pub waypoint_sets: Vec<Option<WaypointSet>>,
    /// Leaf cuts.
    pub cuts: Vec<Cut>,
    /// Connected regions, and which sets are empty or not needed, as far as it is proven.
    pub relations: Relations,
}

impl<'a> Instance<'a> {
    /// The instance of `manipulation` from `start` to `goal`; `region_ids` names the regions that `cuts` speak of.
    pub fn new(
        manipulation: &'a Manipulation,
        start: DVector<f64>,
        goal: DVector<f64>,
        region_ids: &[u64],
        cuts: &[LeafCut],
    ) -> Result<Self, MiqpError> {
        let holding = |q: &DVector<f64>| -> Vec<usize> {
            let free = manipulation.free(PathMode::Transit);
            (0..free.len()).filter(|&idx| free[idx].as_ref().is_some_and(|P| contains(P, q))).collect()
        };
        let mut relations = Relations::new(manipulation);
        let waypoint_sets =
            without_dominated(waypoint_sets(manipulation, &relations), manipulation, &mut relations);
        Ok(Self {
            start_regions: holding(&start),
            goal_regions: holding(&goal),
            waypoint_sets,
            cuts: Cut::all(manipulation, &mut relations, region_ids, cuts)?,
            relations,
            manipulation,
            start,
            goal,
        })
    }

    /// Regions that a grasp or release may lie in.
    pub fn inner_regions(&self) -> Vec<usize> {
        (0..self.waypoint_sets.len()).filter(|&idx| self.waypoint_sets[idx].is_some()).collect()
    }

    /// Whether regions `a` and `b` belong to one connected region of the space of `mode`.
    pub fn connected(&self, mode: PathMode, a: usize, b: usize) -> bool {
        self.class(mode, a).is_some_and(|class| self.class(mode, b) == Some(class))
    }

    /// The connected region of the space of `mode` that region `idx` belongs to, named by its first member.
    pub fn class(&self, mode: PathMode, idx: usize) -> Option<usize> {
        self.relations.class(mode, idx)
    }
}

fn waypoint_sets(manipulation: &Manipulation, relations: &Relations) -> Vec<Option<WaypointSet>> {
    let joint_box = &manipulation.joint_box;
    (0..manipulation.regions.len())
        .map(|region_idx| {
            if relations.has_no_waypoint(region_idx) {
                return None;
            }
            let P = match &manipulation.grasp_placement[region_idx] {
                Some(P) => P.clone(),
                // Empty, but by so little that the proof says nothing of it.
                None => relations.waypoint_sets[region_idx].polyhedron(),
            };
            let outer = proven_box(&P, joint_box).unwrap_or_else(|| joint_box.clone());
            let polytope = P.remove_redundant().unwrap_or(P);
            let points = extremes(&polytope, &outer);
            Some(WaypointSet { region_idx, polytope, outer, points })
        })
        .collect()
}

/// Points of `P` that are extreme along the axes, up to rounding.
fn extremes(P: &HPolyhedron, outer: &Outer) -> Vec<DVector<f64>> {
    let n = P.ambient_dimension();
    let directions = (0..2 * n).map(|idx| {
        DVector::from_fn(n, |k, _| match (k == idx / 2, idx % 2) {
            (false, _) => 0.0,
            (true, 0) => 1.0,
            (true, _) => -1.0,
        })
    });
    directions.filter_map(|c| solve(&c, P, outer)?.optimal_point().cloned()).collect()
}

/// Drops a set that is proven to lie in another one of the same connected regions. With leaf cuts this stays right:
/// a point of both sets lies in their overlap, which is an exit of every cut that parts the two regions.
fn without_dominated(
    mut sets: Vec<Option<WaypointSet>>,
    manipulation: &Manipulation,
    relations: &mut Relations,
) -> Vec<Option<WaypointSet>> {
    for a in 0..sets.len() {
        let dominated = (0..sets.len()).filter(|&b| b != a).any(|b| {
            let (Some(inner), Some(other)) = (&sets[a], &manipulation.grasp_placement[b]) else {
                return false;
            };
            sets[b].is_some()
                && [PathMode::Transit, PathMode::Transfer]
                    .iter()
                    .all(|&mode| relations.class(mode, a) == relations.class(mode, b))
                // The polytope may be a hair larger than the set; what is proven of it holds for the set.
                && proven_contained(&inner.polytope, other, &inner.outer)
                && relations.prove_contained(manipulation, a, b)
        });
        if dominated {
            sets[a] = None;
        }
    }
    sets
}
