//! What is covered, on fresh samples, and what is still missing.

use super::{Cover, Decomposition, Ending, Sink};
use crate::coverage::{Estimate, covered, wilson_interval};
use crate::leaf_chords::{ChordCoverage, chord_coverage};
use crate::target::TargetKind;

/// What is still missing.
pub(super) struct Shortfall {
    pub(super) words: Vec<String>,
    estimates: Vec<(TargetKind, Estimate)>,
    chord: Option<ChordCoverage>,
    /// The share of each set, and of the chord, in a fixed order: whether a round raised anything.
    pub(super) shares: Vec<f64>,
}

impl<S: Sink> Cover<'_, S> {
    /// Measures everything that is wanted against `covering`, on fresh samples.
    pub(super) fn shortfall(&mut self, after_certification: bool) -> Shortfall {
        let (mut words, mut shares) = (Vec::new(), Vec::new());
        let mut miss = |name: &str, share: f64, wanted: f64| {
            shares.push(share);
            if share < wanted {
                words.push(format!("{share:.4} of {name} covered, {wanted} wanted"));
            }
        };
        let mut estimates = Vec::new();
        for target_idx in 0..self.targets.len() {
            let kind = self.targets[target_idx].0.kind;
            if let Some(estimate) = self.estimate(kind) {
                // What a cover is asked for is a share that it has, not one that it may have.
                let share = if self.options.cover { estimate.low } else { estimate.value };
                miss(kind.name(), share, self.wanted(kind, after_certification));
                estimates.push((kind, estimate));
            }
        }
        let chord = self.measure_chord();
        if let Some(chord) = &chord {
            let wanted = self.wanted_chord(after_certification);
            miss("the longest chord of a transfer leaf in CG_free", chord.share(), wanted);
        }
        for anchor in &self.problem.anchors {
            let share = if covered(&self.covering, anchor.q.as_slice()) { 1.0 } else { 0.0 };
            shares.push(share);
            if share < 1.0 {
                words.push(format!("{} is in no region", anchor.name));
            }
        }
        if after_certification {
            self.certified = estimates.iter().map(|(kind, estimate)| (kind.name(), *estimate)).collect();
        }
        Shortfall { words, estimates, chord, shares }
    }

    fn measure_chord(&mut self) -> Option<ChordCoverage> {
        if self.is_thrifty {
            self.leaves.as_ref()?;
            return Some(chord_coverage(&self.free_chords(), &self.covering));
        }
        let leaves = self.leaves.clone()?;
        Some(leaves.measure(self.problem, &self.covering, &mut self.streams.take()))
    }

    /// The share of a set that is covered, on fresh samples; `None` if there is no such set or it is nowhere free.
    fn estimate(&mut self, kind: TargetKind) -> Option<Estimate> {
        let target_idx = self.targets.iter().position(|(target, _)| target.kind == kind)?;
        let samples = self.samples_of(target_idx);
        let n_hits = samples.iter().filter(|q| covered(&self.covering, q)).count();
        (!samples.is_empty()).then(|| wilson_interval(n_hits, samples.len()))
    }

    /// Free samples of a set: those that are to serve again, once, or fresh ones.
    pub(super) fn samples_of(&mut self, target_idx: usize) -> Vec<Vec<f64>> {
        let known = self.last_samples.get_mut(target_idx).map(std::mem::take);
        known.filter(|known| !known.is_empty()).unwrap_or_else(|| {
            let (target, n_free) = (&self.targets[target_idx].0, self.options.coverage_samples);
            target.sample_free(self.problem.free, n_free, &mut self.streams.take()).free
        })
    }

    /// Final figures of the candidates, unless they were just measured.
    pub(super) fn finish(mut self, ending: Ending) -> Result<Decomposition, S::Error> {
        let measured = self.measured.take();
        self.covering = self.regions.iter().map(|region| region.polyhedron.clone()).collect();
        let nothing = wilson_interval(0, 0);
        let problem = self.problem;
        let mut estimate = |kind: TargetKind| match &measured {
            Some(known) => known.estimates.iter().find(|(of, _)| *of == kind).map(|(_, estimate)| *estimate),
            None => self.estimate(kind),
        };
        let total = estimate(TargetKind::Total).unwrap_or(nothing);
        let grasp = problem.grasp.as_ref().map(|_| estimate(TargetKind::Grasp).unwrap_or(nothing));
        // A placement space that is the whole joint box has the figures of the whole.
        let placement = problem.placement.as_ref();
        let placement = placement.map(|_| estimate(TargetKind::Placement).unwrap_or(total));
        let chord = match measured {
            Some(known) => known.chord,
            None => self.measure_chord(),
        };
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
