//! The bottle cap with regions and a plan made by hand from its known free intervals.

#![allow(dead_code, reason = "tests and benches use a part of it each")]
#![allow(clippy::approx_constant, reason = "the scene says 3.14")]

use convex_sets::HPolyhedron;
use ipc_types::artefact::{Mode, PlanFile, PlanStatus};
use manipulation::Manipulation;
use nalgebra::{DMatrix, DVector};
use scene::Scene;
use std::path::Path;

/// Free gripper intervals inside the grasp band (scenes.md), a little narrowed.
const LOW: (f64, f64) = (-0.806, -0.644);
const HIGH: (f64, f64) = (0.36, 1.0);

/// Scene `bottle-cap-3dof` or `-4dof`.
pub fn scene(dim: usize) -> Scene {
    let folder = format!("../../scenes/bottle-cap-{dim}dof");
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).expect("a reference scene loads")
}

/// A prism over the cap's range and, in 4 DOF, the right finger beyond the cap: bounds on gripper and left finger, and
/// one row `a gripper + b finger ≤ c`.
fn prism(scene: &Scene, gripper: (f64, f64), finger: (f64, f64), row: [f64; 3]) -> HPolyhedron {
    let (mut lower, mut upper) = (scene.lower(), scene.upper());
    (lower[1], upper[1]) = gripper;
    (lower[2], upper[2]) = finger;
    if scene.dim() == 4 {
        lower[3] = 0.024;
    }
    let norm = row[0].hypot(row[1]);
    let mut A = DMatrix::zeros(1, scene.dim());
    (A[(0, 1)], A[(0, 2)]) = (row[0] / norm, row[1] / norm);
    HPolyhedron::from_box(&lower, &upper)
        .intersection(&HPolyhedron { A, b: DVector::repeat(1, row[2] / norm) })
}

/// `1 + 6 n_each` regions that overlap many times over, as a clique cover gives them: one joins the two intervals with
/// the finger open, the others slant, and each covers a part of an interval.
pub fn regions(scene: &Scene, n_each: usize) -> Vec<HPolyhedron> {
    let mut regions = vec![prism(scene, (LOW.0, HIGH.1), (-0.055, -0.0424), [0.0, 1.0, 0.0])];
    for (from, to) in [LOW, HIGH] {
        let width = (to - from) / n_each as f64;
        for part in 0..n_each {
            let (low, high) =
                ((from + width * (part as f64 - 0.3)).max(from), from + width * (part as f64 + 1.0));
            let slope = 0.01 + 0.002 * part as f64;
            regions.push(prism(scene, (low, high), (-0.055, -0.024), [slope, 1.0, -0.024 + slope * high]));
            regions.push(prism(scene, (low, high), (-0.055, -0.024), [-slope, 1.0, -0.024 - slope * low]));
            regions.push(prism(scene, (low, to), (-0.05, -0.0242), [slope, 1.0, -0.0242 + slope * to]));
        }
    }
    regions
}

/// A plan that turns the cap in the high and in the low interval by turns, so that every transit goes round.
pub fn by_turns(scene: &Scene) -> PlanFile {
    let task = scene.tasks.values().next().expect("a reference scene has a task");
    let snap = |x: f64| (x * (1_u64 << 40) as f64).round() / (1_u64 << 40) as f64;
    let mut configurations = vec![task.start.clone()];
    let mut modes = Vec::new();
    let (mut cap, mut is_high) = (task.start[0], true);
    while cap < task.goal[0] {
        let (low, high) = if is_high { (0.365, 0.985) } else { (-0.8, -0.65) };
        let end = (cap + snap(high - low)).min(task.goal[0]);
        let mut grasp = task.start.clone();
        (grasp[0], grasp[1], grasp[2]) = (cap, snap(low), snap(-0.0245));
        if scene.dim() == 4 {
            grasp[3] = snap(0.0245);
        }
        let mut release = grasp.clone();
        (release[0], release[1]) = (end, grasp[1] + (end - cap));
        configurations.extend([grasp, release]);
        modes.extend([Mode::Transit, Mode::Transfer]);
        (cap, is_high) = (end, !is_high);
    }
    configurations.push(task.goal.clone());
    modes.push(Mode::Transit);
    PlanFile {
        status: PlanStatus::Feasible,
        n_grasps: Some(modes.len() / 2),
        regions: None,
        configurations: Some(configurations.iter().map(|q| q.iter().copied().collect()).collect()),
        modes: Some(modes),
        cost: None,
        lower_bound: None,
        tried: Vec::new(),
    }
}

/// Spaces of the scene's task over `regions`.
pub fn manipulation(scene: &Scene, regions: &[HPolyhedron]) -> Manipulation {
    let task = scene.tasks.values().next().expect("a reference scene has a task");
    Manipulation::new(scene, task, regions).expect("regions of the scene's dimension")
}
