//! Candidates between decompose and the certification workers.

use ipc_types::artefact::Region;
use ipc_types::container::CertifiedPart;
use std::collections::{BTreeMap, VecDeque};

/// Candidates that wait, are being certified, or are done.
#[derive(Debug, Default)]
pub struct WorkQueue {
    candidates: BTreeMap<u64, Region>,
    pending: VecDeque<u64>,
    in_flight: BTreeMap<u32, u64>,
    done: BTreeMap<u64, CertifiedPart>,
}

impl WorkQueue {
    /// Takes in a candidate. One that is known is not taken in again; another one under its id is refused.
    pub fn add(&mut self, region: Region) -> Result<(), String> {
        match self.candidates.get(&region.id) {
            Some(known) if *known == region => Ok(()),
            Some(_) => Err(format!("two different candidate regions have id {}", region.id)),
            None => {
                self.pending.push_back(region.id);
                self.candidates.insert(region.id, region);
                Ok(())
            }
        }
    }

    /// Whether the candidate is known.
    pub fn knows(&self, id: u64) -> bool {
        self.candidates.contains_key(&id)
    }

    /// The next candidate, for this worker.
    pub fn next(&mut self, worker: u32) -> Option<&Region> {
        let id = self.pending.pop_front()?;
        self.in_flight.insert(worker, id);
        self.candidates.get(&id)
    }

    /// The candidate that this worker has.
    pub fn of_worker(&self, worker: u32) -> Option<u64> {
        self.in_flight.get(&worker).copied()
    }

    /// The worker's candidate is done.
    pub fn finish(&mut self, worker: u32, part: CertifiedPart) {
        self.in_flight.remove(&worker);
        self.done.insert(part.candidate_id, part);
    }

    /// Whether nothing waits and nobody works.
    pub fn is_idle(&self) -> bool {
        self.pending.is_empty() && self.in_flight.is_empty()
    }

    /// Whether nothing waits.
    pub fn nothing_waits(&self) -> bool {
        self.pending.is_empty()
    }

    /// Ids of the certified regions of these candidates, sorted; `None` until all of them are done.
    pub fn certified_of(&self, candidates: &[u64]) -> Option<Vec<u64>> {
        let parts: Option<Vec<&CertifiedPart>> = candidates.iter().map(|id| self.done.get(id)).collect();
        let mut ids: Vec<u64> =
            parts?.iter().flat_map(|part| &part.regions).map(|region| region.id).collect();
        ids.sort_unstable();
        Some(ids)
    }

    /// Candidates known.
    pub fn n_known(&self) -> u64 {
        self.candidates.len() as u64
    }

    /// Candidates done.
    pub fn n_done(&self) -> u64 {
        self.done.len() as u64
    }

    /// Regions certified.
    pub fn n_certified(&self) -> u64 {
        self.done.values().map(|part| part.regions.len() as u64).sum()
    }

    /// What became of the candidates.
    pub fn parts(&self) -> impl Iterator<Item = &CertifiedPart> {
        self.done.values()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(id: u64) -> Region {
        Region {
            id,
            parent: None,
            A: vec![vec![1.0], vec![-1.0]],
            b: vec![1.0, 1.0],
            center: vec![0.0],
            method: "box".into(),
            certified: false,
            margin: 0.0,
        }
    }

    fn part(candidate_id: u64, ids: &[u64]) -> CertifiedPart {
        let regions = ids.iter().map(|id| region(*id)).collect();
        CertifiedPart { candidate_id, regions, certificates: Vec::new(), reason: String::new() }
    }

    #[test]
    fn a_round_is_answered_when_all_of_it_is_done() {
        let mut queue = WorkQueue::default();
        queue.add(region(1)).unwrap();
        queue.add(region(2)).unwrap();
        assert_eq!(queue.next(7).map(|r| r.id), Some(1));
        assert_eq!(queue.next(8).map(|r| r.id), Some(2));
        assert!(queue.next(9).is_none() && !queue.is_idle());
        queue.finish(8, part(2, &[30]));
        assert_eq!(queue.certified_of(&[1, 2]), None);
        queue.finish(7, part(1, &[]));
        assert_eq!(queue.certified_of(&[1, 2]), Some(vec![30]));
        assert!(queue.is_idle());
    }

    #[test]
    fn a_candidate_is_taken_once() {
        let mut queue = WorkQueue::default();
        queue.add(region(1)).unwrap();
        queue.add(region(1)).unwrap();
        assert_eq!(queue.n_known(), 1);
        assert!(queue.add(Region { margin: 1.0, ..region(1) }).is_err());
    }
}
