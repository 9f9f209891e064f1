//! The checker's replay against brute force: regions are boxes on a grid, the motions over grid points are enumerated.
//!
//! q = (c, r): object and robot. A transit keeps c, a transfer keeps r - c, so leaves are columns and diagonals, and a
//! step between neighbouring grid points of a leaf is possible if one box holds both. What the enumeration finds exists;
//! the checker must never deny it, whatever the proof says.

use check::answer::{Answer, AnswerError, verify};
use convex_sets::HPolyhedron;
use ipc_types::artefact::{
    Apart, Contained, EmptySet, LeafCut, Mode, PlanFile, PlanStatus, ProofFile, ProofNode, ProofSet, Region,
    Tried, TriedStatus,
};
use manipulation::{Manipulation, Outer};
use miqp::{MiqpOptions, PlanOutcome, PlanSink, Question, plan};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use scene::{Space, Task};

/// Grid lines a unit of length.
const GRID: usize = 8;
/// K.
const MOST: usize = 3;
/// A box of grid points: both ends of c and of r.
type GridBox = [(usize, usize); 2];

#[derive(Debug)]
struct Instance {
    boxes: Vec<GridBox>,
    task: Task,
    regions: Vec<Region>,
    /// Grid ends of r in CG.
    grasp: (usize, usize),
    start: (usize, usize),
    goal: (usize, usize),
}

fn number(grid: usize) -> f64 {
    grid as f64 / GRID as f64
}

impl Instance {
    fn new(boxes: Vec<GridBox>, grasp: (usize, usize), shares: (usize, usize)) -> Instance {
        let at = |(low, high): (usize, usize), share: usize| low + (high - low) * share / GRID;
        let (first, last) = (boxes[0], boxes[boxes.len() - 1]);
        let start = (at(first[0], shares.0), at(first[1], shares.1));
        let goal = (at(last[0], shares.1), at(last[1], shares.0));
        let whole = Space { lower: DVector::zeros(2), upper: DVector::repeat(2, 1.0), rows: Vec::new() };
        let mut band = whole.clone();
        (band.lower[1], band.upper[1]) = (number(grasp.0), number(grasp.1));
        let point = |(c, r): (usize, usize)| DVector::from_vec(vec![number(c), number(r)]);
        let task = Task {
            name: "grid".to_owned(),
            start: point(start),
            goal: point(goal),
            max_grasps: MOST,
            clearance: 0.0,
            grasp: band,
            placement: whole,
            transfer_keep: vec![DVector::from_vec(vec![-1.0, 1.0])],
            transit_keep: vec![DVector::from_vec(vec![1.0, 0.0])],
        };
        let regions = boxes.iter().enumerate().map(|(idx, [c, r])| Region {
            id: idx as u64,
            parent: None,
            A: vec![vec![1.0, 0.0], vec![0.0, 1.0], vec![-1.0, 0.0], vec![0.0, -1.0]],
            b: vec![number(c.1), number(r.1), -number(c.0), -number(r.0)],
            center: vec![0.5 * number(c.0 + c.1), 0.5 * number(r.0 + r.1)],
            method: String::new(),
            certified: true,
            margin: 0.0,
        });
        let regions = regions.collect();
        Instance { boxes, task, regions, grasp, start, goal }
    }

    /// Plan and proof of the planner; `None` if it hit a limit.
    fn planned(&self, cuts: &[LeafCut]) -> Option<(PlanFile, ProofFile)> {
        struct Keep(Option<ProofFile>);
        impl PlanSink for Keep {
            fn proof(&mut self, proof: ProofFile) {
                self.0 = Some(proof);
            }
        }
        let polytope = |region: &Region| HPolyhedron {
            A: DMatrix::from_fn(region.A.len(), 2, |row, k| region.A[row][k]),
            b: DVector::from_column_slice(&region.b),
        };
        let polytopes: Vec<HPolyhedron> = self.regions.iter().map(polytope).collect();
        let joint_box = Outer { lower: DVector::zeros(2), upper: DVector::repeat(2, 1.0) };
        let manipulation = Manipulation::from_parts(joint_box, &self.task, &polytopes).expect("boxes");
        let ids: Vec<u64> = self.regions.iter().map(|region| region.id).collect();
        let question = Question {
            manipulation: &manipulation,
            region_ids: &ids,
            coordinates: &["c".to_owned(), "r".to_owned()],
            start: &self.task.start,
            goal: &self.task.goal,
            max_grasps: MOST,
            cuts,
        };
        let mut keep = Keep(None);
        let options = MiqpOptions { max_nodes: 500, ..MiqpOptions::default() };
        match plan(&question, &options, &mut keep, &|| false).expect("a question without errors") {
            PlanOutcome::Settled(plan) => Some((plan, keep.0.expect("a settled answer has a proof"))),
            PlanOutcome::Open { .. } => None,
        }
    }

