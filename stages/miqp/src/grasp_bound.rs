//! Lower bounds on the number of grasps, before any search.
//!
//! 1. By connected regions: a transit stays in one connected region of CP_free, a transfer in one of CG_free. The regions
//!    that can be reached with ℓ grasps grow with ℓ; the goal must be among them.
//! 2. By the longest transfer: a form f that a transit keeps changes in transfers only. For each connected region r of
//!    CG_free, `D_r = max f·(v - u)` over u, v in the hull of its sets CG ∩ CP ∩ P_j with F_transfer u = F_transfer v;
//!    ℓ grasps change f by at most ℓ · max_r D_r. For the bottle cap f is the cap's angle.
//!
//! Both are inequality (2) of `proof.bin` without steps, the second with f as multiplier of every transit and with the
//! multipliers of D_r in transfers; which ℓ are excluded is decided by that inequality ([`crate::proof`]) alone.

use crate::hull::Hulls;
use crate::instance::{Instance, WaypointSet};
use crate::node::Node;
use crate::proof::{ChainValue, KnownSupports, Multipliers, evaluate};
use crate::relaxation::add_polytope;
use conic::{ConicError, ConicProgram, Settings, safe_farkas, safe_lower_bound, solve};
use manipulation::{Enclosure, PathMode};
use std::collections::{BTreeMap, BTreeSet};

/// What is known of ℓ before any search.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspBound {
    /// At least this many grasps; `None` if no number suffices.
    pub n_grasps: Option<usize>,
    /// Why fewer do not suffice, in words.
    pub reason: String,
    /// Why, in multipliers that are the same for every ℓ; none where connected regions alone tell.
    pub multipliers: Multipliers,
}

impl GraspBound {
    fn new(n_grasps: Option<usize>, reason: &str) -> Self {
        Self { n_grasps, reason: reason.to_owned(), multipliers: Multipliers::default() }
    }

    /// The largest ℓ ≤ `most` up to which every ℓ ≥ 1 is proven to have no motion, and the inequality for it.
    pub fn proven(&self, instance: &Instance, most: usize) -> Option<(usize, ChainValue)> {
        let most = most.min(self.n_grasps.map_or(usize::MAX, |n_grasps| n_grasps - 1));
        let mut known = KnownSupports::new();
        let mut proven = None;
        for n_grasps in 1..=most {
            let root = Node::root(instance, n_grasps);
            let value = evaluate(instance, &root.allowed, &[], &self.multipliers, &mut known);
            if value.bound < f64::INFINITY {
                break;
            }
            proven = Some((n_grasps, value));
        }
        let (n_grasps, mut value) = proven?;
        // Points of even and of odd position are alike.
        value.waypoints.truncate(2);
        Some((n_grasps, value))
    }
}

/// The bound for `instance`; `names` are the coordinates' names for the words. Bounds above K are of no use and are
/// returned as they are.
pub fn grasp_bound(instance: &Instance, names: &[String]) -> Result<GraspBound, ConicError> {
    let by_regions = bound_by_regions(instance);
    let Some(n_by_regions) = by_regions.n_grasps else { return Ok(by_regions) };
    let by_transfer = bound_by_transfer(instance, names)?;
    Ok(if by_transfer.n_grasps.is_some_and(|n_grasps| n_grasps <= n_by_regions) {
        by_regions
    } else {
        by_transfer
    })
}

