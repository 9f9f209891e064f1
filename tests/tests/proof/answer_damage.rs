//! Kinds of damage to the proof of the answer, and to what the plan claims of it.
//!
//! The run is of `bottle-cap-3dof`: the proof speaks of 0 grasps, of 1 to 9, and of 10 by a tree that splits.

use crate::damage::{Damage, bytes, damage, forge, plan, regions};
use ipc_types::artefact::{
    Apart, ChainBound, Contained, EmptySet, PlanFile, ProofFile, ProofNode, ProofSet, Region, Search,
    TriedStatus,
};
use ipc_types::store;
use std::path::Path;

fn proof(change: fn(&mut ProofFile)) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| forge(run, "miqp", "proof", change))
}

fn of_many(file: &mut ProofFile) -> &mut Search {
    file.searches.iter_mut().find(|search| search.first == 1 && search.last > 1).expect("1 to 9 grasps")
}

fn of_ten(file: &mut ProofFile) -> &mut Search {
    file.searches.iter_mut().find(|search| search.first == 10).expect("10 grasps")
}

/// The bound of a leaf, one of a cost or one that there is no motion.
fn bound_of(
    file: &mut ProofFile,
    search: fn(&mut ProofFile) -> &mut Search,
    of_cost: bool,
) -> &mut ChainBound {
    let leaves: Vec<usize> = search(file).nodes.iter().filter_map(bound_position).collect();
    let leaf = leaves.into_iter().find(|&leaf| file.bounds[leaf].steps.is_empty() != of_cost);
    &mut file.bounds[leaf.expect("a leaf with such a bound")]
}

fn bound_position(node: &ProofNode) -> Option<usize> {
    match node {
        ProofNode::Leaf(Some(bound)) => Some(*bound as usize),
        _ => None,
    }
}

fn of_cost(file: &mut ProofFile) -> &mut ChainBound {
    bound_of(file, of_ten, true)
}

/// Multipliers of a grasp or release in the bound for 1 to 9 grasps.
fn multipliers(file: &mut ProofFile) -> &mut Vec<(u32, f64)> {
    let listed = bound_of(file, of_many, false).waypoints[0][0].1;
    &mut file.multipliers[listed as usize]
}

fn groups(file: &mut ProofFile) -> &mut Vec<Vec<u32>> {
    let split = of_ten(file).nodes.iter_mut().find_map(|node| match node {
        ProofNode::Waypoint { groups, .. } => Some(groups),
        _ => None,
    });
    split.expect("a split")
}

const LEFT_POSSIBLE: &str = "is left possible, though the plan claims that there is no motion";

/// All kinds.
pub fn all() -> Vec<Damage> {
    let mut all = of_file();
    all.extend(of_sets());
    all.extend(of_bounds());
    all.extend(of_trees());
    all.extend(of_claims());
    all
}

fn of_file() -> Vec<Damage> {
    vec![
        damage(
            "a bit of the proof flips",
            bytes("miqp/proof.bin", |b| {
                let middle = b.len() / 2;
                b[middle] ^= 4;
            }),
            "proof.bin: the body does not match its digest",
        ),
        damage(
            "the proof is cut off",
            bytes("miqp/proof.bin", |b| b.truncate(b.len() - 7)),
            "7 bytes are missing",
        ),
        damage(
            "the proof is of another scene",
            Box::new(|run| {
                let file: ProofFile = store::read_bin(&run.join("miqp/proof.bin"), None).expect("a proof");
                store::write_bin(&run.join("miqp"), "proof", &file, &[7; 32]).expect("the forgery");
            }),
            "proof.bin: made for another scene",
        ),
        damage(
            "the plan stands in for its proof",
            Box::new(|run| {
                std::fs::copy(run.join("miqp/plan.bin"), run.join("miqp/proof.bin")).expect("the forgery");
            }),
            "expected the proof of a plan",
        ),
    ]
}

fn of_sets() -> Vec<Damage> {
    vec![
        damage(
            "a proof that regions are apart is missing",
            proof(|f| {
                f.apart.pop();
            }),
            LEFT_POSSIBLE,
        ),
        damage(
            "a pair is called apart by the multipliers of another",
            proof(|f| f.apart[0].multipliers = f.apart[f.apart.len() - 1].multipliers),
            "are not proven apart",
        ),
        damage(
            "a region is called apart from itself",
            proof(|f| f.apart[0].b = f.apart[0].a),
            "not proven apart",
        ),
        damage(
            "a set that has points is called empty",
            proof(|f| {
                let n_regions = f.apart.iter().map(|apart| apart.a.max(apart.b)).max().unwrap_or(0);
                for region in 0..=n_regions {
                    f.empty.push(EmptySet { set: ProofSet::Waypoint, region, multipliers: 0 });
                }
            }),
            "do not prove its Waypoint set empty",
        ),
        damage(
            "a region is left out in favour of one that does not hold it",
            proof(|f| {
                let Apart { a, b, .. } = f.apart[0];
                f.contained.push(Contained { inner: a, outer: b, faces: vec![0; 3] });
            }),
            "are not proven to lie in region",
        ),
        damage(
            "a region of the proof does not exist",
            proof(|f| f.apart[0].b = 4711),
            "region 4711 does not exist",
        ),
        damage(
            "a list of multipliers does not exist",
            proof(|f| f.empty[0].multipliers = 1 << 30),
            "list of multipliers 1073741824 does not exist",
        ),
    ]
}

