//! The programme with all regions fixed, and its solution made exact.

use crate::exact::{contains, same_leaf};
use crate::instance::Instance;
use crate::kept_system::{KeptSystem, mode_of_segment};
use crate::relaxation::{add_polytope, add_same_leaf};
use conic::{Affine, ConicError, ConicProgram, Settings, solve};
use convex_sets::HPolyhedron;
use manipulation::Enclosure;
use nalgebra::DVector;

/// Distances to keep from the faces of the regions, tried in turn, as a share of the face's extent over the joint
/// box. The first leaves room for rounding and for paths; the last is for plans that must touch a face.
const MARGINS: [f64; 4] = [1e-6, 1e-8, 1e-10, 0.0];

/// A plan: every waypoint lies in its region in exact arithmetic.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactPlan {
    /// x_0 … x_{2ℓ+1}; the first is the start and the last the goal, bit for bit.
    pub x: Vec<DVector<f64>>,
    /// Region of each waypoint.
    pub regions: Vec<usize>,
    /// Σ ‖x_{i+1} - x_i‖² (Eq. 5.7), rounded up.
    pub cost: f64,
}

/// The cheapest plan with these regions, up to margins; `None` if none was found (which proves nothing).
///
/// `exits`: (segment, cut, exit) that segments must pass.
pub fn plan_in_regions(
    instance: &Instance,
    system: &KeptSystem,
    regions: &[usize],
    exits: &[(usize, usize, usize)],
) -> Result<Option<ExactPlan>, ConicError> {
    if system.is_contradictory() {
        return Ok(None);
    }
    for margin in MARGINS {
        let Some(near) = solve_with_margin(instance, system, regions, exits, margin)? else { continue };
        let mut x = Vec::with_capacity(regions.len());
        x.push(instance.start.clone());
        x.extend(system.snap(&near));
        x.push(instance.goal.clone());
        if is_plan(instance, &x, regions) {
            let cost = cost_above(&x);
            return Ok(Some(ExactPlan { x, regions: regions.to_vec(), cost }));
        }
    }
    Ok(None)
}

/// Whether grasps and releases lie in CG ∩ CP ∩ P_j of their regions exactly, and steps keep their forms: exactly, or,
/// where the scene's numbers allow no doubles that do, to a few units in the last place.
fn is_plan(instance: &Instance, x: &[DVector<f64>], regions: &[usize]) -> bool {
    let manipulation = instance.manipulation;
    let inside = (1..x.len() - 1).all(|waypoint_idx| {
        manipulation.grasp_placement[regions[waypoint_idx]]
            .as_ref()
            .is_some_and(|P| contains(P, &x[waypoint_idx]))
    });
    inside
        && (0..x.len() - 1).all(|segment_idx| {
            let F = manipulation.kept_forms(mode_of_segment(segment_idx));
            let (from, to) = (&x[segment_idx], &x[segment_idx + 1]);
            same_leaf(F, from, to)
                || F.row_iter().all(|form| {
                    let size: f64 = form
                        .iter()
                        .zip(from.iter().zip(to.iter()))
                        .map(|(f, (a, b))| (f * a).abs() + (f * b).abs())
                        .sum();
                    let change: f64 =
                        form.iter().zip(from.iter().zip(to.iter())).map(|(f, (a, b))| f * (b - a)).sum();
                    change.abs() <= 8.0 * f64::EPSILON * size
                })
        })
}

/// Solves the programme in floating point, every face moved in by `margin` times its extent; faces whose value start and
/// goal fix cannot be moved and are left to the exact test.
fn solve_with_margin(
    instance: &Instance,
    system: &KeptSystem,
    regions: &[usize],
    exits: &[(usize, usize, usize)],
    margin: f64,
) -> Result<Option<Vec<DVector<f64>>>, ConicError> {
    let manipulation = instance.manipulation;
    let n = manipulation.dim();
    let last = regions.len() - 1;
    let mut program = ConicProgram::new(n * (last + 1));
    for k in 0..n {
        program.add_equality(vec![(k, 1.0)], instance.start[k]);
        program.add_equality(vec![(last * n + k, 1.0)], instance.goal[k]);
    }
    for segment_idx in 0..last {
        let (from, to) = (segment_idx * n, (segment_idx + 1) * n);
        for k in 0..n {
            program.add_square_cost(2.0, Affine::new(vec![(to + k, 1.0), (from + k, -1.0)], 0.0));
        }
        add_same_leaf(&mut program, manipulation.kept_forms(mode_of_segment(segment_idx)), from, to);
    }
    for waypoint_idx in 1..last {
        let Some(set) = &instance.waypoint_sets[regions[waypoint_idx]] else { return Ok(None) };
        let is_fixed = |k: usize| system.is_fixed(waypoint_idx, k);
        add_polytope(&mut program, &moved_in(instance, &set.polytope, margin, is_fixed), waypoint_idx * n);
    }
    for &(segment_idx, cut_idx, exit_idx) in exits {
        let cut = &instance.cuts[cut_idx];
        let y = program.add_variables(n);
        // At the ends of the chain the leaf is given, and the exit may touch it.
        let margin = if segment_idx == 0 || segment_idx == last - 1 { 0.0 } else { margin };
        add_polytope(&mut program, &moved_in(instance, &cut.exits[exit_idx].polytope, margin, |_| false), y);
        add_same_leaf(&mut program, manipulation.kept_forms(cut.mode), segment_idx * n, y);
    }
    let solution = solve(&program, &Settings::default())?;
    if !solution.status.has_solution() || solution.x.iter().any(|x| !x.is_finite()) {
        return Ok(None);
    }
    let waypoint = |idx: usize| DVector::from_column_slice(&solution.x[idx * n..(idx + 1) * n]);
    Ok(Some((1..last).map(waypoint).collect()))
}

/// `P` with each face moved in by `margin` times its extent over the joint box, without faces over fixed coordinates only.
fn moved_in(
    instance: &Instance,
    P: &HPolyhedron,
    margin: f64,
    is_fixed: impl Fn(usize) -> bool,
) -> HPolyhedron {
    let joint_box = &instance.manipulation.joint_box;
    let kept: Vec<usize> = (0..P.n_faces())
        .filter(|&row_idx| P.A.row(row_idx).iter().enumerate().any(|(k, &a)| a != 0.0 && !is_fixed(k)))
        .collect();
    let mut b = P.b.select_rows(&kept);
    for (idx, &row_idx) in kept.iter().enumerate() {
        let extent: f64 =
            P.A.row(row_idx)
                .iter()
                .enumerate()
                .map(|(k, a)| a.abs() * (joint_box.upper[k] - joint_box.lower[k]))
                .sum();
        b[idx] -= margin * extent;
    }
    HPolyhedron { A: P.A.select_rows(&kept), b }
}

/// Σ ‖x_{i+1} - x_i‖², rounded up.
pub fn cost_above(x: &[DVector<f64>]) -> f64 {
    let mut sum = Enclosure::zero();
    for pair in x.windows(2) {
        // Equal coordinates add exactly nothing.
        for (&from, &to) in pair[0].iter().zip(pair[1].iter()).filter(|(from, to)| from != to) {
            let step = Enclosure::exact(to).minus(Enclosure::exact(from));
            sum = sum.plus(step.times(step));
        }
    }
    sum.upper
}
