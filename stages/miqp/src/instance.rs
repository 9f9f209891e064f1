//! The combinatorial data of a task: which regions each waypoint may lie in.

use crate::cut::Cut;
use crate::error::MiqpError;
use crate::exact::contains;
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
        Ok(Self {
            start_regions: holding(&start),
            goal_regions: holding(&goal),
            waypoint_sets: without_dominated(waypoint_sets(manipulation), manipulation),
            cuts: Cut::all(manipulation, region_ids, cuts)?,
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
        self.manipulation.connected_regions(mode).same(a, b)
    }

    /// The connected region of the space of `mode` that region `idx` belongs to.
    pub fn class(&self, mode: PathMode, idx: usize) -> Option<usize> {
        self.manipulation.connected_regions(mode).class_of[idx]
    }
}

fn waypoint_sets(manipulation: &Manipulation) -> Vec<Option<WaypointSet>> {
    let joint_box = &manipulation.joint_box;
    manipulation
        .grasp_placement
        .iter()
        .enumerate()
        .map(|(region_idx, P)| {
            let P = P.as_ref()?;
            let outer = proven_box(P, joint_box)?;
            let polytope = P.remove_redundant().unwrap_or_else(|_| P.clone());
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
) -> Vec<Option<WaypointSet>> {
    for a in 0..sets.len() {
        let dominated = (0..sets.len()).filter(|&b| b != a).any(|b| {
            let (Some(inner), Some(other)) = (&sets[a], &manipulation.grasp_placement[b]) else {
                return false;
            };
            sets[b].is_some()
                && [PathMode::Transit, PathMode::Transfer]
                    .iter()
                    .all(|&mode| manipulation.connected_regions(mode).same(a, b))
                // The polytope may be a hair larger than the set; what is proven of it holds for the set.
                && proven_contained(&inner.polytope, other, &inner.outer)
        });
        if dominated {
            sets[a] = None;
        }
    }
    sets
}