fn of_bounds() -> Vec<Damage> {
    vec![
        damage(
            "a multiplier is scaled",
            proof(|f| multipliers(f).iter_mut().for_each(|(_, y)| *y *= 1.5)),
            LEFT_POSSIBLE,
        ),
        damage(
            "a multiplier is negative",
            proof(|f| multipliers(f)[0].1 = -1e-9),
            "not a number of at least 0",
        ),
        damage(
            "a multiplier is not a number",
            proof(|f| multipliers(f)[0].1 = f64::NAN),
            "is NaN, not a number",
        ),
        damage(
            "a multiplier is of a row that is none",
            proof(|f| multipliers(f)[0].0 = 999),
            "row 999 does not exist",
        ),
        damage(
            "the multipliers of the kept forms are doubled",
            proof(|f| bound_of(f, of_many, false).segments[1].iter_mut().for_each(|(_, mu)| mu[0] *= 2.0)),
            LEFT_POSSIBLE,
        ),
        damage(
            "the multipliers of two classes are exchanged",
            proof(|f| of_cost(f).segments[3].iter_mut().for_each(|(class, _)| *class += 1)),
            "the plan claims",
        ),
        damage("a step is not a number", proof(|f| of_cost(f).steps[2][0] = f64::NAN), "not finite"),
        damage("a step is too short", proof(|f| of_cost(f).steps[2].truncate(2)), "too few"),
        damage("a step is longer", proof(|f| of_cost(f).steps[2][0] += 0.3), "the plan claims 15."),
        damage("the steps are gone", proof(|f| of_cost(f).steps.clear()), "the plan claims 15."),
        damage(
            "an exit is passed that was not chosen",
            proof(|f| of_cost(f).exits.push((vec![0.0], 0))),
            "as many exits",
        ),
    ]
}

fn of_trees() -> Vec<Damage> {
    vec![
        damage(
            "a node is dropped",
            proof(|f| {
                of_ten(f).nodes.pop();
            }),
            "the nodes after it are too few for its children",
        ),
        damage(
            "a node is added",
            proof(|f| of_ten(f).nodes.push(ProofNode::Leaf(None))),
            "follows a tree that is complete",
        ),
        damage(
            "the branches of a node are exchanged",
            proof(|f| groups(f).swap(0, 1)),
            "the plan claims 15.",
        ),
        damage(
            "a branch loses a region",
            proof(|f| {
                let group = groups(f).iter_mut().max_by_key(|group| group.len()).expect("a branch");
                group.pop();
            }),
            "a region of its point is in no child",
        ),
        damage(
            "a leaf has no bound",
            proof(|f| {
                let leaf = of_ten(f).nodes.iter_mut().find(|n| matches!(n, ProofNode::Leaf(Some(_))));
                *leaf.expect("a leaf with a bound") = ProofNode::Leaf(None);
            }),
            "the cost is proven to be at least 0, the plan claims 15.",
        ),
        damage(
            "a leaf has a bound that does not exist",
            proof(|f| {
                let leaf = of_ten(f).nodes.last_mut();
                *leaf.expect("a node") = ProofNode::Leaf(Some(4711));
            }),
            "bound 4711 does not exist",
        ),
        damage("fewer grasps are excluded", proof(|f| of_many(f).last = 8), "nothing is proven of 9 grasps"),
        damage(
            "the bound is proven for another number of grasps",
            proof(|f| {
                let search = of_ten(f);
                (search.first, search.last) = (11, 11);
            }),
            "nothing is proven of 10 grasps",
        ),
        damage(
            "the transit alone is not excluded",
            proof(|f| {
                f.searches.remove(0);
            }),
            "nothing is proven of 0 grasps",
        ),
    ]
}

/// A tenth grasp is called impossible, by the bound for nine.
fn deny(run: &Path) {
    forge(run, "miqp", "proof", |f: &mut ProofFile| {
        of_many(f).last = 10;
        f.searches.retain(|search| search.first != 10);
    });
    forge(run, "miqp", "plan", |p: &mut PlanFile| {
        p.tried[9].status = TriedStatus::Infeasible;
        (p.tried[9].cost, p.tried[9].lower_bound) = (None, None);
        p.status = ipc_types::artefact::PlanStatus::Infeasible;
        (p.n_grasps, p.cost, p.lower_bound) = (None, None, None);
        (p.configurations, p.regions, p.modes) = (None, None, None);
    });
}

fn of_claims() -> Vec<Damage> {
    vec![
        damage(
            "the lower bound is raised",
            plan(|p| p.lower_bound = p.lower_bound.map(|bound| bound + 1e-5)),
            "miqp/proof.bin: with 10 grasps the cost is proven to be at least 15.",
        ),
        damage(
            "the lower bound of the last try is raised",
            plan(|p| p.tried[9].lower_bound = p.cost),
            "with 10 grasps the cost is proven to be at least 15.",
        ),
        damage("the lower bound is gone", plan(|p| p.lower_bound = None), "optimal without a lower bound"),
        damage(
            "the cost is lowered",
            plan(|p| p.cost = p.cost.map(|cost| cost - 1e-6)),
            "its steps cost 15.",
        ),
        damage(
            "a number of grasps was not tried",
            plan(|p| {
                p.tried.remove(4);
            }),
            "is not 1, 2, …, 10",
        ),
        damage(
            "the plan is called impossible",
            Box::new(deny),
            "with 10 grasps a cost of 0 is left possible",
        ),
        damage(
            "there is a region that the proof does not know",
            regions(|f| {
                // All of the grasp band: it joins what the proof keeps apart.
                let found = f.regions.iter().max_by_key(|region| region.id).expect("a region");
                let wide = Region {
                    id: found.id + 1,
                    A: vec![vec![0.0, 1.0, 0.0]],
                    b: vec![1.0],
                    certified: false,
                    ..found.clone()
                };
                f.regions.push(wide);
            }),
            "miqp/proof.bin: with",
        ),
    ]
}
