//! Inequality (2) of `proof.bin`: a lower bound for all motions of a node.

use super::relations::{Relations, list};
use super::sets::BoxedSet;
use super::tree::Node;
use super::{AnswerError, Problem, mode_of_segment};
use crate::interval::Interval;
use ipc_types::artefact::{ChainBound, Mode, ProofFile};
use std::collections::BTreeMap;

/// What bounds are made of.
#[derive(Debug)]
pub struct Ground<'a> {
    /// The problem.
    pub problem: &'a Problem<'a>,
    /// The file.
    pub proof: &'a ProofFile,
    /// What it proves of the regions.
    pub relations: &'a Relations,
    /// CG ∩ CP ∩ P_j by j.
    pub waypoint_sets: Vec<BoxedSet>,
}

/// Least sums over chains, by the class of the segment that follows.
type Sums = BTreeMap<usize, f64>;

impl Ground<'_> {
    /// No motion of `node` costs less; +∞ if there is none.
    pub fn bound(&self, node: &Node, chain: &ChainBound) -> Result<f64, AnswerError> {
        let last = node.allowed.len() - 1;
        self.verify_shape(node, chain)?;
        let mut constant = Interval::ZERO;
        for r in chain.steps.iter().flatten() {
            constant = constant - Interval::point(*r).square();
        }
        // Slopes of the exits' terms in the points where their segments begin.
        let mut passed: BTreeMap<usize, Vec<Interval>> = BTreeMap::new();
        for (position, exit) in node.exits.iter().enumerate() {
            let Some((kept, multipliers)) = chain.exits.get(position) else { continue };
            let mode = mode_of_segment(exit.segment);
            let slope = self.form_slope(mode, kept);
            let pair = [exit.inside.min(exit.outside), exit.inside.max(exit.outside)];
            let set = self.problem.set_of_mode(mode, &pair);
            let least = set.minimum(&slope, list(self.proof, *multipliers)?)?;
            constant = constant + Interval::point(least);
            let sum = passed.entry(exit.segment).or_insert_with(|| self.zero());
            *sum = plus(sum, &slope);
        }
        let slope = |point: usize, before: Option<usize>, after: Option<usize>| {
            let mut sum = self.zero();
            if let (Some(class), true) = (before, point > 0) {
                sum = plus(&sum, &self.segment_slope(chain, point - 1, class));
            }
            if let (Some(class), true) = (after, point < last) {
                sum = minus(&sum, &self.segment_slope(chain, point, class));
            }
            passed.get(&point).map_or(sum.clone(), |exits| minus(&sum, exits))
        };
        let class = |segment: usize, region: usize| self.relations.class(mode_of_segment(segment), region);
        let mut sums = Sums::new();
        for &region in &node.allowed[0] {
            if let Some(after) = class(0, region) {
                let at_start = at(&slope(0, None, Some(after)), self.problem.task.start.as_slice());
                keep_least(&mut sums, after, (constant + at_start).lo());
            }
        }
        for point in 1..last {
            let listed = entry(&chain.waypoints, point - 1).map_or(&[][..], Vec::as_slice);
            let listed: BTreeMap<u32, u32> = listed.iter().copied().collect();
            let mut next = Sums::new();
            for &region in &node.allowed[point] {
                let (before, after) = (class(point - 1, region), class(point, region));
                let (Some(sum), Some(after)) = (before.and_then(|class| sums.get(&class)), after) else {
                    continue;
                };
                let multipliers = match listed.get(&(region as u32)) {
                    Some(&position) => list(self.proof, position)?,
                    None => &[],
                };
                let slope = slope(point, before, Some(after));
                let least = self.waypoint_sets[region].minimum(&slope, multipliers)?;
                keep_least(&mut next, after, (Interval::point(*sum) + Interval::point(least)).lo());
            }
            sums = next;
        }
        let mut value = f64::INFINITY;
        for &region in &node.allowed[last] {
            let before = class(last - 1, region);
            if let Some(sum) = before.and_then(|class| sums.get(&class)) {
                let at_goal = at(&slope(last, before, None), self.problem.task.goal.as_slice());
                value = value.min((Interval::point(*sum) + at_goal).lo());
            }
        }
        Ok(match (chain.steps.is_empty(), value > 0.0) {
            (true, true) => f64::INFINITY,
            (true, false) => 0.0,
            (false, _) => value.max(0.0),
        })
    }

    /// Slope of the terms of a segment in its end; in its start it is the negative.
    fn segment_slope(&self, chain: &ChainBound, segment: usize, class: usize) -> Vec<Interval> {
        let by_class = entry(&chain.segments, segment).map_or(&[][..], Vec::as_slice);
        let kept = by_class.iter().find(|(name, _)| *name as usize == class);
        let forms = kept.map_or(self.zero(), |(_, kept)| self.form_slope(mode_of_segment(segment), kept));
        match chain.steps.get(segment) {
            Some(step) => {
                let doubled: Vec<Interval> = step.iter().map(|r| Interval::point(2.0 * r)).collect();
                plus(&forms, &doubled)
            }
            None => forms,
        }
    }

    /// Σ μ_k F_k.
    fn form_slope(&self, mode: Mode, kept: &[f64]) -> Vec<Interval> {
        let mut sum = self.zero();
        for (form, &mu) in self.problem.forms(mode).iter().zip(kept) {
            for (sum, &f) in sum.iter_mut().zip(form.iter()) {
                *sum = *sum + Interval::point(mu) * Interval::point(f);
            }
        }
        sum
    }

    /// The lists have the lengths that the node asks for, and their numbers are numbers.
    fn verify_shape(&self, node: &Node, chain: &ChainBound) -> Result<(), AnswerError> {
        let n = self.problem.dim();
        let n_segments = node.allowed.len() - 1;
        let shape = |what| Err(AnswerError::Shape(what));
        let fits = |found: usize, wanted: usize| found == wanted || found == 2 || found == 0;
        if !(chain.steps.is_empty() || chain.steps.len() == n_segments) {
            return shape("steps");
        }
        if !fits(chain.segments.len(), n_segments) || !fits(chain.waypoints.len(), n_segments - 1) {
            return shape("segments or waypoints");
        }
        if chain.exits.len() != node.exits.len() {
            return shape("exits");
        }
        let good = |values: &[f64], count: usize| {
            values.len() == count && values.iter().all(|value| value.is_finite())
        };
        let steps = chain.steps.iter().all(|step| good(step, n));
        let segments = chain.segments.iter().enumerate().all(|(segment, by_class)| {
            let n_forms = self.problem.forms(mode_of_segment(segment)).len();
            by_class.iter().all(|(_, kept)| good(kept, n_forms))
        });
        let exits = chain
            .exits
            .iter()
            .zip(&node.exits)
            .all(|((kept, _), exit)| good(kept, self.problem.forms(mode_of_segment(exit.segment)).len()));
        if steps && segments && exits { Ok(()) } else { Err(AnswerError::NotFinite("a bound")) }
    }

    fn zero(&self) -> Vec<Interval> {
        vec![Interval::ZERO; self.problem.dim()]
    }
}

/// The entry of a position in a list of all, or in one of two for even and odd positions.
fn entry<T>(all: &[T], position: usize) -> Option<&T> {
    all.get(if all.len() == 2 { position % 2 } else { position })
}

fn keep_least(sums: &mut Sums, class: usize, value: f64) {
    let least = sums.entry(class).or_insert(f64::INFINITY);
    *least = least.min(value);
}

fn at(slope: &[Interval], x: &[f64]) -> Interval {
    slope.iter().zip(x).fold(Interval::ZERO, |sum, (g, &x)| sum + *g * Interval::point(x))
}

fn plus(a: &[Interval], b: &[Interval]) -> Vec<Interval> {
    a.iter().zip(b).map(|(&a, &b)| a + b).collect()
}

fn minus(a: &[Interval], b: &[Interval]) -> Vec<Interval> {
    a.iter().zip(b).map(|(&a, &b)| a - b).collect()
}
