//! Leaf cuts: two regions whose leaves connect for some values only (mathematics, section 5).
//!
//! q = (c, r): object and robot. A = {r ≤ 0.6 - c}, B = {r ≥ c} in the unit square: they overlap, but in the leaf
//! c = const only for c ≤ 0.3. A transit keeps c, a transfer keeps r.

mod bottle_cap;

use bottle_cap::Fixture;
use convex_sets::HPolyhedron;
use ipc_types::artefact::{LeafCut, Mode, PlanStatus, TriedStatus};
use manipulation::Outer;
use miqp::{MiqpOptions, NoSink, PlanOutcome, Question, plan};
use nalgebra::{DMatrix, DVector};
use scene::{Space, Task};

fn half_space(a: [f64; 2], b: f64) -> HPolyhedron {
    HPolyhedron { A: DMatrix::from_row_slice(1, 2, &a), b: DVector::from_vec(vec![b]) }
}

fn unit_box() -> Outer {
    Outer { lower: DVector::zeros(2), upper: DVector::repeat(2, 1.0) }
}

/// Start at (0.5, 0.05) in A, goal at (0.5, 0.95) in B. `most_c` bounds A's object coordinate.
fn two_regions(most_c: f64) -> Fixture {
    let square = unit_box();
    let whole = Space { lower: square.lower.clone(), upper: square.upper.clone(), rows: Vec::new() };
    let task = Task {
        name: "cross".to_owned(),
        start: DVector::from_vec(vec![0.5, 0.05]),
        goal: DVector::from_vec(vec![0.5, 0.95]),
        max_grasps: 4,
        clearance: 0.0,
        grasp: whole.clone(),
        placement: whole,
        transfer_keep: vec![DVector::from_vec(vec![0.0, 1.0])],
        transit_keep: vec![DVector::from_vec(vec![1.0, 0.0])],
    };
    let in_square = |P: HPolyhedron| HPolyhedron::from_box(&square.lower, &square.upper).intersection(&P);
    let A = in_square(half_space([1.0, 1.0], 0.6)).intersection(&half_space([1.0, 0.0], most_c));
    let B = in_square(half_space([1.0, -1.0], 0.0));
    Fixture::new(unit_box(), &task, &[A, B], &["c", "r"])
}

fn cut(mode: Mode, reached: &[u64]) -> LeafCut {
    LeafCut { mode, reached: reached.to_vec(), exits: Vec::new() }
}

fn solve(fixture: &Fixture, cuts: &[LeafCut]) -> ipc_types::artefact::PlanFile {
    let question = Question { cuts, ..fixture.question(4) };
    match plan(&question, &MiqpOptions::default(), &mut NoSink, &|| false).unwrap() {
        PlanOutcome::Settled(file) => file,
        PlanOutcome::Open { tried, .. } => panic!("open: {tried:?}"),
    }
}

#[test]
fn without_cuts_the_transit_alone_is_proposed() {
    let file = solve(&two_regions(1.0), &[]);
    assert_eq!((file.status, file.n_grasps), (PlanStatus::Optimal, Some(0)));
    assert!(file.tried.is_empty());
    assert_eq!(file.regions, Some(vec![10, 11]));
}

/// With the cut the object has to be brought to c ≤ 0.3, where the leaves connect, and back.
#[test]
fn the_cut_leads_over_leaves_that_connect() {
    for reached in [vec![10], vec![11]] {
        let file = solve(&two_regions(1.0), &[cut(Mode::Transit, &reached)]);
        assert_eq!((file.status, file.n_grasps), (PlanStatus::Optimal, Some(2)), "{:?}", file.tried);
        assert_eq!(file.tried[0].status, TriedStatus::Infeasible);
        let x = file.configurations.unwrap();
        assert!(x[2][0] <= 0.3 && x[2][0] > 0.3 - 1e-4, "{x:?}");
        // Two transfers of 0.2; r goes from 0.05 to 0.95 in three transits, r = 0.5 at least where c = 0.5 is in B.
        let cost = file.cost.unwrap();
        let (r_1, r_3) = (x[1][1], x[3][1]);
        let expected = 0.08 + (r_1 - 0.05).powi(2) + (r_3 - r_1).powi(2) + (0.95 - r_3).powi(2);
        assert!((cost - expected).abs() < 1e-4, "{cost} {expected}");
        assert!(r_1 <= 0.1 + 1e-9 && r_3 >= 0.5 - 1e-9);
    }
}

