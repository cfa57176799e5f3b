//! Early reading: a `check` run reads its files while its bundles are still starting.

use qcbus_messages::JobId;
use qcbus_types::{PrepareFailure, PreparedJob};

use super::{Actions, Phase, State};

/// Result of reading a file.
pub(super) type ReadingEnd = Result<Box<PreparedJob>, PrepareFailure>;

impl State {
    /// Handles the end of reading a file.
    pub(super) fn was_read(&mut self, job: JobId, result: ReadingEnd, actions: &mut Actions) {
        if self.settings.once && !self.has_judges() {
            self.read_early.push((job, result));
        } else {
            self.prepared(job, result, actions);
        }
    }

    /// Checks whether all required bundles have joined, now or earlier.
    fn has_judges(&mut self) -> bool {
        self.may_judge() || self.judged_once
    }

    /// Checks whether files are read before any bundle can judge them. A run has no other work while its bundles
    /// start. The read data is not evaluated before the bundles have joined, because the result depends on them.
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
                // The run must end, because no bundle will join any more.
                self.preparing -= 1;
                self.end_job(job, actions);
            }
        }
    }
}
