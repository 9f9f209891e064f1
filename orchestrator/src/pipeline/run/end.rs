//! The end of a run: stages are told to stop, and what they leave becomes files and records.

use super::Run;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::alone::GRACE;
use crate::pipeline::certified::{join_statuses, write_joined};
use crate::pipeline::child::{end_all, wait_all};
use crate::pipeline::slot::{Part, Slot};
use crate::pipeline::stage_command::certifies;
use crate::run_record::StageRecord;
use ipc_types::artefact::RegionsFile;
use ipc_types::hexadecimal;
use ipc_types::join::parts_folder;
use ipc_types::message::Reply;
use ipc_types::stage_name::StageName;
use ipc_types::status::Status;
use ipc_types::store::{find_artefact, read_artefact, read_json};

impl Run<'_> {
    pub(super) fn tell_to_stop(&mut self, stage: StageName) {
        let slot = self.slot(stage);
        slot.told_to_stop = true;
        for question in std::mem::take(&mut slot.waiting) {
            // One that cannot be told is ended by a signal.
            let _ = self.hub.answer(stage, &question, Reply::Stop, 0, &[]);
        }
    }

    /// Ends all stages: those that wait are told, those that work are asked by SIGTERM, those that do not listen are
    /// killed.
    pub(super) fn stop_stages(&mut self) {
        for stage in StageName::ALL {
            self.tell_to_stop(stage);
        }
        for worker in std::mem::take(&mut self.waiting_workers) {
            let _ = self.hub.answer_worker(&worker, None);
        }
        self.feedback = None;
        let idle = self.slots.values_mut().filter(|slot| slot.n_working == 0).flat_map(Slot::children);
        wait_all(idle, GRACE);
        end_all(self.slots.values_mut().flat_map(Slot::children), GRACE);
        self.slots.values_mut().for_each(Slot::mark_ended);
    }

    /// What the run directory of a run that was stopped holds, in words.
    pub(super) fn kept(&self) -> String {
        // A file that cannot be read holds nothing that could be used.
        let regions = |stage: StageName| {
            let file = find_artefact::<RegionsFile>(&self.folder(stage), "regions", None).ok().flatten();
            file.map_or_else(Vec::new, |file| file.regions)
        };
        let n_candidates = regions(StageName::Decompose).len();
        let n_certified = regions(StageName::Certify).iter().filter(|region| region.certified).count();
        if n_candidates == 0 {
            return "no region was found yet".to_owned();
        }
        let candidates = match n_candidates {
            1 => "1 candidate is".to_owned(),
            n => format!("{n} candidates are"),
        };
        let plan = if self.has_plan().unwrap_or(false) { "; a plan is kept" } else { "" };
        match certifies(self.request.certify) {
            true => format!("{candidates} kept, {n_certified} of them certified{plan}"),
            false => format!("{candidates} kept, none was to be certified{plan}"),
        }
    }

    /// What the workers left becomes files, also after an interruption.
    pub(super) fn keep_certified(&mut self, interrupted: bool) -> Result<(), Failure> {
        let folder = self.folder(StageName::Certify);
        let slot = self.slot(StageName::Certify);
        let (part, seconds) = (slot.part, slot.worked.as_secs_f64());
        if part != Part::Channels {
            return Ok(());
        }
        let n_workers = self.request.workers.max(1);
        join_statuses(&folder, n_workers, seconds, &self.queue)?;
        if let (true, Some(digest)) = (interrupted && self.slot(StageName::Miqp).job == 0, self.scene_digest)
        {
            let decompose =
                read_artefact::<RegionsFile>(&self.folder(StageName::Decompose), "regions", Some(&digest));
            // Without decompose's file the coordinates have no names; the parts are kept all the same.
            if let Ok(file) = decompose {
                write_joined(&folder, file.coordinates, &self.queue, &digest)?;
            }
        }
        Ok(())
    }

    /// Parts that are joined need not be kept.
    pub(super) fn remove_parts(&self) {
        for stage in StageName::ALL {
            // What cannot be removed does no harm.
            let _ = std::fs::remove_dir_all(parts_folder(&self.folder(stage)));
        }
    }

    pub(super) fn about_scene(&self) -> (Vec<String>, String) {
        let statuses = StageName::ALL.into_iter().filter_map(|stage| {
            read_json::<Status>(&self.folder(stage).join("status.json"))
                .ok()
                .filter(|s| !s.scene_digest.is_empty())
        });
        let digest = self.scene_digest.map_or_else(String::new, |digest| hexadecimal(&digest));
        let pairs = statuses.map(|status| status.excluded_pairs).max_by_key(Vec::len).unwrap_or_default();
        (pairs, digest)
    }

    pub(super) fn records(&mut self) -> Vec<StageRecord> {
        let folder = self.directory.path();
        self.slots
            .values_mut()
            .filter(|slot| !slot.processes.is_empty())
            .map(|slot| {
                // Its own figure, if it gives one: ours counts what this process held when it started the stage.
                let own = read_json::<Status>(&folder.join(slot.stage.word()).join("status.json"));
                let own = own.ok().map(|status| status.peak_bytes).filter(|bytes| *bytes > 0);
                let ended: Vec<_> =
                    slot.processes.iter_mut().filter_map(|process| process.child.poll()).collect();
                StageRecord {
                    stage: slot.stage,
                    command: slot
                        .processes
                        .first()
                        .map_or_else(String::new, |process| process.command.clone()),
                    processes: u32::try_from(slot.processes.len()).unwrap_or(u32::MAX),
                    exit_code: slot.outcome.map_or_else(|| slot.exit_code(), ExitCode::code),
                    seconds: slot.worked.as_secs_f64(),
                    cpu_seconds: ended.iter().map(|ended| ended.cpu_seconds).sum(),
                    peak_bytes: own.or_else(|| ended.iter().map(|ended| ended.peak_bytes).max()).unwrap_or(0),
                    stale: false,
                }
            })
            .collect()
    }
}
