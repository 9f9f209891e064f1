//! Branch and bound against the enumeration of all choices of regions and exits, on small random instances.

mod bottle_cap;

use bottle_cap::Fixture;
use convex_sets::HPolyhedron;
use ipc_types::artefact::{LeafCut, Mode, PlanStatus};
use manipulation::Outer;
use miqp::branch_and_bound::{Limits, search};
use miqp::fixed_regions::plan_in_regions;
use miqp::instance::Instance;
use miqp::kept_system::{KeptSystem, mode_of_segment};
use miqp::{MiqpOptions, NoSink, PlanOutcome, Question, plan};
use nalgebra::DVector;
use proptest::prelude::*;
use scene::{Space, Task};

const GAP: f64 = 1e-5;

/// Boxes in (c, r) or (c, r, f) as regions; a transfer keeps r - c (and f), a transit keeps c.
fn instance_of(boxes: &[Vec<(f64, f64)>], start: &[f64], goal: &[f64]) -> Fixture {
    let n = start.len();
    let joint_box = Outer { lower: DVector::repeat(n, 0.0), upper: DVector::repeat(n, 1.0) };
    let whole = Space { lower: joint_box.lower.clone(), upper: joint_box.upper.clone(), rows: Vec::new() };
    let mut grasp = whole.clone();
    if n == 3 {
        (grasp.lower[2], grasp.upper[2]) = (0.4, 0.6);
    }
    let unit = |k: usize| DVector::from_fn(n, |row, _| if row == k { 1.0 } else { 0.0 });
    let mut transfer_keep = vec![unit(1) - unit(0)];
    if n == 3 {
        transfer_keep.push(unit(2));
    }
    let task = Task {
        name: "random".to_owned(),
        start: DVector::from_column_slice(start),
        goal: DVector::from_column_slice(goal),
        max_grasps: 2,
        clearance: 0.0,
        grasp,
        placement: whole,
        transfer_keep,
        transit_keep: vec![unit(0)],
    };
    let regions: Vec<HPolyhedron> = boxes
        .iter()
        .map(|sides| {
            HPolyhedron::from_box(
                &DVector::from_iterator(n, sides.iter().map(|side| side.0)),
                &DVector::from_iterator(n, sides.iter().map(|side| side.1)),
            )
        })
        .collect();
    Fixture::new(joint_box, &task, &regions, &["c", "r", "f"][..n])
}

/// Least cost over all choices of regions that satisfy connectivity and cuts; exits of cuts are enumerated too.
fn enumerate(instance: &Instance, n_grasps: usize) -> Option<f64> {
    let system = KeptSystem::new(instance.manipulation, &instance.start, &instance.goal, n_grasps);
    let mut best: Option<f64> = None;
    let mut choices: Vec<Vec<usize>> = vec![Vec::new()];
    for waypoint_idx in 0..2 * n_grasps + 2 {
        let allowed = if waypoint_idx == 0 {
            instance.start_regions.clone()
        } else if waypoint_idx == 2 * n_grasps + 1 {
            instance.goal_regions.clone()
        } else {
            instance.inner_regions()
        };
        choices = choices
            .iter()
            .flat_map(|chosen| {
                allowed
                    .iter()
                    .filter(|&&b| {
                        chosen
                            .last()
                            .is_none_or(|&a| instance.connected(mode_of_segment(waypoint_idx - 1), a, b))
                    })
                    .map(|&b| [chosen.as_slice(), &[b]].concat())
                    .collect::<Vec<_>>()
            })
            .collect();
    }
    for regions in choices {
        let mut exit_choices: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new()];
        for segment_idx in 0..regions.len() - 1 {
            for (cut_idx, cut) in instance.cuts.iter().enumerate() {
                if cut.mode == mode_of_segment(segment_idx)
                    && cut.parts(regions[segment_idx], regions[segment_idx + 1])
                {
                    exit_choices = exit_choices
                        .iter()
                        .flat_map(|exits| {
                            (0..cut.exits.len())
                                .map(|exit_idx| {
                                    [exits.as_slice(), &[(segment_idx, cut_idx, exit_idx)]].concat()
                                })
                                .collect::<Vec<_>>()
                        })
                        .collect();
                }
            }
        }
        for exits in exit_choices {
            if let Some(found) = plan_in_regions(instance, &system, &regions, &exits).unwrap() {
                best = Some(best.map_or(found.cost, |cost: f64| cost.min(found.cost)));
            }
        }
    }
    best
}

fn check(fixture: &Fixture, cuts: &[LeafCut], n_grasps: usize) -> Result<(), TestCaseError> {
    let instance = Instance::new(
        &fixture.manipulation,
        fixture.start.clone(),
        fixture.goal.clone(),
        &fixture.region_ids,
        cuts,
    )
    .unwrap();
    if instance.start_regions.is_empty()
        || instance.goal_regions.is_empty()
        || instance.inner_regions().is_empty()
    {
        return Ok(());
    }
    let enumerated = enumerate(&instance, n_grasps);
    let limits = Limits { gap: GAP, max_nodes: 5000 };
    let outcome = search(&instance, n_grasps, &limits, &mut |_, _| {}, &|| false).unwrap();
    match (enumerated, &outcome.plan) {
        (Some(cost), Some(found)) => {
            // Margins cost up to about 1e-6 a waypoint where several sets hold a point.
            prop_assert!((found.cost - cost).abs() <= 1e-4 * (1.0 + cost), "{} {}", found.cost, cost);
            prop_assert!(outcome.lower_bound <= cost + 1e-12);
            prop_assert!(outcome.lower_bound >= found.cost - GAP * found.cost - 1e-12);
        }
        (None, None) => prop_assert!(outcome.is_infeasible() || outcome.n_undecided > 0),
        (enumerated, found) => {
            prop_assert!(false, "enumeration {enumerated:?}, search {found:?}, bound {}", outcome.lower_bound)
        }
    }
    Ok(())
}

