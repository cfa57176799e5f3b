//! Jobs: the way from the queue through reading to the tasks of the bundles.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::{Catalogue, Digest, JobId};
use qcbus_types::{
    Action, Epoch, Input, Judged, Notice, OnDemand, Pending, PrepareFailure, PreparedJob, Reading,
    Requirement, VersionDigest,
};

use super::early::ReadingEnd;
use super::files::{FileId, Priority, Stage};
use super::{Actions, State};

/// Minimum time between two notices about missing room, unreadable files or unwritten results.
pub(super) const NOTICE_PAUSE: Duration = Duration::from_secs(10);

/// Number of files without a place on the bus that are retried in every pause.
const TRIED_AT_ONCE: usize = 8;

/// A job in progress.
#[derive(Debug)]
pub(super) struct ActiveJob {
    pub file: FileId,
    pub path: Arc<Path>,
    pub kind: FileKind,
    pub since: Duration,
    pub stage: JobStage,
    pub prepared: Option<Arc<PreparedJob>>,
    pub unreadable: Option<String>,
    /// Epoch in which the required bundles were fixed.
    pub epoch: Epoch,
    /// Configuration under which it is checked.
    pub config: Digest,
    /// Tasks by bundle name.
    pub tasks: BTreeMap<String, Task>,
    /// The job is an on-demand check, and its outcome is not stored.
    pub on_demand: Option<OnDemand>,
    /// Used while the job is stored: the file was to be judged again. This is restored if no result is stored.
    pub anew: bool,
    /// Its bundles have answered and the job must wait. Only its root document is still on the bus.
    pub is_slim: bool,
}

impl ActiveJob {
    /// Checks whether the job is the trial of a shadow.
    pub fn is_trial(&self) -> bool {
        self.on_demand
            .as_ref()
            .is_some_and(|it| it.request_id.is_trial())
    }
}

/// Stage of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JobStage {
    Preparing,
    Checking,
    /// All tasks are completed. The job waits for a writer, but not before the given time.
    Finished(Duration),
    Storing,
}

impl JobStage {
    /// Checks whether bundles are working on it or have just finished.
    pub fn is_before_storing(self) -> bool {
        matches!(self, JobStage::Checking | JobStage::Finished(_))
    }
}

/// Task of one bundle in a job.
#[derive(Debug)]
pub(super) struct Task {
    pub state: TaskState,
    pub version: String,
    /// Catalogue at the time when the job was sent. `None` for a bundle that was never seen.
    pub catalogue: Option<Arc<Catalogue>>,
    pub version_digest: Option<VersionDigest>,
    pub demanded: Arc<[u32]>,
    /// Uniquely owned until it is handed to a writer thread.
    pub pending: Arc<BTreeMap<u32, Pending>>,
    pub pending_bytes: usize,
    pub micros: u64,
    /// The job was with a bundle that died. From now on it is retried alone, in quarantine.
    pub quarantined: bool,
    /// Number of times that the bundle died with only this job in a new process.
    pub strikes: u8,
    /// The failure means that the bundle was missing, not that it failed on this file.
    pub missing: bool,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum TaskState {
    Queued,
    Sent { alone_and_fresh: bool },
    Done,
    Failed(String),
}

impl Task {
    /// Returns the task for a requirement. If the file cannot be read, the task fails at once. The
    /// broker still waits for a bundle that was never seen.
    pub fn of(requirement: &Requirement, unreadable: Option<&str>) -> Task {
        let why = unreadable.filter(|_| requirement.catalogue.is_some());
        Task {
            state: why.map_or(TaskState::Queued, |why| TaskState::Failed(why.to_owned())),
            version: requirement.version.clone(),
            catalogue: requirement.catalogue.clone(),
            version_digest: requirement.version_digest,
            demanded: requirement.demanded.clone(),
            pending: Arc::default(),
            pending_bytes: 0,
            micros: 0,
            quarantined: false,
            strikes: 0,
            missing: false,
        }
    }

    pub fn is_over(&self) -> bool {
        matches!(self.state, TaskState::Done | TaskState::Failed(_))
    }

    /// Discards the pending findings of a session that has ended.
    pub fn unstage(&mut self) {
        self.pending = Arc::default();
        self.pending_bytes = 0;
    }
}

impl State {
    /// Returns the jobs that were not handed to the writers yet.
    pub(super) fn under_way(&self) -> Vec<JobId> {
        let jobs = self.jobs.iter();
        let under_way = jobs.filter(|(_, job)| job.stage.is_before_storing());
        under_way.map(|(id, _)| *id).collect()
    }