/// The infeasible twin: the exits do not meet any leaf that A reaches with c ≥ 0.4.
#[test]
fn a_cut_without_a_usable_exit_is_proven_infeasible() {
    let mut fixture = two_regions(1.0);
    // The same regions, but the object cannot go below 0.4.
    let square = Outer { lower: DVector::from_vec(vec![0.4, 0.0]), upper: DVector::repeat(2, 1.0) };
    let whole = Space { lower: square.lower.clone(), upper: square.upper.clone(), rows: Vec::new() };
    let task = Task {
        name: "cross".to_owned(),
        start: fixture.start.clone(),
        goal: fixture.goal.clone(),
        max_grasps: 4,
        clearance: 0.0,
        grasp: whole.clone(),
        placement: whole,
        transfer_keep: vec![DVector::from_vec(vec![0.0, 1.0])],
        transit_keep: vec![DVector::from_vec(vec![1.0, 0.0])],
    };
    // A third region joins A and B in the connected region, but only where r is between them and c in [0.9, 1]:
    // leaves that A does not have.
    let corner = |c: (f64, f64), r: (f64, f64)| {
        HPolyhedron::from_box(&DVector::from_vec(vec![c.0, r.0]), &DVector::from_vec(vec![c.1, r.1]))
    };
    let regions =
        [corner((0.4, 0.7), (0.0, 0.2)), corner((0.4, 1.0), (0.6, 1.0)), corner((0.7, 1.0), (0.2, 0.6))];
    fixture = Fixture::new(square, &task, &regions, &["c", "r"]);
    // They touch at single points only, (0.7, 0.2), and along r = 0.6: not proven empty, so one connected region.
    let file = solve(&fixture, &[]);
    assert_eq!(file.n_grasps, Some(0));
    let file = solve(&fixture, &[cut(Mode::Transit, &[10])]);
    // Through the touching leaf c = 0.7 a plan exists: the exit is closed.
    assert_ne!(file.status, PlanStatus::Infeasible, "{:?}", file.tried);
    let narrow =
        [corner((0.4, 0.69), (0.0, 0.2)), corner((0.4, 1.0), (0.6, 1.0)), corner((0.7, 1.0), (0.2, 0.6))];
    let fixture = Fixture::new(
        Outer { lower: DVector::from_vec(vec![0.4, 0.0]), upper: DVector::repeat(2, 1.0) },
        &task,
        &narrow,
        &["c", "r"],
    );
    let file = solve(&fixture, &[cut(Mode::Transit, &[10])]);
    assert_eq!(file.status, PlanStatus::Infeasible);
    assert_eq!(file.tried.len(), 4);
    assert!(file.tried.iter().all(|tried| tried.status == TriedStatus::Infeasible));
}

/// What a file says of exits is not trusted: cuts with wrong exits give the same plan.
#[test]
fn exits_are_taken_from_the_regions() {
    let mut wrong = cut(Mode::Transit, &[10]);
    wrong.exits = vec![(10, 10)];
    let right = solve(&two_regions(1.0), &[cut(Mode::Transit, &[10])]);
    assert_eq!(solve(&two_regions(1.0), &[wrong.clone(), wrong]), right);
}

#[test]
fn a_cut_of_foreign_regions_is_an_error() {
    let fixture = two_regions(1.0);
    let cuts = [cut(Mode::Transfer, &[99])];
    let question = Question { cuts: &cuts, ..fixture.question(4) };
    let error = plan(&question, &MiqpOptions::default(), &mut NoSink, &|| false).unwrap_err();
    assert!(error.to_string().contains("cut 0 names region 99"), "{error}");
}
