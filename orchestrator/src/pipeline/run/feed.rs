//! What is given out: jobs, regions to certify, answers to decompose.

use super::Run;
use crate::failure::Failure;
use crate::pipeline::slot::Part;
use ipc_types::message::Reply;
use ipc_types::stage_name::StageName;

impl Run<'_> {
    pub(super) fn feed(&mut self) -> Result<(), Failure> {
        for stage in StageName::ALL {
            let slot = self.slot(stage);
            if slot.wanted && !slot.waiting.is_empty() {
                let (job, waiting) = (slot.job, std::mem::take(&mut slot.waiting));
                // Workers come one by one: the job stays open for those that have not asked yet.
                slot.wanted = stage == StageName::Certify;
                for question in waiting {
                    self.slot(stage).job_begins();
                    self.hub.answer(stage, &question, Reply::Job, job, &[])?;
                }
            }
        }
        while !self.waiting_workers.is_empty() && !self.queue.nothing_waits() {
            let request = self.waiting_workers.remove(0);
            let worker = request.payload().worker;
            if let (Some(region), Some(digest)) = (self.queue.next(worker), &self.scene_digest) {
                self.hub.answer_worker(&request, Some((region, digest)))?;
            }
        }
        if let Some((question, ids)) = self.feedback.take() {
            if self.slot(StageName::Certify).part != Part::Channels {
                self.hub.answer(StageName::Decompose, &question, Reply::NoCertification, 0, &[])?;
            } else if let Some(certified) = self.queue.certified_of(&ids) {
                self.hub.answer(StageName::Decompose, &question, Reply::Certified, 0, &certified)?;
            } else {
                self.feedback = Some((question, ids));
            }
        }
        Ok(())
    }
}
