//! A chain of two squares by hand: q = (c, r), a transit keeps c, a transfer keeps r; the object has to go from 0 to 1, and
//! one transfer moves it by half of that.

use super::*;
use ipc_types::artefact::{Apart, ChainBound, Contained, EmptySet, ProofCut, ProofNode, Search, Tried};
use nalgebra::DVector;
use scene::Space;

fn task() -> Task {
    let whole = Space { lower: DVector::zeros(2), upper: DVector::repeat(2, 1.0), rows: Vec::new() };
    Task {
        name: "by hand".into(),
        start: DVector::from_vec(vec![0.0, 0.0]),
        goal: DVector::from_vec(vec![1.0, 1.0]),
        max_grasps: 2,
        clearance: 0.0,
        grasp: whole.clone(),
        placement: whole,
        transfer_keep: vec![DVector::from_vec(vec![0.0, 1.0])],
        transit_keep: vec![DVector::from_vec(vec![1.0, 0.0])],
    }
}

fn region(id: u64, c: (f64, f64), r: (f64, f64)) -> Region {
    Region {
        id,
        parent: None,
        A: vec![vec![1.0, 0.0], vec![0.0, 1.0], vec![-1.0, 0.0], vec![0.0, -1.0]],
        b: vec![c.1, r.1, -c.0, -r.0],
        center: vec![0.5 * (c.0 + c.1), 0.5 * (r.0 + r.1)],
        method: String::new(),
        certified: true,
        margin: 0.0,
    }
}

/// Below and above; they meet where c is 0.4 to 0.6 and r is 0.4 to 0.6.
fn regions() -> Vec<Region> {
    vec![region(3, (0.0, 0.6), (0.0, 0.6)), region(8, (0.4, 1.0), (0.4, 1.0))]
}

fn infeasible(n_tried: usize) -> PlanFile {
    let tried = (1..=n_tried).map(|n_grasps| Tried {
        n_grasps,
        status: TriedStatus::Infeasible,
        reason: String::new(),
        cost: None,
        lower_bound: None,
        nodes: 1,
    });
    PlanFile {
        status: PlanStatus::Infeasible,
        n_grasps: None,
        configurations: None,
        regions: None,
        modes: None,
        cost: None,
        lower_bound: None,
        tried: tried.collect(),
    }
}

/// A transit alone cannot change c: μ = 1 on c.
fn no_transit() -> ProofFile {
    ProofFile {
        bounds: vec![ChainBound { segments: vec![vec![(0, vec![1.0])]], ..ChainBound::default() }],
        searches: vec![Search { first: 0, last: 0, nodes: vec![ProofNode::Leaf(Some(0))] }],
        ..ProofFile::default()
    }
}

fn verdict(plan: &PlanFile, proof: &ProofFile) -> Result<Answer, AnswerError> {
    verify(&task(), &regions(), plan, proof)
}

#[test]
fn a_transit_cannot_move_the_object() {
    let answer = verdict(&infeasible(0), &no_transit()).unwrap();
    assert_eq!((answer.fewest, answer.cost), (1, None));
    // With the other sign the term proves nothing.
    let mut proof = no_transit();
    proof.bounds[0].segments[0][0].1[0] = -1.0;
    assert!(matches!(verdict(&infeasible(0), &proof), Err(AnswerError::NotExcluded { n_grasps: 0, .. })));
    // A class that is not one has no multipliers.
    let mut proof = no_transit();
    proof.bounds[0].segments[0][0].0 = 1;
    assert!(matches!(verdict(&infeasible(0), &proof), Err(AnswerError::NotExcluded { .. })));
}

#[test]
fn what_is_possible_cannot_be_excluded() {
    // One grasp suffices: (0,0) → (0,0.5) … (1,0.5) → (1,1) runs through both. No multipliers exclude it.
    let mut proof = no_transit();
    for (mu, nu) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (-1.0, 2.0)] {
        proof.bounds.truncate(1);
        proof.bounds.push(ChainBound {
            segments: vec![vec![(0, vec![mu])], vec![(0, vec![nu])]],
            ..ChainBound::default()
        });
        proof.searches.truncate(1);
        proof.searches.push(Search { first: 1, last: 1, nodes: vec![ProofNode::Leaf(Some(1))] });
        let answer = verdict(&infeasible(1), &proof);
        assert!(matches!(answer, Err(AnswerError::NotExcluded { n_grasps: 1, .. })), "{answer:?}");
    }
}

#[test]
fn regions_that_meet_are_never_proven_apart() {
    for y in [0.0, 0.5, 1.0, 1e6] {
        let mut proof = no_transit();
        proof.multipliers.push(vec![(0, y), (6, y)]);
        proof.apart.push(Apart { mode: Mode::Transit, a: 0, b: 1, multipliers: 0 });
        assert!(matches!(verdict(&infeasible(0), &proof), Err(AnswerError::NotApart { .. })));
        proof.apart.clear();
        proof.empty.push(EmptySet { set: ProofSet::Waypoint, region: 0, multipliers: 0 });
        assert!(matches!(
            verdict(&infeasible(0), &proof),
            Err(AnswerError::NotEmpty { .. } | AnswerError::NoSuch { .. })
        ));
        proof.empty.clear();
        proof.contained.push(Contained { inner: 0, outer: 1, faces: vec![0; 4] });
        assert!(matches!(
            verdict(&infeasible(0), &proof),
            Err(AnswerError::NotContained { .. } | AnswerError::NoSuch { .. })
        ));
    }
}

