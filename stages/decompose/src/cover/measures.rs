//! What is covered, on fresh samples, and what is still missing.

use super::{Cover, Decomposition, Ending, Sink};
use crate::coverage::{Estimate, covered, wilson_interval};
use crate::target::TargetKind;

/// What is still missing.
pub(super) struct Shortfall {
    pub(super) words: Vec<String>,
    /// The share of each set, and of the chord, in a fixed order: whether a round raised anything.
    pub(super) shares: Vec<f64>,
}

impl<S: Sink> Cover<'_, S> {
    /// Measures everything that is wanted against `covering`, on fresh samples.
    pub(super) fn shortfall(&mut self, after_certification: bool) -> Shortfall {
        let mut short = Shortfall { words: Vec::new(), shares: Vec::new() };
        let mut miss = |name: &str, share: f64, wanted: f64| {
            short.shares.push(share);
            if share < wanted {
                short.words.push(format!("{share:.4} of {name} covered, {wanted} wanted"));
            }
        };
        let mut estimates = Vec::new();
        for target_idx in 0..self.targets.len() {
            let kind = self.targets[target_idx].0.kind;
            if let Some(estimate) = self.estimate(kind) {
                miss(kind.name(), estimate.value, self.wanted(kind, after_certification));
                estimates.push((kind.name(), estimate));
            }
        }
        if let Some(leaves) = self.leaves.clone() {
            let chord = leaves.measure(self.problem, &self.covering, &mut self.streams.take());
            let wanted = match after_certification {
                false => self.options.chord_coverage,
                true => self.options.certified_chord_coverage,
            };
            miss("the longest chord of a transfer leaf in CG_free", chord.share(), wanted);
        }
        for anchor in &self.problem.anchors {
            let share = if covered(&self.covering, anchor.q.as_slice()) { 1.0 } else { 0.0 };
            short.shares.push(share);
            if share < 1.0 {
                short.words.push(format!("{} is in no region", anchor.name));
            }
        }
        if after_certification {
            self.certified = estimates;
        }
        short
    }

    /// The share of a set that is covered, on fresh samples; `None` if there is no such set or it is nowhere free.
    fn estimate(&mut self, kind: TargetKind) -> Option<Estimate> {
        let (target, _) = self.targets.iter().find(|(target, _)| target.kind == kind)?.clone();
        let samples = target
            .sample_free(self.problem.free, self.options.coverage_samples, &mut self.streams.take())
            .free;
        let n_hits = samples.iter().filter(|q| covered(&self.covering, q)).count();
        (!samples.is_empty()).then(|| wilson_interval(n_hits, samples.len()))
    }

    /// Final figures of the candidates.
    pub(super) fn finish(mut self, ending: Ending) -> Result<Decomposition, S::Error> {
        self.covering = self.regions.iter().map(|region| region.polyhedron.clone()).collect();
        let nothing = wilson_interval(0, 0);
        let total = self.estimate(TargetKind::Total).unwrap_or(nothing);
        let grasp = self.problem.grasp.as_ref().map(|_| self.estimate(TargetKind::Grasp).unwrap_or(nothing));
        // A placement space that is the whole joint box has the figures of the whole.
        let placement =
            self.problem.placement.as_ref().map(|_| self.estimate(TargetKind::Placement).unwrap_or(total));
        let chord = self
            .leaves
            .clone()
            .map(|leaves| leaves.measure(self.problem, &self.covering, &mut self.streams.take()));
        Ok(Decomposition {
            regions: self.regions,
            total,
            grasp,
            placement,
            chord,
            certified: self.certified,
            ending,
        })
    }
}
