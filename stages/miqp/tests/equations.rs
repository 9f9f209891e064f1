//! Each constraint of thesis 2, section 5.4.2, on an instance where it decides, with its infeasible twin.

#![allow(clippy::approx_constant, reason = "the scene says 3.14")]

mod bottle_cap;

use bottle_cap::{Fixture, fixture, joint_box, prism, task, three_regions};
use ipc_types::artefact::{Mode, PlanFile, PlanStatus};
use miqp::exact::{contains, same_leaf};
use miqp::{MiqpOptions, NoSink, PlanOutcome, plan};
use nalgebra::DVector;

fn settled(fixture: &Fixture, max_grasps: usize) -> PlanFile {
    match plan(&fixture.question(max_grasps), &MiqpOptions::default(), &mut NoSink, &|| false).unwrap() {
        PlanOutcome::Settled(file) => file,
        PlanOutcome::Open { tried, .. } => panic!("open: {tried:?}"),
    }
}

/// The bottle cap with another start and goal angle of the cap.
fn turned(from: f64, to: f64, regions: &[convex_sets::HPolyhedron]) -> Fixture {
    let mut task = task(3);
    task.start[0] = from;
    task.goal[0] = to;
    Fixture::new(joint_box(3), &task, regions, &["cap", "gripper", "left_finger"])
}

fn points(file: &PlanFile) -> Vec<DVector<f64>> {
    file.configurations.iter().flatten().map(|x| DVector::from_column_slice(x)).collect()
}

#[test]
fn eq_5_4_joint_limits_hold_with_the_cap_at_its_limit() {
    let fixture = turned(-3.14, -2.6, &three_regions(3));
    let file = settled(&fixture, 3);
    let joint_box = joint_box(3);
    for x in points(&file) {
        assert!((0..3).all(|k| joint_box.lower[k] <= x[k] && x[k] <= joint_box.upper[k]));
    }
    assert_eq!(points(&file)[1][0], -3.14);
}

#[test]
fn eq_5_5a_5_5b_transfers_keep_their_forms_exactly() {
    let fixture = turned(0.125, 0.75, &three_regions(3));
    let x = points(&settled(&fixture, 3));
    let F = &fixture.manipulation.F_transfer;
    assert!((1..x.len() - 1).step_by(2).all(|idx| same_leaf(F, &x[idx], &x[idx + 1])));
    // 0.1 is finer as a double than any number near 0.7 less a gripper angle: kept to the last place.
    let x = points(&settled(&turned(0.1, 0.7, &three_regions(3)), 3));
    let kept = F * (&x[2] - &x[1]);
    assert!(kept.amax() <= f64::EPSILON, "{kept}");
    // The twin: a turn of 0.7 is more than one grasp's 0.6402.
    assert_eq!(settled(&fixture, 3).n_grasps, Some(1));
    assert_eq!(settled(&turned(0.1, 0.8, &three_regions(3)), 3).n_grasps, Some(2));
    assert_eq!(settled(&turned(0.1, 0.8, &three_regions(3)), 1).status, PlanStatus::Infeasible);
}

#[test]
fn eq_5_5c_transits_keep_the_object() {
    let fixture = turned(0.1, 1.9, &three_regions(3));
    let file = settled(&fixture, 4);
    let x = points(&file);
    assert!((0..x.len() - 1).step_by(2).all(|idx| x[idx][0] == x[idx + 1][0]));
    let modes = file.modes.unwrap();
    assert!(modes.iter().enumerate().all(|(idx, &mode)| (mode == Mode::Transit) == (idx % 2 == 0)));
}

#[test]
fn eq_5_6a_5_6b_every_waypoint_lies_in_its_region() {
    let fixture = fixture(3, &bottle_cap::many_regions(3, 3));
    let file = settled(&fixture, 12);
    let regions = file.regions.clone().unwrap();
    let x = points(&file);
    for (idx, x) in x.iter().enumerate() {
        let region_idx = fixture.region_ids.iter().position(|&id| id == regions[idx]).unwrap();
        assert!(contains(&fixture.manipulation.regions[region_idx], x));
        if idx > 0 && idx < regions.len() - 1 {
            assert!(contains(&fixture.manipulation.grasp_space, x), "waypoint {idx}");
        }
    }
}

/// Two transfers' worth of gripper range that does not hang together: the hull of both would turn the cap by 1.8 at once.
#[test]
fn eq_5_6d_region_consistency() {
    let apart = [
        prism(3, (-1.0, -0.8), (-0.055, -0.024), &[]),
        prism(3, (0.8, 1.0), (-0.055, -0.024), &[]),
        prism(3, (-1.0, 1.0), (-0.055, -0.04), &[]),
    ];
    let mut task = task(3);
    task.start = DVector::from_vec(vec![0.0, -0.9, -0.05]);
    task.goal = DVector::from_vec(vec![0.5, -0.9, -0.05]);
    let names = ["cap", "gripper", "left_finger"];
    let file = settled(&Fixture::new(joint_box(3), &task, &apart, &names), 4);
    assert_eq!(file.n_grasps, Some(3));
    // The twin: one region over the whole range, and one grasp does it.
    let joined = [prism(3, (-1.0, 1.0), (-0.055, -0.024), &[])];
    assert_eq!(settled(&Fixture::new(joint_box(3), &task, &joined, &names), 4).n_grasps, Some(1));
}

