//! The bottle cap with regions made by hand from its known free intervals: boxes and slanted prisms over the cap's range.

#![allow(dead_code, reason = "each test uses a part of it")]
#![allow(clippy::approx_constant, reason = "the scene says 3.14")]

use convex_sets::HPolyhedron;
use manipulation::{Manipulation, Outer};
use nalgebra::{DMatrix, DVector};
use scene::{Space, Task};

/// Free gripper intervals inside the grasp band.
pub const LOW: (f64, f64) = (-0.8065, -0.6436);
/// The longer one.
pub const HIGH: (f64, f64) = (0.3598, 1.0);

/// A task over regions, with everything a question needs.
pub struct Fixture {
    /// Sets over the regions.
    pub manipulation: Manipulation,
    /// x_0.
    pub start: DVector<f64>,
    /// x_{2ℓ+1}.
    pub goal: DVector<f64>,
    /// Ids.
    pub region_ids: Vec<u64>,
    /// Names.
    pub coordinates: Vec<String>,
}

impl Fixture {
    /// A fixture from parts; ids are 10, 11, ….
    pub fn new(joint_box: Outer, task: &Task, regions: &[HPolyhedron], names: &[&str]) -> Self {
        Self {
            manipulation: Manipulation::from_parts(joint_box, task, regions).unwrap(),
            start: task.start.clone(),
            goal: task.goal.clone(),
            region_ids: (10..10 + regions.len() as u64).collect(),
            coordinates: names.iter().map(|name| name.to_string()).collect(),
        }
    }

    /// The question for at most `max_grasps` grasps.
    pub fn question(&self, max_grasps: usize) -> miqp::Question<'_> {
        miqp::Question {
            manipulation: &self.manipulation,
            region_ids: &self.region_ids,
            coordinates: &self.coordinates,
            start: &self.start,
            goal: &self.goal,
            max_grasps,
            cuts: &[],
        }
    }
}

fn vector(x: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(x)
}

/// Joint box of the 3- or 4-DOF bottle cap.
pub fn joint_box(dim: usize) -> Outer {
    let lower = [-3.14, -1.0, -0.055, 0.0];
    let upper = [3.14, 1.0, 0.0, 0.055];
    Outer { lower: vector(&lower[..dim]), upper: vector(&upper[..dim]) }
}

/// The task `open`.
pub fn task(dim: usize) -> Task {
    let joint_box = joint_box(dim);
    let whole = Space { lower: joint_box.lower.clone(), upper: joint_box.upper.clone(), rows: Vec::new() };
    let mut grasp = whole.clone();
    (grasp.lower[2], grasp.upper[2]) = (-0.025, -0.024);
    if dim == 4 {
        (grasp.lower[3], grasp.upper[3]) = (0.024, 0.025);
    }
    let unit = |k: usize| {
        let mut form = DVector::zeros(dim);
        form[k] = 1.0;
        form
    };
    let mut transfer_keep = vec![unit(1) - unit(0), unit(2)];
    if dim == 4 {
        transfer_keep.push(unit(3));
    }
    Task {
        name: "open".to_owned(),
        start: vector(&[-3.14, -0.78, -0.025, 0.055][..dim]),
        goal: vector(&[3.14, -0.78, -0.03, 0.04][..dim]),
        max_grasps: 12,
        clearance: 0.0,
        grasp,
        placement: whole,
        transfer_keep,
        transit_keep: vec![unit(0)],
    }
}

/// A prism over the cap's whole range: gripper and finger between bounds, plus rows `a·(gripper, finger) ≤ b`, unit in
/// (gripper, finger). In 4 DOF the other finger is free beyond 0.024.
pub fn prism(dim: usize, gripper: (f64, f64), finger: (f64, f64), rows: &[[f64; 3]]) -> HPolyhedron {
    let joint_box = joint_box(dim);
    let (mut lower, mut upper) = (joint_box.lower, joint_box.upper);
    (lower[1], upper[1]) = gripper;
    (lower[2], upper[2]) = finger;
    if dim == 4 {
        lower[3] = 0.024;
    }
    let mut A = DMatrix::zeros(rows.len(), dim);
    let mut b = DVector::zeros(rows.len());
    for (row_idx, row) in rows.iter().enumerate() {
        let norm = row[0].hypot(row[1]);
        (A[(row_idx, 1)], A[(row_idx, 2)], b[row_idx]) = (row[0] / norm, row[1] / norm, row[2] / norm);
    }
    HPolyhedron::from_box(&lower, &upper).intersection(&HPolyhedron { A, b })
}

/// Three regions: both free intervals down to contact, and what joins them with the finger open.
pub fn three_regions(dim: usize) -> Vec<HPolyhedron> {
    vec![
        prism(dim, LOW, (-0.055, -0.024), &[]),
        prism(dim, HIGH, (-0.055, -0.024), &[]),
        prism(dim, (LOW.0, HIGH.1), (-0.055, -0.0424), &[]),
    ]
}

/// Many regions, as a clique cover gives them: slanted ones that overlap, none of which covers an interval alone, but the
/// whole intervals are covered at the deep end of the band.
pub fn many_regions(dim: usize, n_each: usize) -> Vec<HPolyhedron> {
    let mut regions = three_regions(dim)[2..].to_vec();
    for (lower, upper) in [LOW, HIGH] {
        let width = upper - lower;
        for part in 0..n_each {
            let from = lower + width * part as f64 / (n_each as f64 + 1.0);
            let to = lower + width * (part as f64 + 2.0) / (n_each as f64 + 1.0);
            // A slanted face that takes more of the interval the nearer the finger is to contact.
            let slope = 0.02 + 0.003 * part as f64;
            regions.push(prism(
                dim,
                (from, to),
                (-0.055, -0.024),
                &[[slope, 1.0, -0.0242 + slope * (to - 0.3 * (to - from))]],
            ));
            regions.push(prism(dim, (from, to), (-0.055, -0.0245), &[[-slope, 1.0, -0.0242 - slope * from]]));
            regions.push(prism(dim, (from, to), (-0.05 + 0.001 * part as f64, -0.0242), &[]));
        }
    }
    regions
}

/// The reference task over given regions.
pub fn fixture(dim: usize, regions: &[HPolyhedron]) -> Fixture {
    let names = ["cap", "gripper", "left_finger", "right_finger"];
    Fixture::new(joint_box(dim), &task(dim), regions, &names[..dim])
}
