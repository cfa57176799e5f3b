//! Pending findings: findings of jobs that are not stored yet, and their limits.

use std::sync::Arc;

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Issue;
use qcbus_messages::{CheckerEnd, JobId};
use qcbus_types::{clip, clip_text, facts_weight, weight};

use super::State;
use super::bundles::Bundle;
use super::jobs::{ActiveJob, JobStage, Task, TaskState};

/// Maximum number of checkers named as blocking another one.
const MOST_IN_THE_WAY: usize = 64;
/// Maximum length in bytes of the identifier of a blocking checker.
const MOST_OF_AN_ID: usize = 512;

/// Room for findings: determines the jobs that may be sent.
#[derive(Debug, Clone, Copy)]
pub(super) enum Room {
    /// Any job may be sent.
    Free,
    /// Only the oldest job, if one exists, may be sent. Room becomes free only when it ends.
    /// Otherwise jobs that wait for each other's bundles would wait forever.
    Full(Option<JobId>),
}

impl State {
    /// Returns the room for findings. While findings occupy all permitted room, younger jobs stay queued.
    pub(super) fn room_for_findings(&self) -> Room {
        // A trial is limited to the findings of one bundle for one file and blocks no other job.
        let counts = |job: &&ActiveJob| !job.is_trial();
        let jobs = self.jobs.values().filter(counts);
        let pending = jobs.flat_map(|job| job.tasks.values());
        let bytes: usize = pending.map(|task| task.pending_bytes).sum();
        if bytes < self.settings.max_findings_bytes {
            return Room::Free;
        }
        let mut under_way = self
            .jobs
            .iter()
            .filter(|(_, job)| job.stage != JobStage::Preparing && counts(job));
        Room::Full(under_way.next().map(|(id, _)| *id))
    }

    /// Adds a batch of findings. They stay pending until the bundle has finished.
    pub(super) fn issues(
        &mut self,
        name: &str,
        id: JobId,
        checker: u32,
        issues: Vec<Issue>,
    ) -> bool {
        let (max_issues, max_bytes, max_text) = (
            self.settings.max_issues,
            self.settings.max_pending_bytes,
            self.settings.max_text,
        );
        let Some(task) = self.sent_task(name, id, checker) else {
            return false;
        };
        for mut issue in issues {
            clip(&mut issue, max_text);
            let size = weight(&issue);
            let full = task.pending_bytes + size > max_bytes;
            let pending = Arc::make_mut(&mut task.pending).entry(checker).or_default();
            if full || pending.issues.len() >= max_issues {
                pending.withheld += 1;
            } else {
                pending.issues.push(issue);
                task.pending_bytes += size;
            }
        }
        true
    }

    /// Handles the end of one checker.
    pub(super) fn checker_done(&mut self, name: &str, id: JobId, end: CheckerEnd) -> bool {
        let CheckerEnd {
            checker,
            mut ending,
            params,
            metadata,
        } = end;
        let (max_text, max_facts, max_bytes) = (
            self.settings.max_text,
            self.settings.max_facts,
            self.settings.max_pending_bytes,
        );
        let Some(task) = self.sent_task(name, id, checker) else {
            return false;
        };
        if let Some(reason) = ending.reason_mut() {
            clip_text(reason, max_text);
        }
        if let Ending::Blocked { by, .. } = &mut ending {
            by.truncate(MOST_IN_THE_WAY);
            by.iter_mut().for_each(|id| clip_text(id, MOST_OF_AN_ID));
            by.shrink_to_fit();
        }
        let pending = Arc::make_mut(&mut task.pending).entry(checker).or_default();
        // A second end of the same checker replaces the first one.
        let others = task.pending_bytes - pending.done_bytes;
        let facts = facts_weight(&params, &metadata);
        let mut done = (ending, params, metadata);
        let mut bytes = facts + ending_weight(&done.0);
        if facts > max_facts || others + bytes > max_bytes {
            let reason = said_too_much(facts, max_facts, max_bytes);
            done = (Ending::Failed { reason }, Vec::new(), Vec::new());
            bytes = 0;
        }
        (pending.done, pending.done_bytes) = (Some(done), bytes);
        task.pending_bytes = others + bytes;
        true
    }

    fn sent_task(&mut self, name: &str, id: JobId, checker: u32) -> Option<&mut Task> {
        let task = self.jobs.get_mut(&id)?.tasks.get_mut(name)?;
        let offered = task.catalogue.as_ref().map_or(0, |it| it.checkers.len());
        let known = usize::try_from(checker).is_ok_and(|index| index < offered);
        (known && matches!(task.state, TaskState::Sent { .. })).then_some(task)
    }
}

/// Returns the bytes of a checker's end without its facts. It is 0 if there is no text.
fn ending_weight(ending: &Ending) -> usize {
    let by = match ending {
        Ending::Blocked { by, .. } => by.iter().map(|id| 24 + id.len()).sum(),
        _ => 0,
    };
    by + ending.reason().len()
}

/// Returns the failure reason of a checker with more facts than can be kept. As with findings, a
/// checker that exceeds the limit has not answered.
fn said_too_much(facts: usize, max_facts: usize, max_bytes: usize) -> String {
    format!(
        "too many parameters and metadata: they take {facts} bytes; at most {max_facts} bytes are kept for a \
         checker, and {max_bytes} bytes for everything that a bundle reports about a file"
    )
}

impl Bundle {
    /// Takes the next job from the queues. Returns whether it is quarantined and must run alone.
    /// Quarantined jobs come first.
    pub(super) fn next_job(&mut self, room: Room) -> Option<(JobId, bool)> {
        let Room::Full(oldest) = room else {
            let quarantined = self.quarantine.pop_front().map(|id| (id, true));
            return quarantined.or_else(|| self.queue.pop().map(|id| (id, false)));
        };
        let oldest = oldest?;
        if let Some(at) = self.quarantine.iter().position(|id| *id == oldest) {
            return self.quarantine.remove(at).map(|id| (id, true));
        }
        self.queue.take(oldest).map(|id| (id, false))
    }
}
