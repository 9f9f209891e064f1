//! From a relaxed point to regions: the sequence of regions that the point violates least.

use crate::instance::Instance;
use crate::kept_system::mode_of_segment;
use crate::node::Node;
use nalgebra::DVector;

/// A face counts as kept if it is missed by less than this share of its extent over the joint box. Erring side: a
/// point that misses its region by less is taken for a solution until the exact test says otherwise.
pub const TOL_VIOLATION: f64 = 1e-7;

/// Weight of slack against violation when several regions hold a point: the roomier one is taken.
const SLACK_WEIGHT: f64 = 1e-4;

/// Regions for all waypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Region of each waypoint.
    pub regions: Vec<usize>,
    /// (segment, cut, exit) that the point passes where its regions are parted by a cut.
    pub exits: Vec<(usize, usize, usize)>,
    /// (segment, cut) that the point violates.
    pub violated_cuts: Vec<(usize, usize)>,
}

/// How far `x` lies outside the set of `region_idx`: the largest violation of a face as a share of its extent over the
/// joint box; negative inside.
pub fn violation(instance: &Instance, region_idx: usize, x: &DVector<f64>) -> f64 {
    let Some(set) = &instance.waypoint_sets[region_idx] else { return f64::INFINITY };
    let joint_box = &instance.manipulation.joint_box;
    let P = &set.polytope;
    (0..P.n_faces())
        .map(|row_idx| {
            let row = P.A.row(row_idx);
            let extent: f64 =
                (0..x.len()).map(|k| row[k].abs() * (joint_box.upper[k] - joint_box.lower[k])).sum();
            let excess: f64 = (0..x.len()).map(|k| row[k] * x[k]).sum::<f64>() - P.b[row_idx];
            excess / extent.max(f64::MIN_POSITIVE)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// The regions of `node` along the chain with the least sum of `price(waypoint, position in allowed)`, neighbors in one
/// connected region; cuts are respected if that is possible. `None` if no sequence exists.
pub fn assign(
    instance: &Instance,
    node: &Node,
    x: &[DVector<f64>],
    price: impl Fn(usize, usize) -> f64,
) -> Option<Assignment> {
    // Exit that each segment passes for each cut: the one chosen in the node, else one that its leaf meets.
    let mut passed: Vec<Vec<Option<usize>>> = vec![vec![None; instance.cuts.len()]; x.len() - 1];
    for segment_idx in 0..x.len() - 1 {
        for (cut_idx, cut) in instance.cuts.iter().enumerate() {
            if cut.mode == mode_of_segment(segment_idx) {
                passed[segment_idx][cut_idx] = node
                    .chosen_exit(segment_idx, cut_idx)
                    .or_else(|| cut.exit_at(instance.manipulation, &x[segment_idx]));
            }
        }
    }
    let is_cut = |segment_idx: usize, a: usize, b: usize| -> bool {
        instance.cuts.iter().enumerate().any(|(cut_idx, cut)| {
            cut.mode == mode_of_segment(segment_idx)
                && cut.parts(a, b)
                && passed[segment_idx][cut_idx].is_none()
        })
    };
    let regions = cheapest_sequence(instance, node, &price, is_cut)
        .or_else(|| cheapest_sequence(instance, node, &price, |_, _, _| false))?;
    let mut exits = Vec::new();
    let mut violated_cuts = Vec::new();
    for segment_idx in 0..x.len() - 1 {
        for (cut_idx, cut) in instance.cuts.iter().enumerate() {
            let applies = cut.mode == mode_of_segment(segment_idx);
            if applies && cut.parts(regions[segment_idx], regions[segment_idx + 1]) {
                match passed[segment_idx][cut_idx] {
                    Some(exit_idx) => exits.push((segment_idx, cut_idx, exit_idx)),
                    None => violated_cuts.push((segment_idx, cut_idx)),
                }
            }
        }
    }
    Some(Assignment { regions, exits, violated_cuts })
}

/// Price of a region by how far the relaxed point lies outside it.
pub fn price_of_violation(violation: f64) -> f64 {
    if violation > 0.0 { violation } else { SLACK_WEIGHT * violation }
}

/// Dynamic programme along the chain.
fn cheapest_sequence(
    instance: &Instance,
    node: &Node,
    price: &impl Fn(usize, usize) -> f64,
    is_cut: impl Fn(usize, usize, usize) -> bool,
) -> Option<Vec<usize>> {
    let mut best: Vec<f64> = (0..node.allowed[0].len()).map(|position| price(0, position)).collect();
    let mut origin: Vec<Vec<usize>> = Vec::new();
    for segment_idx in 0..node.allowed.len() - 1 {
        let mode = mode_of_segment(segment_idx);
        let (from, to) = (&node.allowed[segment_idx], &node.allowed[segment_idx + 1]);
        let mut next = vec![f64::INFINITY; to.len()];
        let mut next_origin = vec![0; to.len()];
        for (position, &b) in to.iter().enumerate() {
            for (before, &a) in from.iter().enumerate() {
                if best[before] < next[position]
                    && instance.connected(mode, a, b)
                    && !is_cut(segment_idx, a, b)
                {
                    next[position] = best[before];
                    next_origin[position] = before;
                }
            }
            next[position] += price(segment_idx + 1, position);
        }
        best = next;
        origin.push(next_origin);
    }
    let mut position =
        (0..best.len()).filter(|&p| best[p].is_finite()).min_by(|&a, &b| best[a].total_cmp(&best[b]))?;
    let mut regions = vec![node.allowed[node.allowed.len() - 1][position]];
    for segment_idx in (0..origin.len()).rev() {
        position = origin[segment_idx][position];
        regions.push(node.allowed[segment_idx][position]);
    }
    regions.reverse();
    Some(regions)
}
