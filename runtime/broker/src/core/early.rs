//! Reading before anybody is there who judges: a run of `check` reads its files while its bundles start.

use qcbus_messages::JobId;

use super::types::{PrepareFailure, PreparedJob};
use super::{Actions, Phase, State};

/// What came of reading a file.
pub(super) type ReadingEnd = Result<Box<PreparedJob>, PrepareFailure>;

impl State {
    /// A file was read.
    pub(super) fn was_read(&mut self, job: JobId, result: ReadingEnd, actions: &mut Actions) {
        if self.settings.once && !self.has_judges() {
            self.read_early.push((job, result));
        } else {
            self.prepared(job, result, actions);
        }
    }

    /// Whether all are there, or were, who judge.
    fn has_judges(&mut self) -> bool {
        self.may_judge() || self.judged_once
    }

    /// Whether files are read already although nobody can judge them yet: a run has nothing else to do while its
    /// bundles start. What is read is not looked at before they are there, for who they are decides what becomes of it.
    pub(super) fn reads_early(&mut self) -> bool {
        self.settings.once && self.phase == Phase::Running && !self.has_judges()
    }

    pub(super) fn hear_what_was_read_early(&mut self, actions: &mut Actions) {
        if self.read_early.is_empty() || self.reads_early() {
            return;
        }
        for (job, result) in std::mem::take(&mut self.read_early) {
            if self.judged_once {
                self.prepared(job, result, actions);
            } else {
                // The run is to end: nobody will come any more.
                self.preparing -= 1;
                self.end_job(job, actions);
            }
        }
    }
}
