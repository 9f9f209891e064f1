//! Inequality (2) of `proof.bin`: a lower bound for all motions of a node, from multipliers of any origin.
//!
//! The multipliers of a relaxation ([`crate::relaxation`]) are taken for steps, kept forms and exits; those of the sets are
//! found anew, one small linear programme a region, so that the bound is at least that of the relaxation's own dual,
//! and a shortest path over chains of regions takes the place of its weights.

use super::sets::{BoxedSet, Sparse, Support, room};
use crate::instance::Instance;
use crate::kept_system::mode_of_segment;
use manipulation::Enclosure;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// r_i, μ_{i,c} and λ_e.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Multipliers {
    /// r_i, one a segment; none to prove that there is no motion.
    pub steps: Vec<DVector<f64>>,
    /// μ_{i,c} for each segment, by class; or two, for even and odd segments.
    pub segments: Vec<BTreeMap<usize, Vec<f64>>>,
    /// λ_e, in the order of the exits.
    pub exits: Vec<Vec<f64>>,
}

/// A bound, and the multipliers of the sets that give it.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainValue {
    /// No motion costs less; +∞ if there is none.
    pub bound: f64,
    /// For each of x_1 … x_{2ℓ}: (region, multipliers).
    pub waypoints: Vec<Vec<(usize, Sparse)>>,
    /// For each exit.
    pub exits: Vec<Sparse>,
}

/// Supports that were computed, by region and slope.
pub type KnownSupports = BTreeMap<(usize, Vec<u64>), Support>;

/// A linear function of one point, with the sizes of what its slope was summed from.
struct Slope {
    g: DVector<f64>,
    size: DVector<f64>,
}

impl Multipliers {
    fn kept(&self, segment_idx: usize, class: Option<usize>) -> Option<&[f64]> {
        let n = self.segments.len();
        let segment = self.segments.get(if n == 2 { segment_idx % 2 } else { segment_idx })?;
        segment.get(&class?).map(Vec::as_slice)
    }

    /// Slope of the term of segment `segment_idx` in its end; that in its start is the negative.
    fn slope(&self, instance: &Instance, segment_idx: usize, class: Option<usize>) -> Slope {
        let n = instance.manipulation.dim();
        let mut slope = Slope { g: DVector::zeros(n), size: DVector::zeros(n) };
        if let Some(step) = self.steps.get(segment_idx) {
            slope.add(&(step * 2.0));
        }
        if let Some(kept) = self.kept(segment_idx, class) {
            slope.add_forms(instance.manipulation.kept_forms(mode_of_segment(segment_idx)), kept);
        }
        slope
    }
}

impl Slope {
    fn add(&mut self, g: &DVector<f64>) {
        self.g += g;
        self.size += g.abs();
    }

    fn add_forms(&mut self, F: &DMatrix<f64>, kept: &[f64]) {
        for (form, kept) in F.row_iter().zip(kept) {
            self.add(&(form.transpose() * *kept));
        }
    }

    /// The function at a given point, rounded down with room to spare.
    fn at(&self, sign: f64, x: &DVector<f64>) -> f64 {
        let sum = (0..x.len()).fold(Enclosure::zero(), |sum, k| {
            sum.plus(Enclosure::exact(sign * self.g[k]).times(Enclosure::exact(x[k])))
        });
        sum.lower - room(self.size.dot(&x.abs()))
    }
}