    fn verdict(&self, plan: &PlanFile, proof: &ProofFile) -> Result<Answer, AnswerError> {
        verify(&self.task, &self.regions, plan, proof)
    }

    /// Least sum of squared steps over grid points, for 0 … MOST grasps; +∞ where no motion over them exists.
    fn enumerated(&self) -> Vec<f64> {
        let side = GRID + 1;
        let holds =
            |[c, r]: &GridBox, q: (usize, usize)| c.0 <= q.0 && q.0 <= c.1 && r.0 <= q.1 && q.1 <= r.1;
        let in_grasp = |q: (usize, usize)| self.grasp.0 <= q.1 && q.1 <= self.grasp.1;
        let joined = |mode: Mode, a: (usize, usize), b: (usize, usize)| {
            let allowed = mode == Mode::Transit || in_grasp(a) && in_grasp(b);
            allowed && self.boxes.iter().any(|sides| holds(sides, a) && holds(sides, b))
        };
        // Cost from a set of points with costs, by one segment: along each leaf, both ways, as far as it goes.
        let moved = |mode: Mode, from: &[f64]| -> Vec<f64> {
            let mut to = vec![f64::INFINITY; side * side];
            let diagonal = usize::from(mode == Mode::Transfer);
            for c in 0..side {
                for r in 0..side {
                    let cost = from[c * side + r];
                    if cost == f64::INFINITY || !joined(mode, (c, r), (c, r)) {
                        continue;
                    }
                    for forward in [true, false] {
                        let (mut at, mut n_steps) = ((c, r), 0.0);
                        loop {
                            let square = n_steps * n_steps * (1.0 + diagonal as f64) / (GRID * GRID) as f64;
                            let least = &mut to[at.0 * side + at.1];
                            *least = least.min(cost + square);
                            let next = if forward {
                                Some((at.0 + diagonal, at.1 + 1))
                            } else {
                                at.0.checked_sub(diagonal).zip(at.1.checked_sub(1))
                            };
                            let Some(next) = next.filter(|next| next.0 < side && next.1 < side) else {
                                break;
                            };
                            if !joined(mode, at, next) {
                                break;
                            }
                            (at, n_steps) = (next, n_steps + 1.0);
                        }
                    }
                }
            }
            to
        };
        let only_grasps = |mut costs: Vec<f64>| {
            for (idx, cost) in costs.iter_mut().enumerate() {
                if !in_grasp((idx / side, idx % side)) {
                    *cost = f64::INFINITY;
                }
            }
            costs
        };
        let mut costs = vec![f64::INFINITY; side * side];
        costs[self.start.0 * side + self.start.1] = 0.0;
        let mut least = Vec::new();
        for _ in 0..=MOST {
            let rested = moved(Mode::Transit, &costs);
            least.push(rested[self.goal.0 * side + self.goal.1]);
            costs = only_grasps(moved(Mode::Transfer, &only_grasps(rested)));
        }
        least
    }

    /// What was accepted denies nothing that was enumerated.
    fn judge(&self, plan: &PlanFile, answer: &Answer) -> Result<(), TestCaseError> {
        let enumerated = self.enumerated();
        let possible = enumerated.iter().position(|cost| cost.is_finite());
        if let Some(possible) = possible {
            prop_assert!(answer.fewest <= possible, "{answer:?} denies {possible} grasps");
        }
        if let (Some(n_grasps), Some(bound)) = (plan.n_grasps, answer.cost_lower_bound)
            && let Some(cost) = enumerated.get(n_grasps)
        {
            prop_assert!(bound <= cost + 1e-12, "{bound} > {cost} with {n_grasps} grasps");
        }
        Ok(())
    }
}

