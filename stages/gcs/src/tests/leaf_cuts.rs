//! Segments without a path in their leaf: two regions whose leaves connect for some values only, and plans with them.

use super::{cuboid, found, manipulation, solve, with_faces};
use crate::error::GcsError;
use crate::options::Options;
use crate::plan_paths::{PathsOutcome, Regions, Sink, plan_paths};
use crate::search::Found;
use crate::segment::SegmentOutcome;
use ipc_types::artefact::{LeafCut, Mode, PlanFile, PlanStatus, Segment};
use manipulation::Manipulation;
use manipulation::PathMode::Transit;

/// Coordinates (robot x, object z); a transit keeps z. Region 0 ends at x = 1, region 1 begins at x = 0.5 + z: they
/// meet in the leaves z ≤ 0.5 only. Region 2 is an island.
fn two_leaves() -> Manipulation {
    let regions = [
        cuboid(&[0.0, 0.0], &[1.0, 1.0]),
        with_faces(cuboid(&[0.0, 0.0], &[3.0, 1.0]), &[(&[-1.0, 1.0], -0.5)]),
        cuboid(&[5.0, 0.0], &[6.0, 1.0]),
    ];
    manipulation(&regions, &[&[0.0, 1.0]], &[])
}

#[test]
fn leaves_that_connect_have_a_path() {
    let found = found(&two_leaves(), Transit, &[0.25, 0.25], &[2.5, 0.25]);
    assert_eq!(found.path.regions, [0, 1]);
    assert!((found.path.length() - 2.25).abs() < 1e-9);
}

#[test]
fn leaves_that_do_not_connect_are_cut() {
    let expected = SegmentOutcome::NoPath { reached: vec![0], exits: vec![(0, 1)] };
    for z in [0.75, 0.500001, 0.5 + 1e-9] {
        assert_eq!(solve(&two_leaves(), Transit, &[0.25, z], &[2.5, z]), expected, "z = {z}");
    }
    // Just below, there is a path: the proof has no tolerance that hides it.
    found(&two_leaves(), Transit, &[0.25, 0.499999], &[2.5, 0.499999]);
}

/// At z = 0.5 the regions meet in one point: no proof, and no path that rounding allows to verify.
#[test]
fn touching_leaves_are_neither_found_nor_cut() {
    assert!(matches!(
        solve(&two_leaves(), Transit, &[0.25, 0.5], &[2.5, 0.5]),
        SegmentOutcome::Undecided { .. } | SegmentOutcome::Found(_)
    ));
}

#[test]
fn an_island_has_no_exits() {
    let expected = SegmentOutcome::NoPath { reached: vec![0, 1], exits: vec![] };
    assert_eq!(solve(&two_leaves(), Transit, &[0.25, 0.25], &[5.5, 0.25]), expected);
}

/// Remembers what it is given.
#[derive(Default)]
struct Memory {
    segments: Vec<(usize, Segment)>,
    cuts: Vec<(usize, LeafCut)>,
}

impl Sink for Memory {
    fn segment(&mut self, segment_idx: usize, segment: &Segment, _: &Found) {
        self.segments.push((segment_idx, segment.clone()));
    }
    fn cut(&mut self, segment_idx: usize, cut: &LeafCut) {
        self.cuts.push((segment_idx, cut.clone()));
    }
}

fn plan(configurations: &[[f64; 2]], modes: &[Mode]) -> PlanFile {
    PlanFile {
        status: PlanStatus::Feasible,
        n_grasps: Some(modes.len() / 2),
        configurations: Some(configurations.iter().map(|q| q.to_vec()).collect()),
        regions: Some(vec![0; configurations.len()]),
        modes: Some(modes.to_vec()),
        cost: None,
        lower_bound: None,
        tried: Vec::new(),
    }
}