/// The bound for the motions whose x_i lies in a region of `allowed[i]`, in chains, and whose segments pass `exits`.
pub fn evaluate(
    instance: &Instance,
    allowed: &[Vec<usize>],
    exits: &[(usize, usize, usize)],
    multipliers: &Multipliers,
    known: &mut KnownSupports,
) -> ChainValue {
    let last = allowed.len() - 1;
    let mut constant = 0.0;
    for step in &multipliers.steps {
        let square = step
            .iter()
            .fold(Enclosure::zero(), |sum, &r| sum.plus(Enclosure::exact(r).times(Enclosure::exact(r))));
        constant = add_below(constant, -square.upper - room(square.upper));
    }
    // Slopes of exits in the points where their segments begin.
    let mut at_start: BTreeMap<usize, Slope> = BTreeMap::new();
    let mut exit_multipliers = Vec::with_capacity(exits.len());
    for (position, &(segment_idx, cut_idx, exit_idx)) in exits.iter().enumerate() {
        let mode = mode_of_segment(segment_idx);
        let n = instance.manipulation.dim();
        let mut slope = Slope { g: DVector::zeros(n), size: DVector::zeros(n) };
        let kept = multipliers.exits.get(position).map_or(&[][..], Vec::as_slice);
        slope.add_forms(instance.manipulation.kept_forms(mode), kept);
        let exit = &instance.cuts[cut_idx].exits[exit_idx];
        let pair = [exit.inside.min(exit.outside), exit.inside.max(exit.outside)];
        let support = BoxedSet::of_mode(instance.manipulation, mode, &pair).minimum(&slope.g, &slope.size);
        constant = add_below(constant, support.value);
        exit_multipliers.push(support.multipliers);
        let sum = at_start
            .entry(segment_idx)
            .or_insert_with(|| Slope { g: DVector::zeros(n), size: DVector::zeros(n) });
        sum.g += &slope.g;
        sum.size += &slope.size;
    }
    let class =
        |segment_idx: usize, region_idx: usize| instance.class(mode_of_segment(segment_idx), region_idx);
    // Slope in x_i of all terms, if it lies in a region of these classes.
    let slope_at = |waypoint_idx: usize, before: Option<usize>, after: Option<usize>| -> Slope {
        let mut slope = Slope {
            g: DVector::zeros(instance.manipulation.dim()),
            size: DVector::zeros(instance.manipulation.dim()),
        };
        if waypoint_idx > 0 {
            let before = multipliers.slope(instance, waypoint_idx - 1, before);
            slope.g += before.g;
            slope.size += before.size;
        }
        if waypoint_idx < last {
            let after = multipliers.slope(instance, waypoint_idx, after);
            slope.g -= after.g;
            slope.size += after.size;
            if let Some(exit) = at_start.get(&waypoint_idx) {
                slope.g -= &exit.g;
                slope.size += &exit.size;
            }
        }
        slope
    };
    // Least sum up to the current point, by the class of the segment that follows.
    let mut best: BTreeMap<Option<usize>, f64> = BTreeMap::new();
    for &region_idx in &allowed[0] {
        let after = class(0, region_idx);
        let value = add_below(constant, slope_at(0, None, after).at(1.0, &instance.start));
        keep_least(&mut best, after, value);
    }
    let mut waypoints = Vec::with_capacity(last.saturating_sub(1));
    for waypoint_idx in 1..last {
        let mut next = BTreeMap::new();
        let mut supports = Vec::with_capacity(allowed[waypoint_idx].len());
        for &region_idx in &allowed[waypoint_idx] {
            let (before, after) = (class(waypoint_idx - 1, region_idx), class(waypoint_idx, region_idx));
            let slope = slope_at(waypoint_idx, before, after);
            let key = (region_idx, slope.g.iter().map(|g| g.to_bits()).collect());
            let support = known.entry(key).or_insert_with(|| {
                instance.relations.waypoint_sets[region_idx].minimum(&slope.g, &slope.size)
            });
            if let Some(&sum) = best.get(&before).filter(|_| before.is_some()) {
                keep_least(&mut next, after, add_below(sum, support.value));
            }
            supports.push((region_idx, support.multipliers.clone()));
        }
        waypoints.push(supports);
        best = next;
    }
    let mut value = f64::INFINITY;
    for &region_idx in &allowed[last] {
        let before = class(last - 1, region_idx);
        if let Some(&sum) = best.get(&before).filter(|_| before.is_some()) {
            let end = slope_at(last, before, None).at(1.0, &instance.goal);
            value = value.min(add_below(sum, end));
        }
    }
    let bound = match (multipliers.steps.is_empty(), value > 0.0) {
        (true, true) => f64::INFINITY,
        (true, false) => 0.0,
        (false, _) => value.max(0.0),
    };
    ChainValue { bound, waypoints, exits: exit_multipliers }
}

fn keep_least(best: &mut BTreeMap<Option<usize>, f64>, class: Option<usize>, value: f64) {
    let least = best.entry(class).or_insert(f64::INFINITY);
    *least = least.min(value);
}

/// `a + b`, rounded down with room to spare; NaN counts as no bound.
fn add_below(a: f64, b: f64) -> f64 {
    let sum = a + b - room(a.abs() + b.abs());
    if sum.is_nan() { f64::NEG_INFINITY } else { sum }
}
