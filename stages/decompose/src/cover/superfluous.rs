//! Few, large regions: what others cover is dropped before it is handed over.
//!
//! Growth takes the regions that add most to what is covered *so far*; later and larger ones often cover the earlier.
//! A region goes if the targets are still met without it, on fresh samples, and nothing comes apart: neither the
//! overlaps in CS, CG and CP, nor the longest chord of a transfer leaf, nor what contains start and goal.

use convex_sets::HPolyhedron;

use super::{Cover, Sink};
use crate::coverage::{contains, wilson_interval};
use crate::leaf_chords::chord_coverage;
use crate::target::TargetKind;

/// A set's samples, by the regions that cover them.
struct Tally {
    /// For each region, whether it covers each sample.
    covers: Vec<Vec<bool>>,
    /// For each sample, by how many it is covered.
    n_covering: Vec<usize>,
    n_missed: usize,
    /// Samples that may be missed.
    n_allowed: usize,
}

impl Tally {
    /// `wanted`: the share to cover; the lower end of the interval must reach it.
    fn new(regions: &[HPolyhedron], samples: &[Vec<f64>], wanted: f64) -> Self {
        let covers: Vec<Vec<bool>> =
            regions.iter().map(|region| samples.iter().map(|q| contains(region, q)).collect()).collect();
        let n_covering: Vec<usize> =
            (0..samples.len()).map(|sample| covers.iter().filter(|covers| covers[sample]).count()).collect();
        let n_missed = n_covering.iter().filter(|&&n| n == 0).count();
        let n = samples.len();
        let n_most = (0..=n).take_while(|missed| wilson_interval(n - missed, n).low >= wanted).count();
        Self { covers, n_covering, n_missed, n_allowed: n_most.saturating_sub(1).max(n_missed) }
    }

    /// Samples that only this region covers.
    fn loss(&self, region_idx: usize) -> usize {
        self.covers[region_idx]
            .iter()
            .zip(&self.n_covering)
            .filter(|(covers, n)| **covers && **n == 1)
            .count()
    }

    /// The share of what may still be missed that goes with the region; above 1 it has to stay.
    fn price(&self, region_idx: usize) -> f64 {
        match (self.loss(region_idx), self.n_allowed - self.n_missed) {
            (0, _) => 0.0,
            (loss, left) => loss as f64 / left as f64,
        }
    }

    fn drop(&mut self, region_idx: usize) {
        self.n_missed += self.loss(region_idx);
        self.n_covering.iter_mut().zip(&self.covers[region_idx]).for_each(|(n, c)| *n -= usize::from(*c));
    }

    fn restore(&mut self, region_idx: usize) {
        self.n_covering.iter_mut().zip(&self.covers[region_idx]).for_each(|(n, c)| *n += usize::from(*c));
        self.n_missed -= self.loss(region_idx);
    }

    fn misses_too_much(&self) -> bool {
        self.n_missed > self.n_allowed
    }
}