    /// Starts as many jobs as there is room for.
    pub(super) fn pump(&mut self, actions: &mut Actions) {
        if !self.may_judge() && !self.reads_early() {
            return;
        }
        while self.jobs.len() < self.settings.max_active + self.trials.under_way() + self.held_up()
            && self.preparing < self.settings.max_preparing
            && self.documents_active() < self.settings.max_documents
        {
            let Some(id) = self.files.dequeue(self.now) else {
                break;
            };
            self.take(id, actions);
        }
    }

    /// Returns the number of jobs that wait for verdicts they rest on. These verdicts need additional places.
    fn held_up(&self) -> usize {
        let held_up = self.jobs.keys().filter(|id| self.is_held_up(**id));
        held_up.count().min(self.settings.max_active)
    }

    /// Returns the number of documents that bundles read. Jobs that wait for other verdicts do not
    /// count, so that the awaited files have room.
    fn documents_active(&self) -> usize {
        let documents = |job: &ActiveJob| {
            let prepared = job.prepared.as_ref();
            prepared.map_or(1, |it| it.documents.len().max(1))
        };
        let active = self.jobs.values().filter(|job| !job.is_slim);
        active.map(documents).sum()
    }

    /// Starts a job for one file, unless its verdict is still valid.
    pub(super) fn take(&mut self, id: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get(id).filter(|it| it.present) else {
            return;
        };
        if let Some(judged) = &entry.judged {
            let known = judged.inputs.first().and_then(|root| root.content.stamp());
            let same_bytes = !judged.racy && !entry.stale && known == Some(entry.stamp);
            if same_bytes
                && !entry.half_written
                && self.stands(entry.kind, judged)
                && !self.counted_otherwise(judged)
            {
                let judged = judged.clone();
                self.confirm(id, &judged, actions);
                self.verdict_has_come(id, actions);
                self.settle_waits(id, actions);
                return;
            }
        }
        let (path, kind, on_demand) = (entry.path.clone(), entry.kind, entry.on_demand.clone());
        let waited = self.now.saturating_sub(entry.asked);
        let job = self.next_job();
        self.files.set_stage(id, Stage::Active(job));
        if let Some(entry) = self.files.get_mut(id) {
            (entry.stale, entry.touched) = (false, false);
        }
        self.preparing += 1;
        self.jobs.insert(
            job,
            ActiveJob {
                file: id,
                path: path.clone(),
                kind,
                since: self.now,
                stage: JobStage::Preparing,
                prepared: None,
                unreadable: None,
                epoch: self.epoch,
                config: self.config,
                tasks: BTreeMap::new(),
                on_demand,
                anew: false,
                is_slim: false,
            },
        );
        actions.push(Action::Prepare { job, path, waited });
    }

    /// Handles the end of reading.
    pub(super) fn prepared(&mut self, id: JobId, result: ReadingEnd, actions: &mut Actions) {
        if !matches!(self.jobs.get(&id), Some(job) if job.stage == JobStage::Preparing) {
            return;
        }
        self.preparing -= 1;
        match result {
            Ok(prepared) => {
                self.stuck_since = None;
                self.read(id, &Arc::new(*prepared), actions);
            }
            Err(PrepareFailure::Vanished) => {
                let file = self.jobs.get(&id).map(|job| job.file);
                // This comes first, so that the old verdict is not reported. If an event arrived
                // meanwhile, the file may exist again.
                if let Some(entry) = file.and_then(|file| self.files.get_mut(file)) {
                    entry.present &= entry.stale;
                }
                self.end_job(id, actions);
            }
            Err(PrepareFailure::NoRoom(why)) => {
                self.trials_give_way(id, actions);
                // Otherwise every queued file would repeat this notice and displace all others.
                if self.now >= self.mute_room_until {
                    self.mute_room_until = self.now + NOTICE_PAUSE;
                    self.notice(Notice::NoRoom(why.clone()), actions);
                }
                self.wait_for_room(id, &why, self.settings.retry_after, actions);
            }
            Err(PrepareFailure::Busy) => {
                self.trials_give_way(id, actions);
                let why = "the maximum number of documents on the bus is in use";
                let pause = self.settings.busy_pause * self.stand_in_line(id);
                self.wait_for_room(id, why, pause, actions);
            }
            Err(PrepareFailure::Unreadable(reason)) => self.not_read(id, reason, actions),
            Err(PrepareFailure::Moment(reason)) => self.hindered(id, reason, actions),
        }
    }