#[test]
fn trees_must_be_whole() {
    let root = |nodes: Vec<ProofNode>| {
        let mut proof = no_transit();
        proof.cuts.push(ProofCut { mode: Mode::Transit, inside: vec![0] });
        proof.searches.push(Search { first: 1, last: 1, nodes });
        match verdict(&infeasible(1), &proof) {
            Err(error) => error.to_string(),
            Ok(answer) => panic!("{answer:?}"),
        }
    };
    let by = |groups: Vec<Vec<u32>>| ProofNode::Waypoint { waypoint: 1, groups };
    assert!(root(vec![]).contains("no nodes"));
    assert!(root(vec![by(vec![vec![0]]), ProofNode::Leaf(None)]).contains("in no child"));
    assert!(root(vec![by(vec![vec![0], vec![1]]), ProofNode::Leaf(None)]).contains("too few"));
    assert!(root(vec![ProofNode::Leaf(None), ProofNode::Leaf(None)]).contains("complete"));
    assert!(root(vec![ProofNode::Waypoint { waypoint: 3, groups: vec![] }]).contains("point that is none"));
    // Inside, outside, and the one exit.
    let cut = || ProofNode::Cut { segment: 0, cut: 0 };
    assert!(root(vec![cut(), ProofNode::Leaf(None), ProofNode::Leaf(None)]).contains("too few"));
    let whole = root(vec![cut(), ProofNode::Leaf(None), ProofNode::Leaf(None), ProofNode::Leaf(None)]);
    assert!(whole.contains("left possible"), "{whole}");
    assert!(root(vec![ProofNode::Cut { segment: 1, cut: 0 }]).contains("segment that is none"));
    assert!(root(vec![ProofNode::Cut { segment: 0, cut: 4 }]).contains("cut 4 does not exist"));
    assert!(root(vec![ProofNode::Leaf(Some(9))]).contains("bound 9 does not exist"));
}

/// The cheapest motion with one grasp: c moves 1 at once, r 0.5 each time; r_i are those steps.
#[test]
fn a_cost_is_bounded_by_its_steps() {
    let steps = vec![vec![0.0, 0.5], vec![1.0, 0.0], vec![0.0, 0.5]];
    // Kept forms cancel what the steps leave: ∓2 r between segments is no slope if all steps are alike, else μ does it.
    let chain = ChainBound {
        steps,
        segments: vec![vec![(0, vec![2.0])], vec![(0, vec![1.0])], vec![(0, vec![2.0])]],
        ..ChainBound::default()
    };
    let x = vec![vec![0.0, 0.0], vec![0.0, 0.5], vec![1.0, 0.5], vec![1.0, 1.0]];
    let mut plan = PlanFile {
        status: PlanStatus::Optimal,
        n_grasps: Some(1),
        configurations: Some(x),
        regions: Some(vec![3, 3, 8, 8]),
        modes: Some(vec![Mode::Transit, Mode::Transfer, Mode::Transit]),
        cost: Some(1.5),
        lower_bound: Some(1.4999),
        tried: infeasible(1).tried,
    };
    plan.tried[0].status = TriedStatus::Optimal;
    let mut proof = no_transit();
    proof.bounds.push(chain);
    proof.searches.push(Search { first: 1, last: 1, nodes: vec![ProofNode::Leaf(Some(1))] });
    let answer = verdict(&plan, &proof).unwrap();
    let bound = answer.cost_lower_bound.unwrap();
    assert!(answer.fewest == 1 && (1.5 - 1e-12..=1.5).contains(&bound), "{answer:?}");
    let rejected = |change: &dyn Fn(&mut PlanFile, &mut ProofFile)| {
        let (mut plan, mut proof) = (plan.clone(), proof.clone());
        change(&mut plan, &mut proof);
        verdict(&plan, &proof).unwrap_err().to_string()
    };
    assert!(rejected(&|p, _| p.lower_bound = Some(1.51)).contains("the plan claims 1.51"));
    assert!(rejected(&|p, _| p.lower_bound = Some(f64::NAN)).contains("the plan claims NaN"));
    assert!(rejected(&|p, _| p.lower_bound = None).contains("without a lower bound"));
    assert!(rejected(&|p, _| p.cost = Some(1.4)).contains("its steps cost"));
    assert!(rejected(&|p, _| p.tried[0].n_grasps = 2).contains("list of tried"));
    assert!(rejected(&|_, f| f.searches[1].last = 0).contains("nothing is proven of 1 grasps"));
    assert!(rejected(&|_, f| f.bounds[1].steps[1][0] = f64::NAN).contains("not finite"));
    assert!(rejected(&|_, f| f.bounds[1].steps[1][0] = 1.2).contains("at least"));
    assert!(
        rejected(&|_, f| {
            f.bounds[1].steps.pop();
        })
        .contains("as many steps")
    );
}
