//! The reference tasks over regions made by hand.

mod bottle_cap;

use bottle_cap::{fixture, many_regions, three_regions};
use ipc_types::artefact::{PlanFile, PlanStatus, TriedStatus};
use miqp::{MiqpOptions, NoSink, PlanOutcome, plan};

fn solve(fixture: &bottle_cap::Fixture, max_grasps: usize) -> PlanFile {
    match plan(&fixture.question(max_grasps), &MiqpOptions::default(), &mut NoSink, &|| false).unwrap() {
        PlanOutcome::Settled(file) => file,
        PlanOutcome::Open { tried, .. } => panic!("open: {tried:?}"),
    }
}

fn check_ten_grasps(fixture: &bottle_cap::Fixture) {
    let file = solve(fixture, 12);
    assert_eq!((file.status, file.n_grasps), (PlanStatus::Optimal, Some(10)));
    assert_eq!(file.tried.len(), 10);
    assert!(file.tried[..9].iter().all(|tried| tried.status == TriedStatus::Infeasible), "{:?}", file.tried);
    let (cost, bound) = (file.cost.unwrap(), file.lower_bound.unwrap());
    assert!(bound <= cost && cost - bound <= 1e-4 * cost, "{bound} {cost}");
    let x = file.configurations.unwrap();
    assert_eq!(x.len(), 22);
    assert_eq!(x[0], fixture.start.as_slice());
    assert_eq!(x[21], fixture.goal.as_slice());
    for segment_idx in 0..21 {
        let (from, to) = (&x[segment_idx], &x[segment_idx + 1]);
        if segment_idx % 2 == 0 {
            assert_eq!(from[0], to[0], "segment {segment_idx}");
        } else {
            assert_eq!(from[1] - from[0], to[1] - to[0], "segment {segment_idx}");
            assert_eq!(from[2], to[2], "segment {segment_idx}");
        }
    }
}

#[test]
fn three_regions_need_ten_grasps() {
    check_ten_grasps(&fixture(3, &three_regions(3)));
    check_ten_grasps(&fixture(4, &three_regions(4)));
}

#[test]
fn many_regions_need_ten_grasps() {
    check_ten_grasps(&fixture(3, &many_regions(3, 4)));
    check_ten_grasps(&fixture(4, &many_regions(4, 5)));
}

#[test]
fn nine_grasps_are_proven_not_to_suffice() {
    let file = solve(&fixture(3, &three_regions(3)), 9);
    assert_eq!((file.status, file.n_grasps, file.cost), (PlanStatus::Infeasible, None, None));
    assert_eq!(file.tried.len(), 9);
    assert!(file.tried[8].reason.contains("at most 0.6402"), "{}", file.tried[8].reason);
}