/// A side of a box on a grid of 1/16: touching and equal faces occur often.
fn side() -> impl Strategy<Value = (f64, f64)> {
    (0u32..14, 2u32..9).prop_map(|(low, width)| (low as f64 / 16.0, (low + width).min(16) as f64 / 16.0))
}

fn boxes(n: usize, count: usize) -> impl Strategy<Value = Vec<Vec<(f64, f64)>>> {
    proptest::collection::vec(proptest::collection::vec(side(), n), count)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Eq. 5.8 in two dimensions, one and two grasps.
    #[test]
    fn eq_5_8_equals_enumeration(boxes in boxes(2, 3), c in (0u32..16, 0u32..16)) {
        let (first, last) = (boxes[0].clone(), boxes[2].clone());
        let at = |(low, high): (f64, f64), share: u32| low + (high - low) * share as f64 / 16.0;
        let start = [at(first[0], c.0), at(first[1], 8)];
        let goal = [at(last[0], c.1), at(last[1], 5)];
        let fixture = instance_of(&boxes, &start, &goal);
        check(&fixture, &[], 1)?;
        check(&fixture, &[], 2)?;
    }

    /// With a leaf cut of either mode about the first region.
    #[test]
    fn leaf_cuts_equal_enumeration(boxes in boxes(2, 3), c in (0u32..16, 0u32..16), transfer in any::<bool>(), second in any::<bool>()) {
        let (first, last) = (boxes[0].clone(), boxes[2].clone());
        let at = |(low, high): (f64, f64), share: u32| low + (high - low) * share as f64 / 16.0;
        let start = [at(first[0], c.0), at(first[1], 8)];
        let goal = [at(last[0], c.1), at(last[1], 5)];
        let fixture = instance_of(&boxes, &start, &goal);
        let mode = if transfer { Mode::Transfer } else { Mode::Transit };
        let reached = if second { vec![10, 11] } else { vec![10] };
        check(&fixture, &[LeafCut { mode, reached, exits: Vec::new() }], 1)?;
    }

    /// Three dimensions, with a grasp band.
    #[test]
    fn eq_5_8_equals_enumeration_with_a_grasp_band(boxes in boxes(3, 4), c in (0u32..16, 0u32..16)) {
        let (first, last) = (boxes[0].clone(), boxes[3].clone());
        let at = |(low, high): (f64, f64), share: u32| low + (high - low) * share as f64 / 16.0;
        let start = [at(first[0], c.0), at(first[1], 8), at(first[2], 3)];
        let goal = [at(last[0], c.1), at(last[1], 5), at(last[2], 9)];
        check(&instance_of(&boxes, &start, &goal), &[], 1)?;
    }

    /// The bound on ℓ never excludes what the search finds.
    #[test]
    fn the_grasp_bound_is_a_lower_bound(boxes in boxes(2, 3), c in (0u32..16, 0u32..16)) {
        let (first, last) = (boxes[0].clone(), boxes[2].clone());
        let at = |(low, high): (f64, f64), share: u32| low + (high - low) * share as f64 / 16.0;
        let fixture = instance_of(
            &boxes,
            &[at(first[0], c.0), at(first[1], 8)],
            &[at(last[0], c.1), at(last[1], 5)],
        );
        let instance = Instance::new(
            &fixture.manipulation, fixture.start.clone(), fixture.goal.clone(), &fixture.region_ids, &[]).unwrap();
        let outcome = plan(&fixture.question(3), &MiqpOptions::default(), &mut NoSink, &|| false).unwrap();
        if instance.start_regions.is_empty() || instance.goal_regions.is_empty() || instance.inner_regions().is_empty() {
            return Ok(());
        }
        let fewest = (1..=3).find(|&n_grasps| enumerate_feasible(&instance, n_grasps));
        if let PlanOutcome::Settled(file) = outcome {
            match (file.status, file.n_grasps) {
                (PlanStatus::Infeasible, _) => prop_assert_eq!(fewest, None),
                (_, Some(0)) => {}
                (_, n_grasps) => prop_assert_eq!(n_grasps, fewest),
            }
        }
    }
}

fn enumerate_feasible(instance: &Instance, n_grasps: usize) -> bool {
    let limits = Limits { gap: 0.5, max_nodes: 500 };
    search(instance, n_grasps, &limits, &mut |_, _| {}, &|| false).unwrap().plan.is_some()
}

/// Questions borrow, so that cuts can be replaced without building the sets again.
#[test]
fn the_same_question_twice_gives_the_same_plan() {
    let sides = |c: (f64, f64), r: (f64, f64)| vec![c, r];
    let fixture = instance_of(
        &[sides((0.0, 1.0), (0.0, 0.5)), sides((0.0, 1.0), (0.25, 1.0))],
        &[0.125, 0.25],
        &[0.875, 0.75],
    );
    let solve = || {
        let question = Question { ..fixture.question(2) };
        plan(&question, &MiqpOptions::default(), &mut NoSink, &|| false).unwrap()
    };
    assert_eq!(solve(), solve());
}