/// The connected regions of CP_free hold transits: without the region that joins them, the goal cannot be reached.
#[test]
fn eq_5_6e_transit_pairs_share_a_connected_region() {
    let mut task = task(3);
    task.goal = DVector::from_vec(vec![-2.8, 0.5, -0.03]);
    let names = ["cap", "gripper", "left_finger"];
    let regions = three_regions(3);
    assert_eq!(settled(&Fixture::new(joint_box(3), &task, &regions, &names), 4).n_grasps, Some(1));
    let file = settled(&Fixture::new(joint_box(3), &task, &regions[..2], &names), 4);
    assert_eq!(file.status, PlanStatus::Infeasible);
    assert!(file.tried[0].reason.starts_with("paths are missing"), "{}", file.tried[0].reason);
    assert_eq!(file.tried.len(), 4);
}

#[test]
fn eq_5_7_cost_is_the_sum_of_squared_steps() {
    let file = settled(&turned(0.0, 0.3, &three_regions(3)), 2);
    let x = points(&file);
    let sum: f64 = x.windows(2).map(|pair| (&pair[1] - &pair[0]).norm_squared()).sum();
    assert!((file.cost.unwrap() - sum).abs() < 1e-12);
    assert!(file.lower_bound.unwrap() <= sum);
}

#[test]
fn a_start_that_is_the_goal_needs_nothing() {
    let mut task = task(3);
    task.goal = task.start.clone();
    let file =
        settled(&Fixture::new(joint_box(3), &task, &three_regions(3), &["cap", "gripper", "left_finger"]), 4);
    assert_eq!((file.status, file.n_grasps, file.cost), (PlanStatus::Optimal, Some(0), Some(0.0)));
    assert!(file.tried.is_empty());
}

#[test]
fn reasons_say_what_is_missing() {
    let names = ["cap", "gripper", "left_finger"];
    let check = |regions: &[convex_sets::HPolyhedron], words: &str| {
        let file = settled(&Fixture::new(joint_box(3), &task(3), regions, &names), 2);
        assert_eq!((file.status, file.tried.len()), (PlanStatus::Infeasible, 2));
        assert!(file.tried[0].reason.contains(words), "{} / {words}", file.tried[0].reason);
    };
    check(&[], "start lies in no region");
    check(&three_regions(3)[1..2], "start lies in no region");
    let only_open = [prism(3, (-1.0, 1.0), (-0.055, -0.0251), &[])];
    let mut open_task = task(3);
    open_task.start[2] = -0.05;
    let file = settled(&Fixture::new(joint_box(3), &open_task, &only_open, &names), 2);
    assert!(file.tried[0].reason.contains("CG_free has no region"), "{}", file.tried[0].reason);
    check(&three_regions(3), "at most 0.6402");
}

#[test]
fn options_out_of_range_are_errors() {
    let fixture = fixture(3, &three_regions(3));
    let options = MiqpOptions { gap: 0.0, ..MiqpOptions::default() };
    assert!(plan(&fixture.question(2), &options, &mut NoSink, &|| false).is_err());
}

#[test]
fn limits_and_cancelling_claim_nothing() {
    let fixture = fixture(3, &three_regions(3));
    let options = MiqpOptions { max_nodes: 0, ..MiqpOptions::default() };
    match plan(&fixture.question(10), &options, &mut NoSink, &|| false).unwrap() {
        PlanOutcome::Open { tried, is_canceled } => {
            assert!(!is_canceled);
            assert_eq!(tried.len(), 10);
            assert!(tried[9].reason.contains("limit of 0 nodes"), "{}", tried[9].reason);
        }
        PlanOutcome::Settled(file) => panic!("{file:?}"),
    }
    match plan(&fixture.question(10), &MiqpOptions::default(), &mut NoSink, &|| true).unwrap() {
        PlanOutcome::Open { is_canceled, .. } => assert!(is_canceled),
        PlanOutcome::Settled(file) => panic!("{file:?}"),
    }
}

/// A coordinate that transits and transfers both keep can never change: the equations contradict each other exactly.
#[test]
fn an_object_that_nothing_moves_is_proven_unreachable() {
    let mut task = task(3);
    task.transfer_keep.push(task.transit_keep[0].clone());
    let fixture = Fixture::new(joint_box(3), &task, &three_regions(3), &["cap", "gripper", "left_finger"]);
    let file = settled(&fixture, 3);
    assert_eq!((file.status, file.tried.len()), (PlanStatus::Infeasible, 3));
    assert!(file.tried[0].reason.contains("cap"), "{}", file.tried[0].reason);
}
