//! Regions that coverage does not ask for, but paths do: bridges between components, and the ends of the longest
//! chord of a transfer leaf.

use super::{Cover, Sink};
use crate::bridges::{bridge_seeds, components};
use crate::coverage::covered;
use crate::grow::{Grown, GrowthJob};
use crate::leaf_chords::{FreeChord, chord_coverage};
use crate::seed::Seed;
use crate::target::TargetKind;

/// Rounds that look for bridges, and rounds that lengthen the chord.
const MAX_BRIDGE_ROUNDS: usize = 4;
const MAX_CHORD_ROUNDS: usize = 4;
/// Uncovered points around which a bridge is tried in a round.
const N_UNCOVERED: usize = 10;

impl<S: Sink> Cover<'_, S> {
    /// Joins components that see each other, or that an uncovered passage joins.
    pub(super) fn grow_bridges(&mut self) {
        for _ in 0..MAX_BRIDGE_ROUNDS {
            let component = components(&self.covering);
            if component.iter().all(|&c| c == 0) || (self.is_stopped)() {
                break;
            }
            let mut points: Vec<Vec<f64>> =
                self.regions.iter().map(|region| region.center.as_slice().to_vec()).collect();
            let n_samples = self.options.coverage_samples;
            for target_idx in 0..self.targets.len() {
                let rng = &mut self.streams.take();
                points.extend(self.targets[target_idx].0.sample_free(self.problem.free, n_samples, rng).free);
            }
            let whole = self.whole.clone();
            let job = |seed: Seed| GrowthJob { domain: &whole, seed, method: "iris-zo of a bridge" };
            let seeds = bridge_seeds(&whole, &self.covering, &component, &points);
            let jobs: Vec<GrowthJob<'_, '_>> = seeds.into_iter().map(job).collect();
            let mut joined = false;
            for grown in self.grow_once(&jobs) {
                joined |= self.take_in_if_it_joins(&grown);
            }
            // A passage may have too little volume to be seen through by chance, but samples fall into it.
            let mut tried = Vec::new();
            for q in &points {
                if tried.len() >= N_UNCOVERED {
                    break;
                }
                if covered(&self.covering, q) || covered(&tried, q) {
                    continue;
                }
                for grown in self.grow_once(&[job(Seed::ball(whole.u_from_q(q)))]) {
                    joined |= self.take_in_if_it_joins(&grown);
                    tried.push(grown.polyhedron);
                }
            }
            if !joined {
                break;
            }
        }
    }

    /// Grows without alternation: the larger ellipsoid would move out of the passage.
    fn grow_once(&mut self, jobs: &[GrowthJob<'_, '_>]) -> Vec<Grown> {
        let alternating = self.growing.growth;
        self.growing.growth.max_iterations = 1;
        let grown = self.grow(jobs);
        self.growing.growth = alternating;
        grown
    }

    /// Takes a region in if it overlaps two components or more.
    fn take_in_if_it_joins(&mut self, grown: &Grown) -> bool {
        let component = components(&self.covering);
        let mut touched = (0..self.covering.len())
            .filter(|&idx| self.covering[idx].interior_intersects(&grown.polyhedron))
            .map(|idx| component[idx]);
        let first = touched.next();
        let joins =
            touched.any(|other| Some(other) != first) && self.regions.len() < self.options.max_regions;
        if joins {
            self.take_in(grown, &[]);
        }
        joins
    }

    /// Free chords of transfer leaves; fresh ones, unless they are to serve again.
    pub(super) fn free_chords(&mut self) -> Vec<FreeChord> {
        let Some(leaves) = &self.leaves else { return Vec::new() };
        match &self.chords {
            Some(chords) if self.is_thrifty => chords.clone(),
            _ => {
                let known = if self.is_thrifty { self.covering.as_slice() } else { &[] };
                let chords = leaves.free_chords(self.problem, known, &mut self.streams.take());
                self.chords.insert(chords).clone()
            }
        }
    }

    /// Regions in CG at what the longest chord of a transfer leaf lacks.
    pub(super) fn grow_chord(&mut self, wanted: f64) {
        if self.leaves.is_none() {
            return;
        }
        let Some((_, domain)) =
            self.targets.iter().find(|(target, _)| target.kind == TargetKind::Grasp).cloned()
        else {
            return;
        };
        for _ in 0..MAX_CHORD_ROUNDS {
            let chord = chord_coverage(&self.free_chords(), &self.covering);
            if chord.share() >= wanted
                || (self.is_stopped)()
                || self.regions.len() >= self.options.max_regions
            {
                break;
            }
            let jobs: Vec<GrowthJob<'_, '_>> = chord
                .uncovered
                .iter()
                .map(|q| GrowthJob {
                    domain: &domain,
                    seed: Seed::ball(domain.u_from_q(q)),
                    method: "iris-zo in the grasp space",
                })
                .collect();
            self.grow_and_select(&jobs, &chord.uncovered, 1, 0);
        }
    }
}