fn bound_by_regions(instance: &Instance) -> GraspBound {
    let never = |reason: &str| GraspBound::new(None, reason);
    let inner = instance.inner_regions();
    if instance.start_regions.is_empty() {
        return never("the start lies in no region of CP_free");
    }
    if instance.goal_regions.is_empty() {
        return never("the goal lies in no region of CP_free");
    }
    if inner.is_empty() {
        return never("grasps are missing: no region meets CG and CP, CG_free has no region");
    }
    let transit = |idx: usize| instance.class(PathMode::Transit, idx);
    let transfer = |idx: usize| instance.class(PathMode::Transfer, idx);
    let start = transit(instance.start_regions[0]);
    let goal = transit(instance.goal_regions[0]);
    if !inner.iter().any(|&idx| transit(idx) == start) {
        return never(
            "grasps are missing: the connected region of CP_free that holds the start has no grasp",
        );
    }
    if !inner.iter().any(|&idx| transit(idx) == goal) {
        return never(
            "grasps are missing: the connected region of CP_free that holds the goal has no release",
        );
    }
    let mut resting = BTreeSet::from([start]);
    for n_grasps in 1.. {
        let held: BTreeSet<_> =
            inner.iter().filter(|&&idx| resting.contains(&transit(idx))).map(|&idx| transfer(idx)).collect();
        let mut reached = resting.clone();
        reached.extend(inner.iter().filter(|&&idx| held.contains(&transfer(idx))).map(|&idx| transit(idx)));
        // From a region without a grasp nothing leads on, so the goal counts as reached only by a transfer.
        let released = inner.iter().any(|&idx| held.contains(&transfer(idx)) && transit(idx) == goal);
        if released {
            let reason = "fewer grasps do not lead from the start's connected region to the goal's";
            return GraspBound::new(Some(n_grasps), reason);
        }
        if reached == resting {
            break;
        }
        resting = reached;
    }
    never(
        "paths are missing: no sequence of connected regions of CP_free and CG_free leads from start to goal",
    )
}

fn bound_by_transfer(instance: &Instance, names: &[String]) -> Result<GraspBound, ConicError> {
    let mut bound = GraspBound::new(Some(1), "a grasp is needed");
    let F = &instance.manipulation.F_transit;
    for (form_idx, form) in F.row_iter().enumerate() {
        let form: Vec<f64> = form.iter().copied().collect();
        let difference = (0..form.len()).fold(Enclosure::zero(), |sum, k| {
            let step = Enclosure::exact(instance.goal[k]).minus(Enclosure::exact(instance.start[k]));
            sum.plus(Enclosure::exact(form[k]).times(step))
        });
        let sign = if difference.lower > 0.0 {
            1.0
        } else if difference.upper < 0.0 {
            -1.0
        } else {
            continue;
        };
        let needed = if sign > 0.0 { difference.lower } else { -difference.upper };
        let directed: Vec<f64> = form.iter().map(|f| sign * f).collect();
        let (longest, in_transfers) = longest_transfer(instance, &directed)?;
        let words = words_of_form(&form, names);
        let transit = (0..F.nrows()).map(|idx| if idx == form_idx { sign } else { 0.0 }).collect::<Vec<_>>();
        let resting = instance.relations.classes(PathMode::Transit);
        let in_transits = resting.into_iter().map(|class| (class, transit.clone())).collect();
        let multipliers = Multipliers { segments: vec![in_transits, in_transfers], ..Multipliers::default() };
        if longest <= 0.0 {
            let reason = format!(
                "grasps are missing: no transfer in CG_free changes {words}, the task asks for {needed:.4}"
            );
            return Ok(GraspBound { n_grasps: None, reason, multipliers });
        }
        let n_grasps = least_count(needed, longest);
        if bound.n_grasps.is_some_and(|best| n_grasps > best) {
            let reason = format!(
                "a grasp changes {words} by at most {longest:.4} within one connected region of CG_free, the task asks \
                 for {needed:.4}"
            );
            bound = GraspBound { n_grasps: Some(n_grasps), reason, multipliers };
        }
    }
    Ok(bound)
}

/// The least ℓ with ℓ · `longest` ≥ `needed`, both positive, rounded so that it is never too large; not above a million.
fn least_count(needed: f64, longest: f64) -> usize {
    let quotient = (needed / longest).min(1e6);
    let mut n_grasps = (quotient.ceil() as usize).max(1);
    // The quotient is rounded: step back while fewer grasps cannot be excluded.
    while n_grasps > 1 && ((n_grasps - 1) as f64 * longest).next_up() >= needed {
        n_grasps -= 1;
    }
    n_grasps
}

/// Multipliers of the kept forms, by class.
type ByClass = BTreeMap<usize, Vec<f64>>;