    /// Handles a temporary failure to read the file. It is retried with growing pauses. After that
    /// its verdict states the failure, and it is retried like any unreadable file.
    fn hindered(&mut self, id: JobId, reason: String, actions: &mut Actions) {
        let file = self.jobs.get(&id).map(|job| job.file);
        let Some(entry) = file.and_then(|file| self.files.get_mut(file)) else {
            return;
        };
        let pause = self.settings.moment_pause * 2_u32.saturating_pow(entry.hindered);
        if pause > self.settings.moment_pause_max {
            return self.not_read(id, reason, actions);
        }
        entry.hindered += 1;
        if self.now >= self.mute_hindered_until {
            self.mute_hindered_until = self.now + NOTICE_PAUSE;
            let what = format!("{reason}; it is retried");
            self.notice(Notice::NotRead(what), actions);
        }
        self.requeue_later(id, pause, actions);
    }

    /// Handles a file that has no room now. It waits as long as other jobs progress, because room will become free.
    /// If no job progresses for long enough, its verdict is undetermined. An existing verdict stays meanwhile.
    fn wait_for_room(&mut self, id: JobId, why: &str, pause: Duration, actions: &mut Actions) {
        let moves = |job: &ActiveJob| job.stage != JobStage::Preparing && job.unreadable.is_none();
        if self.jobs.values().any(moves) {
            self.stuck_since = None;
            return self.requeue_later(id, pause, actions);
        }
        let since = *self.stuck_since.get_or_insert(self.now);
        let limit = self.settings.room_limit;
        if self.now.saturating_sub(since) < limit || self.has_verdict_on_these_bytes(id) {
            return self.requeue_later(id, pause, actions);
        }
        let reason = format!("{why}; no room became free for {} seconds", limit.as_secs());
        self.not_read(id, reason, actions);
    }

    /// Queues the file for the next free place on the bus. Each free place admits one file. Returns the number of
    /// pauses after which the file is retried anyway. It grows with the queue, because each try reads the file.
    fn stand_in_line(&mut self, id: JobId) -> u32 {
        let file = self.jobs.get(&id).map(|job| job.file);
        if let Some((file, entry)) = file.and_then(|id| Some((id, self.files.get_mut(id)?)))
            && !std::mem::replace(&mut entry.in_line, true)
        {
            self.crowded.push_back(file);
        }
        u32::try_from(self.crowded.len() / TRIED_AT_ONCE + 1).unwrap_or(u32::MAX)
    }

    /// Admits one waiting file after a place on the bus has become free.
    pub(super) fn let_one_in(&mut self) {
        while let Some(id) = self.crowded.pop_front() {
            let Some(entry) = self.files.get_mut(id) else {
                continue;
            };
            entry.in_line = false;
            if matches!(entry.stage(), Stage::Waiting(..)) && entry.not_before > self.now {
                entry.not_before = self.now;
                return;
            }
        }
    }

    /// Checks whether the present bytes of the file were read and judged.
    fn has_verdict_on_these_bytes(&self, id: JobId) -> bool {
        let entry = self.jobs.get(&id).and_then(|job| self.files.get(job.file));
        entry
            .filter(|entry| !entry.unpublished)
            .is_some_and(|entry| {
                let judged = entry.judged.as_ref().and_then(|it| it.inputs.first());
                judged.and_then(|root| root.content.stamp()) == Some(entry.stamp)
            })
    }

    /// Handles a file that cannot be read. The existing verdict may already state this.
    fn not_read(&mut self, id: JobId, reason: String, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        if job.on_demand.is_some() {
            return self.send_elsewhere(id, reason, actions);
        }
        let (file, kind) = (job.file, job.kind);
        let entry = self.files.get(file).filter(|entry| !entry.stale);
        let known = entry.and_then(|entry| entry.judged.as_ref());
        let same = known.is_some_and(|it| it.inputs.is_empty() && it.why == [reason.as_str()]);
        if same && known.is_some_and(|judged| self.stands(kind, judged)) {
            return self.end_job(id, actions);
        }
        if let Some(job) = self.jobs.get_mut(&id) {
            job.unreadable = Some(reason);
        }
        self.give_out(id, actions);
    }

    /// Retries unreadable files and parts of files from time to time. The obstacle may have
    /// disappeared without an event.
    pub(super) fn read_again_what_was_unreadable(&mut self) {
        if self.settings.once || self.now < self.next_reading {
            return;
        }
        self.next_reading = self.now + self.settings.read_again_after;
        let unread = |input: &Input| matches!(input.content, Reading::Unread(_));
        let open = |it: &Judged| it.inputs.is_empty() || it.inputs.iter().any(unread);
        let files = self.files.iter();
        let open = files.filter(|(_, it)| it.present && it.judged.as_deref().is_some_and(open));
        let idle = open.filter(|(_, it)| matches!(it.stage(), Stage::Idle));
        let ids: Vec<FileId> = idle.map(|(id, _)| id).collect();
        for id in ids {
            if let Some(entry) = self.files.get_mut(id) {
                entry.stale = true;
            }
            self.files.enqueue(id, Priority::Background, self.now);
        }
    }