impl<S: Sink> Cover<'_, S> {
    /// Hands over what was found since the last time, without what others cover.
    pub(super) fn hand_over(&mut self, after_certification: bool) -> Result<(), S::Error> {
        if !(self.is_stopped)() {
            self.drop_superfluous(after_certification);
        }
        for region_idx in self.n_handed_over..self.regions.len() {
            self.regions[region_idx].id = region_idx as u64;
            self.sink.region(&self.regions[region_idx])?;
        }
        self.n_handed_over = self.regions.len();
        Ok(())
    }

    fn drop_superfluous(&mut self, after_certification: bool) {
        let n_stay = self.n_handed_over.max(self.n_to_stay);
        let n_new = self.regions.len() - n_stay;
        let first_new = self.covering.len() - n_new;
        if n_new == 0 || self.covering.len() < 2 {
            self.last_samples.clear();
            return;
        }
        let mut tallies = self.tallies(after_certification, false);
        let anchors = self.problem.anchors.iter().map(|anchor| anchor.q.as_slice().to_vec());
        for anchor in anchors {
            tallies.push(Tally::new(&self.covering, &[anchor], 1.0));
        }
        let chords = self.free_chords();
        let wanted_chord =
            self.wanted_chord(after_certification).min(chord_coverage(&chords, &self.covering).share());
        let overlaps = self.overlaps();
        let mut stays = vec![true; self.covering.len()];
        let mut dropped = Vec::new();
        let mut is_fixed: Vec<bool> = (0..self.covering.len()).map(|idx| idx < first_new).collect();
        loop {
            let price = |idx: usize| tallies.iter().map(|tally| tally.price(idx)).fold(0.0, f64::max);
            let prices =
                (0..stays.len()).filter(|&idx| stays[idx] && !is_fixed[idx]).map(|idx| (price(idx), idx));
            // Of equal prices the last found.
            let cheapest = prices
                .filter(|(price, _)| *price <= 1.0)
                .min_by(|x, y| x.0.total_cmp(&y.0).then(y.1.cmp(&x.1)));
            let Some((_, idx)) = cheapest else { break };
            stays[idx] = false;
            let rest: Vec<HPolyhedron> =
                (0..stays.len()).filter(|&idx| stays[idx]).map(|idx| self.covering[idx].clone()).collect();
            let holds_together = overlaps.iter().all(|overlaps| overlaps.hold_together_without(idx, &stays));
            if holds_together && chord_coverage(&chords, &rest).share() >= wanted_chord {
                tallies.iter_mut().for_each(|tally| tally.drop(idx));
                dropped.push(idx);
            } else {
                stays[idx] = true;
                is_fixed[idx] = true;
            }
        }
        // The choice is the best for its own samples: on others it must hold as well, or the dearest come back.
        let mut tallies = self.tallies(after_certification, true);
        for &idx in &dropped {
            tallies.iter_mut().for_each(|tally| tally.drop(idx));
        }
        while let Some(idx) = dropped.pop().filter(|_| tallies.iter().any(Tally::misses_too_much)) {
            tallies.iter_mut().for_each(|tally| tally.restore(idx));
            stays[idx] = true;
        }
        let mut position = 0..self.covering.len();
        self.covering.retain(|_| position.next().is_none_or(|idx| stays[idx]));
        let mut position = 0..self.regions.len();
        self.regions
            .retain(|_| position.next().is_none_or(|idx| idx < n_stay || stays[first_new + idx - n_stay]));
    }

    /// A tally of each set. The samples of the one that `is_check` may serve again.
    fn tallies(&mut self, after_certification: bool, is_check: bool) -> Vec<Tally> {
        let (mut tallies, mut used) = (Vec::new(), Vec::new());
        for target_idx in 0..self.targets.len() {
            let samples = self.samples_of(target_idx);
            let aim = self.aim(self.targets[target_idx].0.kind, after_certification);
            tallies.push(Tally::new(&self.covering, &samples, aim));
            used.push(samples);
        }
        if self.is_thrifty && is_check {
            self.last_samples = used;
        }
        tallies
    }

    /// The overlaps in CS, in CG, and in CP where it is not all of CS.
    fn overlaps(&self) -> Vec<Overlaps> {
        let thin = self.targets.iter().map(|(target, _)| target);
        let thin = thin.filter(|target| matches!(target.kind, TargetKind::Grasp | TargetKind::Placement));
        let spaces = thin.map(|target| Overlaps::new(&self.covering, Some(&target.polyhedron)));
        std::iter::once(Overlaps::new(&self.covering, None)).chain(spaces).collect()
    }
}

/// Which regions overlap inside a set.
struct Overlaps {
    adjacent: Vec<Vec<usize>>,
    /// Whether a region that overlaps no other may go.
    alone_may_go: bool,
}