/// A number that is at least `max f·(v - u)` over pairs in one connected region of CG_free with equal kept forms, and
/// the multipliers of `F_transfer (v - u)` in each class that show it.
pub fn longest_transfer(instance: &Instance, f: &[f64]) -> Result<(f64, ByClass), ConicError> {
    let inner = instance.inner_regions();
    let classes: BTreeSet<Option<usize>> =
        inner.iter().map(|&idx| instance.class(PathMode::Transfer, idx)).collect();
    let mut longest = f64::NEG_INFINITY;
    let mut hulls = Hulls::default();
    let mut multipliers = ByClass::new();
    for class in classes {
        let members: Vec<usize> =
            inner.iter().copied().filter(|&idx| instance.class(PathMode::Transfer, idx) == class).collect();
        let (within, kept) = longest_transfer_within(instance, f, &hulls.blocks(instance, &members))?;
        longest = longest.max(within);
        multipliers.extend(class.map(|class| (class, kept)));
    }
    Ok((longest, multipliers))
}

/// min -f·(v - u), u and v in the hull of `sets` in perspective form, F_transfer u = F_transfer v.
fn longest_transfer_within(
    instance: &Instance,
    f: &[f64],
    sets: &[WaypointSet],
) -> Result<(f64, Vec<f64>), ConicError> {
    let n = f.len();
    let mut program = ConicProgram::new(0);
    let (mut lower, mut upper) = (Vec::new(), Vec::new());
    let mut ends = Vec::with_capacity(2);
    for sign in [1.0, -1.0] {
        let mut firsts = Vec::new();
        let mut weights = Vec::new();
        for set in sets {
            let first = program.add_variables(n + 1);
            lower.extend(set.outer.lower.iter().map(|x| x.min(0.0)).chain([0.0]));
            upper.extend(set.outer.upper.iter().map(|x| x.max(0.0)).chain([1.0]));
            add_homogenized(&mut program, &set.polytope, first);
            program.add_less_equal(vec![(first + n, -1.0)], 0.0);
            (0..n).for_each(|k| program.add_linear_cost(first + k, sign * f[k]));
            firsts.push(first);
            weights.push((first + n, 1.0));
        }
        program.add_equality(weights, 1.0);
        ends.push(firsts);
    }
    let first_form = program.n_rows();
    for form in instance.manipulation.F_transfer.row_iter() {
        let mut terms = Vec::new();
        for (firsts, sign) in ends.iter().zip([1.0, -1.0]) {
            for &first in firsts {
                terms.extend((0..n).filter(|&k| form[k] != 0.0).map(|k| (first + k, sign * form[k])));
            }
        }
        program.add_equality(terms, 0.0);
    }
    let solution = solve(&program, &Settings::default())?;
    // Rows are F u - F v = 0, terms of the inequality μ·F (v - u).
    let kept = (first_form..program.n_rows())
        .map(|row| solution.y.get(row).map_or(0.0, |y| if y.is_finite() { -y } else { 0.0 }))
        .collect();
    if safe_farkas(&program, &solution.y, &lower, &upper) {
        return Ok((f64::NEG_INFINITY, kept));
    }
    Ok((-safe_lower_bound(&program, &solution.y, &solution.x, &lower, &upper), kept))
}

/// Rows `A x ≤ b z` for x from `first` on and z behind it.
fn add_homogenized(program: &mut ConicProgram, P: &convex_sets::HPolyhedron, first: usize) {
    let n = P.ambient_dimension();
    let homogenized = convex_sets::HPolyhedron {
        A: P.A.clone().insert_columns(n, 1, 0.0),
        b: nalgebra::DVector::zeros(P.n_faces()),
    };
    let mut with_offsets = homogenized;
    with_offsets.A.set_column(n, &-&P.b);
    add_polytope(program, &with_offsets, first);
}

/// `cap`, or `1 gripper - 1 cap`.
fn words_of_form(form: &[f64], names: &[String]) -> String {
    let terms: Vec<(usize, f64)> = form.iter().copied().enumerate().filter(|(_, f)| *f != 0.0).collect();
    let name = |k: usize| names.get(k).cloned().unwrap_or_else(|| format!("coordinate {k}"));
    match terms.as_slice() {
        [(k, _)] => name(*k),
        _ => terms.iter().map(|&(k, f)| format!("{f:+} {}", name(k))).collect::<Vec<_>>().join(" "),
    }
}
