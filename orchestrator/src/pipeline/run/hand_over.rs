//! From stage to stage: what one has finished becomes the job of the next.

use super::{Ending, Run, interrupted};
use crate::cli::CertifyMethod;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::alone::{accept, digest_of};
use crate::pipeline::certified::{write_joined, write_uncertified};
use crate::pipeline::slot::Part;
use crate::run_record::{Acceptance, Asked};
use ipc_types::artefact::{CutsFile, PlanFile, RegionsFile};
use ipc_types::stage_name::StageName;
use ipc_types::store::{find_artefact, read_artefact};

impl Run<'_> {
    pub(super) fn advance(&mut self) -> Result<Option<Ending>, Failure> {
        if self.slot(StageName::Decompose).is_done()
            && self.candidates.is_none()
            && let Some(ending) = self.decompose_is_done()?
        {
            return Ok(Some(ending));
        }
        if self.candidates.is_some() && self.slot(StageName::Miqp).job == 0 && self.certify_is_done()? {
            self.finished(StageName::Certify);
            if self.request.asked == Asked::Regions {
                return self.regions_are_done().map(Some);
            }
            self.want(StageName::Miqp)?;
        }
        if self.slot(StageName::Miqp).is_done()
            && self.slot(StageName::Gcs).job < self.slot(StageName::Miqp).job
        {
            match self.slot(StageName::Miqp).outcome {
                Some(ExitCode::Negative) => {
                    return Ok(Some(Ending::Early(ExitCode::Negative, self.reason(StageName::Miqp, 0))));
                }
                Some(ExitCode::Limit) => {
                    let words = self.reason(StageName::Miqp, 0);
                    if !self.has_plan()? {
                        return Ok(Some(Ending::Early(ExitCode::Limit, words)));
                    }
                    self.limits = vec![words];
                }
                Some(ExitCode::Interrupted) => return Ok(Some(interrupted())),
                _ => self.limits.clear(),
            }
            self.newest.remove(&StageName::Gcs);
            self.want(StageName::Gcs)?;
        }
        if self.slot(StageName::Gcs).is_done()
            && self.slot(StageName::Gcs).job == self.slot(StageName::Miqp).job
        {
            return match self.slot(StageName::Gcs).outcome {
                Some(ExitCode::Done) => Ok(Some(Ending::Paths)),
                Some(ExitCode::Negative) => {
                    self.cut_again()?;
                    Ok(None)
                }
                Some(ExitCode::Interrupted) => Ok(Some(interrupted())),
                _ => Ok(Some(Ending::Early(ExitCode::Limit, self.reason(StageName::Gcs, 0)))),
            };
        }
        Ok(None)
    }

    /// Reads decompose's files; what the channel lost is queued now.
    pub(super) fn decompose_is_done(&mut self) -> Result<Option<Ending>, Failure> {
        match self.slot(StageName::Decompose).outcome {
            Some(ExitCode::Negative) => {
                return Ok(Some(Ending::Early(ExitCode::Negative, self.reason(StageName::Decompose, 0))));
            }
            Some(ExitCode::Interrupted) => return Ok(Some(interrupted())),
            _ => {}
        }
        let folder = self.folder(StageName::Decompose);
        let digest = *self.scene_digest.get_or_insert_with(|| digest_of(&folder));
        let file: RegionsFile = read_artefact(&folder, "regions", Some(&digest))
            .map_err(|error| Failure::stage_failed(format!("stage decompose: {error}")))?;
        ipc_types::validate::regions(&file, &file.coordinates)
            .map_err(|rule| Failure::stage_failed(format!("stage decompose: regions: {rule}")))?;
        for region in &file.regions {
            self.take_candidate(region.id, Some(region.clone()))?;
        }
        self.candidates = Some(file);
        self.finished(StageName::Decompose);
        if self.slot(StageName::Certify).part == Part::Files {
            self.want(StageName::Certify)?;
        }
        Ok(None)
    }

    /// Whether `certify/` is complete; completes it if it can be.
    pub(super) fn certify_is_done(&mut self) -> Result<bool, Failure> {
        let Some(coordinates) = self.candidates.as_ref().map(|file| file.coordinates.clone()) else {
            return Ok(false);
        };
        let digest = self.scene_digest.unwrap_or_default();
        let folder = self.directory.path().join(StageName::Certify.word());
        match self.slot(StageName::Certify).part {
            Part::Absent => {
                if let Some(candidates) = &self.candidates {
                    write_uncertified(&folder, candidates, &digest)?;
                }
                Ok(true)
            }
            Part::Files => Ok(self.slot(StageName::Certify).is_done()),
            Part::Channels => {
                if !self.queue.is_idle() || self.queue.n_done() < self.queue.n_known() {
                    return Ok(false);
                }
                // No more work: the workers say good-bye, and those that come late are not given any.
                for worker in std::mem::take(&mut self.waiting_workers) {
                    self.hub.answer_worker(&worker, None)?;
                }
                let slot = self.slot(StageName::Certify);
                slot.wanted = false;
                if slot.n_working > 0 {
                    return Ok(false);
                }
                write_joined(&folder, coordinates, &self.queue, &digest)?;
                self.tell_to_stop(StageName::Certify);
                Ok(true)
            }
        }
    }

    /// How a run ends that was asked for regions only.
    fn regions_are_done(&mut self) -> Result<Ending, Failure> {
        let decompose = self.slot(StageName::Decompose).outcome;
        let said = self.reason(StageName::Decompose, 0);
        let folder = self.folder(StageName::Certify);
        let file: RegionsFile = read_artefact(&folder, "regions", self.scene_digest.as_ref())
            .map_err(|error| Failure::stage_failed(format!("stage certify: {error}")))?;
        let n_candidates = self.candidates.as_ref().map_or(0, |file| file.regions.len());
        let n_certified = file.regions.iter().filter(|region| region.certified).count();
        if n_candidates > 0 && n_certified == 0 && self.request.certify != CertifyMethod::None {
            // A limit of the search is no proof that there is nothing to certify.
            let exit_code = match self.slot(StageName::Certify).outcome {
                Some(ExitCode::Limit) => ExitCode::Limit,
                _ => ExitCode::Negative,
            };
            let why = self.queue.parts().map(|part| &part.reason).find(|reason| !reason.is_empty());
            let why = why.cloned().unwrap_or_else(|| self.reason(StageName::Certify, 0));
            return Ok(Ending::Early(
                exit_code,
                format!("none of {n_candidates} regions is certified: {why}"),
            ));
        }
        let words = match self.request.certify {
            CertifyMethod::None => format!("{said}; none was to be certified"),
            _ => format!("{said}; {n_certified} certified"),
        };
        Ok(Ending::Early(
            if decompose == Some(ExitCode::Limit) { ExitCode::Limit } else { ExitCode::Done },
            words,
        ))
    }

    /// gcs found segments without a path: its cuts go to miqp.
    pub(super) fn cut_again(&mut self) -> Result<(), Failure> {
        let folder = self.folder(StageName::Gcs);
        let cuts: Option<CutsFile> = find_artefact(&folder, "cuts", None)
            .map_err(|error| Failure::stage_failed(format!("stage gcs: {error}")))?;
        let n_cuts = cuts.map_or(0, |file| file.cuts.len());
        if n_cuts <= self.n_cuts {
            return Err(Failure::stage_failed(format!(
                "stage gcs found no path and no new cut: {}; log: {}",
                self.reason(StageName::Gcs, 0),
                self.log(StageName::Gcs, 0).display()
            )));
        }
        self.n_cuts = n_cuts;
        self.want(StageName::Miqp)
    }

    pub(super) fn has_plan(&self) -> Result<bool, Failure> {
        let plan: Option<PlanFile> =
            find_artefact(&self.folder(StageName::Miqp), "plan", self.scene_digest.as_ref())
                .map_err(|error| Failure::stage_failed(format!("stage miqp: {error}")))?;
        Ok(plan.is_some_and(|plan| plan.configurations.is_some()))
    }

    pub(super) fn accept(&mut self) -> Result<Acceptance, Failure> {
        // The copy of what the stages read, if there is one: the original may change at any time.
        let copy = self.directory.scene();
        let scene = if copy.join("scene.toml").is_file() { copy } else { self.request.scene.clone() };
        accept(&scene, self.request.task.as_deref(), self.request.clearance, self.directory, &self.watch)
    }
}