fn run(plan: &PlanFile) -> (Result<PathsOutcome, GcsError>, Memory) {
    let spaces = two_leaves();
    let coordinates = ["x".to_string(), "z".to_string()];
    let regions = Regions {
        manipulation: &spaces,
        ids: &[7, 11, 13],
        certified: &[true, false, true],
        coordinates: &coordinates,
    };
    let mut memory = Memory::default();
    let outcome = plan_paths(regions, plan, &Options::default(), 1, &mut memory, &|| false);
    (outcome, memory)
}

use Mode::{Transfer, Transit as TransitMode};

#[test]
fn eq_5_9_a_plan_becomes_a_trajectory() {
    let plan =
        plan(&[[0.25, 0.25], [2.5, 0.25], [2.5, 0.75], [2.0, 0.75]], &[TransitMode, Transfer, TransitMode]);
    let (outcome, memory) = run(&plan);
    let PathsOutcome::Found(trajectory) = outcome.unwrap() else { panic!("no trajectory") };
    assert_eq!(trajectory.segments.len(), 3);
    assert!((trajectory.length - 3.25).abs() < 1e-9);
    assert_eq!(trajectory.segments[0].regions, [7, 11]);
    assert!(!trajectory.segments[0].certified, "region 11 is not certified");
    let configurations = plan.configurations.unwrap();
    for (segment_idx, segment) in trajectory.segments.iter().enumerate() {
        assert_eq!(segment.pieces[0][0], configurations[segment_idx]);
        assert_eq!(segment.pieces.last().unwrap().last().unwrap(), &configurations[segment_idx + 1]);
        assert!(segment.lower_bound <= segment.length);
    }
    assert_eq!(memory.segments.iter().map(|s| s.0).collect::<Vec<_>>(), [0, 1, 2]);
    assert!(memory.cuts.is_empty());
}

#[test]
fn a_plan_without_paths_becomes_cuts_by_region_id() {
    let plan =
        plan(&[[0.25, 0.75], [2.5, 0.75], [2.5, 0.25], [0.25, 0.25]], &[TransitMode, Transfer, TransitMode]);
    let (outcome, memory) = run(&plan);
    let cut = LeafCut { mode: TransitMode, reached: vec![7], exits: vec![(7, 11)] };
    assert_eq!(outcome.unwrap(), PathsOutcome::NoPath(vec![cut.clone()]));
    assert_eq!(memory.cuts, [(0, cut)]);
    assert_eq!(memory.segments.len(), 2, "the other segments have their paths");
}

#[test]
fn plans_that_do_not_fit_are_errors() {
    let (outcome, _) = run(&plan(&[[0.25, 0.25], [2.5, 0.5]], &[TransitMode]));
    assert_eq!(
        outcome.unwrap_err().to_string(),
        "segment 0 (transit) changes a kept form by 2.5e-1 from configuration 0 to 1: only a plan with the kept \
         forms of this task has paths"
    );
    let (outcome, _) = run(&plan(&[[0.25, 0.25], [4.5, 0.25]], &[TransitMode]));
    assert_eq!(
        outcome.unwrap_err(),
        GcsError::OutsideRegions { configuration_idx: 1, space: "placement space" }
    );
    let (outcome, _) = run(&plan(&[[0.25, 0.25]], &[TransitMode]));
    assert!(matches!(outcome, Err(GcsError::PlanShape { found: 1, expected: 2, .. })));
    let (outcome, _) = run(&plan(&[[0.25, 0.25], [f64::NAN, 0.25]], &[TransitMode]));
    assert!(matches!(outcome, Err(GcsError::NotFinite { configuration_idx: 1, .. })));
}

#[test]
fn nothing_to_do_is_an_empty_trajectory_and_no_plan_is_said() {
    let (outcome, _) = run(&plan(&[[0.25, 0.25]], &[]));
    assert!(matches!(outcome.unwrap(), PathsOutcome::Found(trajectory) if trajectory.segments.is_empty()));
    let mut none = plan(&[], &[]);
    none.status = PlanStatus::Infeasible;
    (none.configurations, none.modes, none.regions) = (None, None, None);
    assert_eq!(run(&none).0.unwrap(), PathsOutcome::NoPlan);
}