/// What a forger changes; the numbers choose where.
fn damage(kind: usize, at: usize, factor: f64, plan: &mut PlanFile, proof: &mut ProofFile, n_regions: usize) {
    fn any<T>(list: &mut [T], at: usize) -> Option<&mut T> {
        let n = list.len();
        list.get_mut(at % n.max(1))
    }
    let region = |shift: usize| ((at / (shift + 1)) % n_regions) as u32;
    let list = (at % proof.multipliers.len().max(1)) as u32;
    match kind {
        0 => any(&mut proof.multipliers, at).into_iter().flatten().for_each(|(_, y)| *y *= factor),
        1 => any(&mut proof.bounds, at)
            .into_iter()
            .flat_map(|bound| &mut bound.segments)
            .flatten()
            .for_each(|(_, kept)| kept.iter_mut().for_each(|mu| *mu *= factor)),
        2 => any(&mut proof.bounds, at)
            .into_iter()
            .flat_map(|bound| &mut bound.steps)
            .flatten()
            .for_each(|step| *step *= factor),
        3 => {
            if !proof.apart.is_empty() {
                proof.apart.remove(at % proof.apart.len());
            }
        }
        4 => {
            let mode = if at.is_multiple_of(2) { Mode::Transit } else { Mode::Transfer };
            proof.apart.push(Apart { mode, a: region(0), b: region(1), multipliers: list });
        }
        5 => {
            let sets = [ProofSet::Transit, ProofSet::Transfer, ProofSet::Waypoint];
            proof.empty.push(EmptySet { set: sets[at % 3], region: region(0), multipliers: list });
        }
        6 => {
            let faces = (0..4).map(|face| (list + face) % proof.multipliers.len().max(1) as u32).collect();
            proof.contained.push(Contained { inner: region(0), outer: region(1), faces });
        }
        7 => any(&mut proof.contained, at)
            .into_iter()
            .for_each(|entry| std::mem::swap(&mut entry.inner, &mut entry.outer)),
        8 => {
            if let Some(search) = any(&mut proof.searches, at) {
                (search.first, search.last) = (0, MOST as u32 + 1);
            }
        }
        9 => {
            let n_bounds = proof.bounds.len().max(1) as u32;
            for node in proof.searches.iter_mut().flat_map(|search| &mut search.nodes) {
                match node {
                    ProofNode::Leaf(Some(bound)) => *bound = (*bound + 1) % n_bounds,
                    ProofNode::Waypoint { groups, .. } => groups.reverse(),
                    ProofNode::Cut { segment, .. } => *segment ^= 2,
                    ProofNode::Leaf(None) => {}
                }
            }
        }
        10 => any(&mut proof.bounds, at).into_iter().for_each(|bound| bound.steps.clear()),
        11 => any(&mut proof.cuts, at).into_iter().for_each(|cut| cut.inside = vec![region(0)]),
        // The plan claims more than it did.
        12 => plan.lower_bound = plan.lower_bound.map(|bound| bound * (1.0 + 0.01 * factor.abs())),
        _ => {
            let tried = |n_grasps| Tried {
                n_grasps,
                status: TriedStatus::Infeasible,
                reason: String::new(),
                cost: None,
                lower_bound: None,
                nodes: 0,
            };
            plan.tried = (1..=MOST).map(tried).collect();
            plan.status = PlanStatus::Infeasible;
            (plan.n_grasps, plan.configurations, plan.cost, plan.lower_bound) = (None, None, None, None);
        }
    }
}

fn side() -> impl Strategy<Value = (usize, usize)> {
    (0..GRID - 1, 1..5_usize).prop_map(|(low, width)| (low, (low + width).min(GRID)))
}

fn instance() -> impl Strategy<Value = Instance> {
    let boxes = proptest::collection::vec([side(), side()], 2..6);
    let grasp = (0..GRID / 2, GRID / 2..=GRID);
    (boxes, grasp, (0..=GRID, 0..=GRID))
        .prop_map(|(boxes, grasp, shares)| Instance::new(boxes, grasp, shares))
}

/// Sets of regions for leaf cuts: any set is valid.
fn cuts() -> impl Strategy<Value = Vec<LeafCut>> {
    let cut = (any::<bool>(), 0..2_u64).prop_map(|(transfer, region)| LeafCut {
        mode: if transfer { Mode::Transfer } else { Mode::Transit },
        reached: vec![region],
        exits: Vec::new(),
    });
    proptest::collection::vec(cut, 0..3)
}

/// The enumeration itself, where the answer is plain: a square cut in two at c = 1/2, r below and above 1/2.
#[test]
fn the_enumeration_finds_what_is_there() {
    let half = GRID / 2;
    let one = Instance::new(vec![[(0, GRID), (0, GRID)]; 2], (0, GRID), (0, 0));
    assert_eq!(one.enumerated()[0], 0.0);
    // From (0, 0) to (1/2, 1): in one transfer by 1/2 along the diagonal and a transit by 1/2.
    let mut two = Instance::new(vec![[(0, GRID), (0, GRID)]; 2], (0, GRID), (0, 0));
    two.goal = (half, GRID);
    let enumerated = two.enumerated();
    assert_eq!(enumerated[0], f64::INFINITY);
    assert_eq!(enumerated[1], 0.25 * 0.25 * 2.0 + 0.5);
    // No common column.
    let apart = Instance::new(vec![[(0, 2), (0, 2)], [(5, 8), (5, 8)]], (0, GRID), (4, 4));
    assert!(apart.enumerated().iter().all(|cost| *cost == f64::INFINITY));
}

