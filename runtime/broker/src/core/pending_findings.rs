//! What bundles have said about jobs that are not stored yet, and how much of it there may be.

use std::sync::Arc;

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Metadata, Param};
use qcbus_messages::{CheckerEnd, JobId};

use super::State;
use super::bundles::Bundle;
use super::jobs::{ActiveJob, JobStage, Task, TaskState};
use super::outcome::{clip, clip_text, facts_weight, weight};

/// More checkers need not be named as those in the way of one.
const MOST_IN_THE_WAY: usize = 64;
/// Bytes of the identifier of a checker that is in the way.
const MOST_OF_AN_ID: usize = 512;

/// What one checker has said so far.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pending {
    /// Its findings.
    pub issues: Vec<Issue>,
    /// How many more there are than may be kept.
    pub withheld: u64,
    /// Bytes that what it said of its end takes of its share's.
    pub done_bytes: usize,
    /// How it ended, its parameters and metadata.
    pub done: Option<(Ending, Vec<Param>, Vec<Metadata>)>,
}

/// Which jobs there is room for among the findings that are kept.
#[derive(Debug, Clone, Copy)]
pub(super) enum Room {
    /// Any.
    Free,
    /// Only the oldest, if there is one. It must come to an end for room to come free, and jobs
    /// that wait for each other's bundles would otherwise wait for ever.
    Full(Option<JobId>),
}

impl State {
    /// While findings take up all the room that they may have, younger jobs stay queued.
    pub(super) fn room_for_findings(&self) -> Room {
        // A trial is kept to what one bundle may say of one file, and holds up nobody.
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

    /// A batch of findings; kept aside until the bundle says that it is done.
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

    /// One checker has ended.
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
        // What it says of its end a second time is said in the place of the first.
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

/// Bytes of what a checker says of its end, besides facts: nothing where there is nothing to say.
fn ending_weight(ending: &Ending) -> usize {
    let by = match ending {
        Ending::Blocked { by, .. } => by.iter().map(|id| 24 + id.len()).sum(),
        _ => 0,
    };
    by + ending.reason().len()
}

/// Why a checker failed that has more to say of its run than is kept. As with findings: whoever says
/// more than can be kept has not answered.
fn said_too_much(facts: usize, max_facts: usize, max_bytes: usize) -> String {
    format!(
        "more than is kept of what it says beside its findings: its parameters and metadata take \
         {facts} bytes; {max_facts} of a checker, and {max_bytes} of all that a bundle says about a \
         file, are kept"
    )
}

impl Bundle {
    /// Takes the next job from the queues and says whether it is a suspect, to be tried alone.
    /// Suspects come first.
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
