//! What stages say: questions, candidates, parts, progress.

use super::Run;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::StageProgress;
use crate::pipeline::slot::Part;
use ipc_types::Digest;
use ipc_types::artefact::Region;
use ipc_types::channel::WaitingStage;
use ipc_types::container::CertifiedPart;
use ipc_types::join::read_part;
use ipc_types::message::{self, MessageError, NO_ID, Question};
use ipc_types::stage_name::StageName;

impl Run<'_> {
    pub(super) fn hear(&mut self) -> Result<(), Failure> {
        for stage in StageName::ALL {
            for question in self.hub.questions(stage)? {
                self.hear_question(stage, question)?;
            }
        }
        if let Some(digest) = self.scene_digest {
            for (id, region) in self.hub.candidates(&digest)? {
                self.take_candidate(id, region)?;
            }
        }
        for worker in self.hub.workers()? {
            let request = *worker.payload();
            self.check_scene(StageName::Certify, request.protocol_version, &request.scene_digest)?;
            if request.finished_candidate != NO_ID {
                self.take_part(request.worker, request.finished_candidate)?;
            }
            self.waiting_workers.push(worker);
        }
        let announced = self.hub.announced()?;
        if !announced.segments.is_empty() {
            let newest = self.newest.entry(StageName::Gcs).or_default();
            newest.done += announced.segments.len() as u64;
            newest.value += announced.segments.iter().map(|segment| segment.1).sum::<f64>();
        }
        for record in self.hub.progress()? {
            if let Some(stage) =
                StageName::from_number(record.stage).filter(|stage| *stage != StageName::Certify)
            {
                let progress = StageProgress {
                    stage: Some(stage),
                    done: record.done,
                    total: record.total,
                    value: record.value,
                    message: record.words(),
                    finished: false,
                };
                self.newest.insert(stage, progress);
            }
        }
        Ok(())
    }

    pub(super) fn hear_question(&mut self, stage: StageName, question: WaitingStage) -> Result<(), Failure> {
        let header = *question.user_header();
        self.check_scene(stage, header.protocol_version, &header.scene_digest)?;
        let slot = self.slot(stage);
        match Question::from_number(header.question) {
            Some(Question::Ready) => {
                if slot.part == Part::Files {
                    // It speaks over channels: from now on it is asked there, and the job it was started for is its first.
                    slot.part = Part::Channels;
                    slot.n_working = 0;
                    slot.wanted = true;
                }
                slot.waiting.push(question);
            }
            Some(Question::Finished) => {
                slot.job_ends(ExitCode::from_code(header.exit_code));
                slot.waiting.push(question);
                let worker = header.worker;
                match ExitCode::from_code(header.exit_code) {
                    ExitCode::BadInput => return Err(Failure::bad_input(self.reason(stage, worker))),
                    ExitCode::Failed => {
                        let log = self.log(stage, worker);
                        let words = self.reason(stage, worker);
                        return Err(Failure::stage_failed(format!(
                            "stage {stage} failed: {words}; log: {}",
                            log.display()
                        )));
                    }
                    _ => {}
                }
            }
            Some(Question::Certified) => {
                let ids = question.payload().to_vec();
                for id in &ids {
                    if !self.queue.knows(*id) {
                        // The channel lost it: it is on disk.
                        self.take_candidate(*id, None)?;
                    }
                }
                self.feedback = Some((question, ids));
            }
            None => {
                return Err(Failure::stage_failed(format!(
                    "stage {stage} asked an unknown question {}",
                    header.question
                )));
            }
        }
        Ok(())
    }

    /// All processes must speak the same protocol and have read the same scene.
    pub(super) fn check_scene(
        &mut self,
        stage: StageName,
        version: u32,
        digest: &Digest,
    ) -> Result<(), Failure> {
        let expected = *self.scene_digest.get_or_insert(*digest);
        message::check(version, digest, &expected).map_err(|error| match error {
            MessageError::ForeignScene { .. } => Failure::bad_input(format!("stage {stage}: {error}")),
            _ => Failure::stage_failed(format!("stage {stage}: {error}")),
        })
    }

    pub(super) fn take_candidate(&mut self, id: u64, region: Option<Region>) -> Result<(), Failure> {
        let region = match region {
            Some(region) => region,
            None => read_part(&self.folder(StageName::Decompose), id, self.scene_digest.as_ref())
                .map_err(|error| Failure::stage_failed(format!("stage decompose: {error}")))?,
        };
        self.queue.add(region).map_err(|words| Failure::stage_failed(format!("stage decompose: {words}")))
    }

    pub(super) fn take_part(&mut self, worker: u32, candidate: u64) -> Result<(), Failure> {
        if self.queue.of_worker(worker) != Some(candidate) {
            return Err(Failure::stage_failed(format!(
                "stage certify: worker {worker} says that it finished candidate {candidate}, which it was not given"
            )));
        }
        let part: CertifiedPart =
            read_part(&self.folder(StageName::Certify), candidate, self.scene_digest.as_ref())
                .map_err(|error| Failure::stage_failed(format!("stage certify: {error}")))?;
        self.queue.finish(worker, part);
        Ok(())
    }
}