/// A = {r ≤ 0.6 - c} and B = {r ≥ c} overlap, but in the column c only up to 0.3; the way from A to B at c = 0.5 leads over
/// two grasps. The planner learns of it by a leaf cut; the proof derives the exits anew, and needs no cut file.
#[test]
fn a_leaf_cut_is_proven_from_the_regions_alone() {
    let mut instance = Instance::new(vec![[(0, GRID), (0, GRID)]; 2], (0, GRID), (0, 0));
    for (region, (a, b)) in instance.regions.iter_mut().zip([([1.0, 1.0], 0.6), ([1.0, -1.0], 0.0)]) {
        region.A.push(a.to_vec());
        region.b.push(b);
    }
    instance.task.transfer_keep = vec![DVector::from_vec(vec![0.0, 1.0])];
    instance.task.start = DVector::from_vec(vec![0.5, 0.05]);
    instance.task.goal = DVector::from_vec(vec![0.5, 0.95]);
    let (before, proof) = instance.planned(&[]).expect("a plan");
    assert_eq!(before.n_grasps, Some(0));
    assert_eq!(instance.verdict(&before, &proof).map(|answer| answer.fewest), Ok(0));
    let cut = LeafCut { mode: Mode::Transit, reached: vec![0], exits: Vec::new() };
    let (after, proof) = instance.planned(&[cut]).expect("a plan");
    assert_eq!((after.status, after.n_grasps), (PlanStatus::Optimal, Some(2)));
    let nodes = || proof.searches.iter().flat_map(|search| &search.nodes);
    assert!(nodes().any(|node| matches!(node, ProofNode::Cut { .. })), "the proof splits by no cut");
    let answer = instance.verdict(&after, &proof).expect("a proof that holds");
    assert_eq!(answer.fewest, 2);
    assert!(answer.cost_lower_bound > after.cost.map(|cost| cost * 0.999), "{answer:?} {after:?}");
    // Any other set of regions gives other exits.
    let mut forged = proof.clone();
    forged.cuts[0].inside.clear();
    let error = instance.verdict(&after, &forged).expect_err("a cut about nothing").to_string();
    assert!(error.contains("left possible") || error.contains("tree"), "{error}");
    // Without its multipliers nothing keeps a segment from the exit.
    let mut forged = proof.clone();
    forged.bounds.iter_mut().flat_map(|bound| &mut bound.exits).for_each(|(kept, _)| kept.fill(0.0));
    let error = instance.verdict(&after, &forged).expect_err("an exit without multipliers").to_string();
    assert!(error.contains("left possible"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(120) })]

    /// What the planner concludes is accepted, and denies nothing that is possible.
    #[test]
    fn proofs_of_the_planner_are_accepted(instance in instance(), cuts in cuts()) {
        let Some((plan, proof)) = instance.planned(&cuts) else { return Ok(()) };
        let answer = instance.verdict(&plan, &proof);
        prop_assert!(answer.is_ok(), "{answer:?} {plan:?}");
        if let Ok(answer) = answer {
            instance.judge(&plan, &answer)?;
            let claimed = plan.n_grasps.unwrap_or(plan.tried.len() + 1);
            prop_assert!(plan.status == PlanStatus::Feasible || answer.fewest == claimed);
            prop_assert_eq!(Some(plan), instance.planned(&cuts).map(|again| again.0));
        }
    }

    /// Whatever is done to plan and proof: what is accepted all the same is true.
    #[test]
    fn forged_proofs_prove_nothing_false(
        instance in instance(),
        cuts in cuts(),
        damages in proptest::collection::vec((0..14_usize, 0..1000_usize, -2.0..4.0_f64), 1..4),
    ) {
        let Some((mut plan, mut proof)) = instance.planned(&cuts) else { return Ok(()) };
        for (kind, at, factor) in damages {
            damage(kind, at, factor, &mut plan, &mut proof, instance.boxes.len());
        }
        if let Ok(answer) = instance.verdict(&plan, &proof) {
            instance.judge(&plan, &answer)?;
        }
    }
}
