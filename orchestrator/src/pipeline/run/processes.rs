//! Processes of the stages: started, and looked at when they have ended.

use super::Run;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::alone::stage_failure;
use crate::pipeline::child::Child;
use crate::pipeline::slot::{Part, Process};
use crate::pipeline::stage_command::{channel_mode, file_mode, stage_request};
use ipc_types::stage_name::StageName;

impl Run<'_> {
    pub(super) fn start_served(&self, stage: StageName, worker: u32) -> Result<Process, Failure> {
        let request = stage_request(self.request, stage, self.directory.path());
        let command = channel_mode(&request, &self.domain.name, worker, &self.log(stage, worker))?;
        Ok(Process { worker, command: command.words(), child: Child::start(&command)?, ended: None })
    }

    /// A job is wanted: served stages get it when they ask, others are started for it.
    pub(super) fn want(&mut self, stage: StageName) -> Result<(), Failure> {
        self.slot(stage).want_job();
        if self.slot(stage).part == Part::Files {
            let request = stage_request(self.request, stage, self.directory.path());
            let mut command = file_mode(&request, &self.log(stage, 0))?;
            command.environment = vec![
                ("REGRASP_DOMAIN", self.domain.name.clone().into()),
                ("REGRASP_RUN", self.directory.path().into()),
            ];
            let process =
                Process { worker: 0, command: command.words(), child: Child::start(&command)?, ended: None };
            let slot = self.slot(stage);
            slot.processes.push(process);
            slot.wanted = false;
            slot.job_begins();
        }
        Ok(())
    }

    /// Deals with processes that have ended.
    pub(super) fn look_at_processes(&mut self) -> Result<(), Failure> {
        for stage in StageName::ALL {
            let slot = self.slot(stage);
            let mut ends = Vec::new();
            for process in &mut slot.processes {
                if process.ended.is_none()
                    && let Some(ended) = process.child.poll()
                {
                    process.ended = Some(ended);
                    ends.push((process.worker, ended));
                }
            }
            for (worker, ended) in ends {
                let (part, told) = (self.slot(stage).part, self.slot(stage).told_to_stop);
                let outcome = if ended.code < 0 { ExitCode::Failed } else { ExitCode::from_code(ended.code) };
                let log = self.log(stage, worker);
                match outcome {
                    ExitCode::BadInput => return Err(bad_input(stage, &self.reason(stage, worker))),
                    _ if told && ended.code >= 0 => {}
                    ExitCode::Failed => {
                        // Its last words may have arrived before it died.
                        return Err(stage_failure(stage, &ended, &self.reason(stage, worker), &log));
                    }
                    _ if part == Part::Files => self.slot(stage).job_ends(outcome),
                    _ => {
                        let words = format!(
                            "stage {stage} {} before it was told to stop; log: {}",
                            ended.words(),
                            log.display()
                        );
                        return Err(Failure::stage_failed(words));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Bad input in a stage's words. Of its command line it does not know that the user wrote it elsewhere.
fn bad_input(stage: StageName, words: &str) -> Failure {
    if words.contains("'--") {
        let program = stage.executable();
        return Failure::bad_input(format!(
            "stage {stage}: {words}; `{program} run --help` lists its options"
        ));
    }
    Failure::bad_input(words)
}