impl Overlaps {
    fn new(regions: &[HPolyhedron], within: Option<&HPolyhedron>) -> Self {
        let inside =
            |region: &HPolyhedron| within.map_or_else(|| region.clone(), |set| region.intersection(set));
        let regions: Vec<HPolyhedron> = regions.iter().map(inside).collect();
        let mut adjacent = vec![Vec::new(); regions.len()];
        for i in 0..regions.len() {
            for j in 0..i {
                if regions[i].interior_intersects(&regions[j]) {
                    adjacent[i].push(j);
                    adjacent[j].push(i);
                }
            }
        }
        Self { adjacent, alone_may_go: within.is_some() }
    }

    /// Whether the neighbours of region `idx` among those that stay reach each other without it.
    fn hold_together_without(&self, idx: usize, stays: &[bool]) -> bool {
        let neighbors: Vec<usize> =
            self.adjacent[idx].iter().copied().filter(|&other| stays[other]).collect();
        let Some(&first) = neighbors.first() else { return self.alone_may_go };
        let mut reached = vec![false; stays.len()];
        reached[first] = true;
        let mut open = vec![first];
        while let Some(at) = open.pop() {
            for &other in self.adjacent[at].iter().filter(|&&other| stays[other]) {
                if !reached[other] {
                    reached[other] = true;
                    open.push(other);
                }
            }
        }
        neighbors.iter().all(|&neighbor| reached[neighbor])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn interval(low: f64, high: f64) -> HPolyhedron {
        HPolyhedron::from_box(&DVector::from_vec(vec![low]), &DVector::from_vec(vec![high]))
    }

    #[test]
    fn the_middle_of_a_chain_holds_it_together_unless_there_is_another() {
        let chain = [interval(0.0, 1.0), interval(0.9, 2.0), interval(1.9, 3.0)];
        let stays = |gone: usize, n: usize| (0..n).map(|idx| idx != gone).collect::<Vec<bool>>();
        let overlaps = Overlaps::new(&chain, None);
        assert!(!overlaps.hold_together_without(1, &stays(1, 3)));
        assert!(overlaps.hold_together_without(0, &stays(0, 3)));
        let twice = [chain.as_slice(), &[interval(0.5, 2.5)]].concat();
        let overlaps = Overlaps::new(&twice, None);
        assert!(overlaps.hold_together_without(1, &stays(1, 4)));
        // Inside a smaller set the other one does not reach.
        let overlaps = Overlaps::new(&twice, Some(&interval(0.95, 3.0)));
        assert!(overlaps.hold_together_without(1, &stays(1, 4)));
        let overlaps = Overlaps::new(&[interval(0.0, 1.0), interval(2.0, 3.0)], None);
        assert!(!overlaps.hold_together_without(1, &stays(1, 2)), "a component of its own stays");
    }

    #[test]
    fn a_tally_counts_what_only_one_region_covers() {
        let samples: Vec<Vec<f64>> = (0..1000).map(|i| vec![f64::from(i) * 1e-3]).collect();
        let regions = [interval(0.0, 0.5), interval(0.4, 1.0), interval(0.45, 0.55)];
        let mut tally = Tally::new(&regions, &samples, 0.9);
        assert_eq!((tally.loss(0), tally.loss(1), tally.loss(2)), (400, 449, 0));
        assert_eq!(tally.price(2), 0.0);
        assert!(tally.price(0) > 1.0, "{}", tally.price(0));
        tally.drop(2);
        assert_eq!((tally.n_missed, tally.loss(1)), (0, 499));
        tally.drop(0);
        assert!(tally.n_missed == 400 && tally.misses_too_much());
        tally.restore(0);
        assert!(tally.n_missed == 0 && tally.loss(0) == 400 && !tally.misses_too_much());
        // Where nothing may be missed, only what costs nothing may go.
        let strict = Tally::new(&regions, &samples[..3], 1.0);
        assert!(strict.price(0) > 1.0 && strict.price(1) == 0.0);
    }
}