    /// Handles a file that was read. Its verdict may be known, the file may have changed meanwhile,
    /// or bundles must check it.
    fn read(&mut self, id: JobId, prepared: &Arc<PreparedJob>, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        job.prepared = Some(prepared.clone());
        let (file, kind) = (job.file, job.kind);
        let Some(entry) = self.files.get_mut(file) else {
            return;
        };
        if let Some((stamp, _)) = prepared.root() {
            entry.stamp = stamp;
        }
        entry.hindered = 0;
        entry.stale |= entry.touched && prepared.racy;
        if entry.stale || !entry.present {
            self.end_job(id, actions);
            return;
        }
        let (old, anew) = (entry.judged.clone(), entry.anew || entry.half_written);
        if let Some(on_demand) = &entry.on_demand {
            return match self.on_demand_checks.contains_key(&on_demand.request_id) {
                true => self.give_out(id, actions),
                false => self.end_job(id, actions),
            };
        }
        self.depend(file, prepared, actions);
        self.judge_what_is_under(prepared, actions);
        let as_now = |judged: &Judged| self.rests_on_the_same(judged, prepared);
        let same = |judged: &Judged| judged.basis == prepared.basis && !anew && as_now(judged);
        match old {
            Some(judged)
                if same(&judged)
                    && self.stands(kind, &judged)
                    && !self.counted_otherwise(&judged) =>
            {
                self.restamp(file, &judged, prepared, actions);
                self.end_job(id, actions);
            }
            _ => self.give_out(id, actions),
        }
    }

    /// Records the new stamp of unchanged bytes.
    fn restamp(
        &mut self,
        file: FileId,
        judged: &Judged,
        prepared: &PreparedJob,
        actions: &mut Actions,
    ) {
        let mut judged = judged.clone();
        judged.inputs.clone_from(&prepared.inputs);
        judged.racy = prepared.racy;
        let judged = Arc::new(judged);
        if let Some(entry) = self.files.get_mut(file) {
            entry.judged = Some(judged.clone());
            let path = entry.path.clone();
            actions.push(Action::Restamp {
                path,
                judged: judged.clone(),
            });
            self.confirm(file, &judged, actions);
        }
    }

    /// Confirms that a verdict is still valid.
    fn confirm(&mut self, file: FileId, judged: &Arc<Judged>, actions: &mut Actions) {
        let Some(entry) = self.files.get_mut(file) else {
            return;
        };
        let path = entry.path.clone();
        if std::mem::take(&mut entry.unpublished) {
            entry.opening += 1;
            let (path, judged) = (path.clone(), judged.clone());
            actions.push(Action::OpenGate { path, judged });
        }
        actions.push(Action::Judged {
            path,
            judged: judged.clone(),
            fresh: false,
        });
        self.counts_for_others(file, judged);
    }

    fn depend(&mut self, file: FileId, prepared: &PreparedJob, actions: &mut Actions) {
        let inputs = &prepared.inputs;
        let others = inputs.iter().skip(1);
        let new: Vec<Arc<Path>> = others.map(|input| input.path.clone()).collect();
        // The link to a file was read, but the verdict belongs to the file itself.
        let under = prepared.rests_on.iter().map(|it| it.path.clone());
        self.files
            .set_dependencies(file, new.iter().cloned().chain(under).collect());
        self.forget_dependencies(actions);
        if !new.is_empty() {
            let stamps = inputs.iter().skip(1);
            let stamps = stamps.map(|it| it.content.stamp());
            let files = new.into_iter().zip(stamps).collect();
            actions.push(Action::Depend { files });
        }
    }

    /// Stops watching paths that no verdict depends on any more.
    pub(super) fn forget_dependencies(&mut self, actions: &mut Actions) {
        let paths = self.files.take_forgotten();
        if !paths.is_empty() {
            actions.push(Action::Undepend { paths });
        }
    }

    /// Retries the file after a pause.
    fn requeue_later(&mut self, id: JobId, pause: Duration, actions: &mut Actions) {
        let Some(file) = self.jobs.get(&id).map(|job| job.file) else {
            return;
        };
        if let Some(entry) = self.files.get_mut(file) {
            entry.stale = true;
            entry.not_before = self.now + pause;
        }
        self.end_job(id, actions);
    }

    fn next_job(&mut self) -> JobId {
        self.next_job += 1;
        JobId((self.settings.numbers << 32) | self.next_job)
    }
}
