//! What a stage sees of the world: where its outputs go, what it may ask for, whether to stop.

use crate::output::Output;
use crate::process::{Stop, StopFlag};
use crate::stage::StageError;
use ipc_types::artefact::{Coverage, LeafCut, PlanFile, ProofFile, Region, Segment};
use ipc_types::container::CertifiedPart;
use ipc_types::join::write_part;
use ipc_types::{Digest, validate};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Newest state of the work, as users see it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress<'a> {
    pub done: u64,
    pub total: u64,
    pub value: f64,
    pub message: &'a str,
}

/// What carries questions, answers and announcements: files or channels. Every output is on disk before it is
/// announced.
pub(crate) trait Carrier {
    /// The next candidate to certify; `None`: no more will come.
    fn next_candidate(&mut self) -> Result<Option<Region>, StageError>;
    /// Certified versions of the candidates; `None`: not to be had.
    fn certified_versions(&mut self, candidates: &[&Region]) -> Result<Option<Vec<Region>>, StageError>;
    /// An output is on disk.
    fn announce(&mut self, announcement: Announcement<'_>) -> Result<(), StageError>;
    /// Newest state of the work.
    fn progress(&mut self, progress: Progress<'_>);
    /// Whether other processes take candidates from the same queue.
    fn shares_work(&self) -> bool {
        false
    }
}

/// An output that is on disk.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Announcement<'a> {
    Candidate(&'a Region),
    Certified(&'a CertifiedPart),
    Plan(&'a PlanFile),
    Segment { segment_idx: u64, segment: &'a Segment },
    Cut(&'a LeafCut),
}

/// What a stage sees of the world.
pub struct Host<'a> {
    carrier: &'a mut dyn Carrier,
    stop: StopFlag,
    folder: PathBuf,
    scene_digest: Digest,
    dim: usize,
    pub(crate) output: Output,
}

impl<'a> Host<'a> {
    pub(crate) fn new(
        carrier: &'a mut dyn Carrier,
        stop: StopFlag,
        folder: &Path,
        scene_digest: Digest,
        dim: usize,
    ) -> Host<'a> {
        Host { carrier, stop, folder: folder.to_owned(), scene_digest, dim, output: Output::default() }
    }

    /// Tells whether to stop; may be handed to other threads.
    pub fn stop_flag(&self) -> StopFlag {
        self.stop.clone()
    }

    /// Why to stop, if so. Ask now and then, at least ten times a second.
    pub fn stop_reason(&self) -> Option<Stop> {
        self.stop.reason()
    }

    /// `Err(StageError::Stopped)` if it is time to stop.
    pub fn check_stop(&self) -> Result<(), StageError> {
        if self.stop.is_set() { Err(StageError::Stopped) } else { Ok(()) }
    }

    /// Newest state of the work: units `done` of `total` (0: not known), the figure that matters (coverage, gap,
    /// length), and a few words.
    pub fn progress(&mut self, done: u64, total: u64, value: f64, message: &str) {
        self.carrier.progress(Progress { done, total, value, message });
    }

    /// decompose: a candidate region.
    pub fn candidate(&mut self, region: Region) -> Result<(), StageError> {
        self.check_region(&region)?;
        if self.output.candidates.contains_key(&region.id) {
            return Err(StageError::Failed(format!("two candidate regions have id {}", region.id)));
        }
        write_part(&self.folder, region.id, &region, &self.scene_digest).map_err(StageError::failed)?;
        self.carrier.announce(Announcement::Candidate(&region))?;
        self.output.candidates.insert(region.id, region);
        Ok(())
    }

    /// decompose: what certification made of these candidates, which were handed over before: the certified regions,
    /// sorted by id, each naming its candidate as parent. Waits for them. `None` if there is no certification, or
    /// none whose result is known (a stage alone without the files of an earlier run).
    pub fn certified_versions(&mut self, candidate_ids: &[u64]) -> Result<Option<Vec<Region>>, StageError> {
        let mut candidates = Vec::with_capacity(candidate_ids.len());
        for id in candidate_ids {
            candidates.push(self.output.candidates.get(id).ok_or_else(|| {
                StageError::Failed(format!("candidate {id} was asked about before it was handed over"))
            })?);
        }
        self.carrier.certified_versions(&candidates)
    }

    /// decompose: measured coverage of the candidates. The last call counts.
    pub fn coverage(&mut self, coverage: Coverage) {
        self.output.coverage = Some(coverage);
    }

    /// certify: the next candidate; `None` when there is no more work.
    pub fn next_candidate(&mut self) -> Result<Option<Region>, StageError> {
        self.check_stop()?;
        self.carrier.next_candidate()
    }

    /// certify: whether other processes take candidates from the same queue, so that none should be taken ahead.
    pub fn shares_work(&self) -> bool {
        self.carrier.shares_work()
    }

    /// certify: what became of one candidate.
    pub fn certified(&mut self, mut part: CertifiedPart) -> Result<(), StageError> {
        part.regions.sort_by_key(|region| region.id);
        for region in &part.regions {
            self.check_region(region)?;
            if region.parent != Some(part.candidate_id) {
                return Err(StageError::Failed(format!(
                    "region {}: its parent is not candidate {}",
                    region.id, part.candidate_id
                )));
            }
        }
        write_part(&self.folder, part.candidate_id, &part, &self.scene_digest).map_err(StageError::failed)?;
        self.carrier.announce(Announcement::Certified(&part))?;
        self.output.certified.insert(part.candidate_id, part);
        Ok(())
    }

    /// miqp: the plan, once, and its proof; also of an infeasible task.
    pub fn plan(&mut self, plan: PlanFile, proof: Option<ProofFile>) -> Result<(), StageError> {
        validate::plan(&plan, self.dim)
            .map_err(|rule| StageError::Failed(format!("the plan is not well formed: {rule}")))?;
        self.output.plan = Some(plan);
        self.output.proof = proof;
        Ok(())
    }

    /// gcs: the path between configurations `segment_idx` and `segment_idx + 1` of the plan.
    pub fn segment(&mut self, segment_idx: usize, segment: Segment) -> Result<(), StageError> {
        validate::segment(&segment, self.dim).map_err(|rule| {
            StageError::Failed(format!("segment {segment_idx} is not well formed: {rule}"))
        })?;
        let segment_idx = segment_idx as u64;
        write_part(&self.folder, segment_idx, &segment, &self.scene_digest).map_err(StageError::failed)?;
        self.carrier.announce(Announcement::Segment { segment_idx, segment: &segment })?;
        self.output.segments.insert(segment_idx, segment);
        Ok(())
    }

    /// gcs: a cut that excludes a segment that has no path in its leaf.
    pub fn cut(&mut self, cut: LeafCut) -> Result<(), StageError> {
        if !self.output.cuts.contains(&cut) {
            self.carrier.announce(Announcement::Cut(&cut))?;
            self.output.cuts.push(cut);
        }
        Ok(())
    }

    /// Counts programmes that solvers were given, for `status.json`.
    pub fn solver_calls(&mut self, n_calls: u64) {
        self.output.solver_calls += n_calls;
    }

    /// Something that only this stage has to say, for `status.json`.
    pub fn detail(&mut self, key: &str, value: impl Serialize) {
        if let Ok(value) = serde_json::to_value(value) {
            self.output.details.insert(key.to_owned(), value);
        }
    }

    /// The announcement of outputs that are on disk only after the end of the work.
    pub(crate) fn announce_plan(&mut self) -> Result<(), StageError> {
        match &self.output.plan {
            Some(plan) => self.carrier.announce(Announcement::Plan(plan)),
            None => Ok(()),
        }
    }

    fn check_region(&self, region: &Region) -> Result<(), StageError> {
        validate::region(region, self.dim)
            .map_err(|rule| StageError::Failed(format!("region {} is not well formed: {rule}", region.id)))
    }
}
