//! Finishing: turns a job with completed tasks into a stored result.

use std::path::Path;
use std::sync::Arc;

use qcbus_messages::{JobId, Verdict};
use qcbus_types::{Action, FinishedJob, Judged, Notice, StoreOutcome, TaskOutcome};

use super::files::{FileId, Priority, Stage};
use super::jobs::{ActiveJob, JobStage, NOTICE_PAUSE, Task};
use super::outcome::{not_applicable, outcome};
use super::{Actions, State};

impl State {
    /// Marks the job as ready to be stored when all its tasks are completed.
    pub(super) fn finish_if_over(&mut self, id: JobId) {
        let Some(job) = self.jobs.get(&id) else {
            return;
        };
        if job.stage != JobStage::Checking || !job.tasks.values().all(Task::is_over) {
            return;
        }
        let at = self.storable_at(id);
        if let Some(job) = self.jobs.get_mut(&id) {
            job.stage = JobStage::Finished(at);
        }
    }

    /// Hands finished jobs to the writers as long as they have room.
    pub(super) fn store_finished(&mut self, actions: &mut Actions) {
        let now = self.now;
        for (id, job) in &mut self.jobs {
            let waits = matches!(job.stage, JobStage::Finished(at) if at > now);
            if waits && !std::mem::replace(&mut job.is_slim, true) {
                actions.push(Action::ReleaseParts { job: *id });
            }
        }
        let due = |job: &ActiveJob| matches!(job.stage, JobStage::Finished(at) if at <= now);
        let ids: Vec<JobId> = self
            .jobs
            .iter()
            .filter(|(_, job)| due(job))
            .map(|(id, _)| *id)
            .collect();
        for id in ids {
            if self
                .jobs
                .get(&id)
                .is_some_and(|job| job.on_demand.is_some())
            {
                self.pool_on_demand(id, actions);
                continue;
            }
            if self.storing >= self.settings.max_storing {
                continue;
            }
            let finished = self.finished(id);
            if let (Some(finished), Some(job)) = (finished, self.jobs.get_mut(&id)) {
                job.stage = JobStage::Storing;
                if let Some(entry) = self.files.get_mut(job.file) {
                    job.anew = std::mem::take(&mut entry.anew);
                }
                self.storing += 1;
                actions.push(Action::Store(Box::new(finished)));
            }
        }
    }

    pub(super) fn finished(&self, id: JobId) -> Option<FinishedJob> {
        let job = self.jobs.get(&id)?;
        Some(FinishedJob {
            job: id,
            path: job.path.clone(),
            kind: job.kind,
            config: job.config,
            prepared: job.prepared.clone(),
            unreadable: job.unreadable.clone(),
            bundles: job
                .tasks
                .iter()
                .map(|(name, task)| outcome(name, task))
                .chain(self.inapplicable(job))
                .collect(),
            rests_on: self.verdicts_under(job),
            required_set: State::required_set(&job.tasks),
            epoch: job.epoch,
            elapsed: self.now.saturating_sub(job.since),
        })
    }

    /// Returns the outcomes of configured bundles that do not take files of this kind. Their
    /// checkers are listed as skipped, so that they do not look lost.
    fn inapplicable(&self, job: &ActiveJob) -> Vec<TaskOutcome> {
        let mut outcomes = Vec::new();
        let kind = job.kind;
        // A shadow does not report on bundles that do not take this kind of file.
        let named = match job.is_trial() {
            true => Vec::new(),
            false => self.demand.named(),
        };
        for (name, bundle) in &self.bundles {
            let Some(catalogue) = &bundle.catalogue else {
                continue;
            };
            let wanted = named
                .iter()
                .any(|it| self.demand.means(it, name, &catalogue.alias));
            if !wanted || catalogue.kinds.contains(&kind) || self.is_shadow(name) {
                continue;
            }
            let checkers = self.demand.checkers(name, catalogue, kind);
            let version = &bundle.version;
            outcomes.push(not_applicable(name, version, catalogue, checkers, kind));
        }
        outcomes
    }

    /// Handles the end of storing.
    pub(super) fn stored(&mut self, id: JobId, outcome: StoreOutcome, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        if job.stage != JobStage::Storing {
            return;
        }
        self.storing -= 1;
        let file = job.file;
        let is_stored = matches!(outcome, StoreOutcome::Stored(_));
        if let Some(entry) = self.files.get_mut(file) {
            entry.anew |= job.anew && !is_stored;
        }
        match outcome {
            StoreOutcome::Stored(judged) => {
                self.is_judged(file, Arc::new(*judged), actions);
                self.end_job(id, actions);
            }
            StoreOutcome::Stale { half_written } => {
                if let Some(entry) = self.files.get_mut(file) {
                    entry.stale = true;
                    entry.half_written |= half_written;
                }
                self.unpublish_unstored(file, actions);
                self.end_job(id, actions);
            }
            StoreOutcome::Outdated if job.config == self.config => {
                job.stage = JobStage::Checking;
                self.reseat(id, actions);
            }
            // Findings from another configuration are invalid.
            StoreOutcome::Outdated => self.begin_anew(id, actions),
            StoreOutcome::Failed(why) => {
                let entry = self.files.get_mut(file);
                let is_new = entry.is_some_and(|it| !std::mem::replace(&mut it.half_written, true));
                job.stage = JobStage::Finished(self.now + self.settings.retry_after);
                let same = job.config == self.config;
                self.unpublish_unstored(file, actions);
                // On a full disk every file would repeat this notice at every try.
                if is_new || self.now >= self.mute_unwritten_until {
                    self.mute_unwritten_until = self.now + NOTICE_PAUSE;
                    self.notice(Notice::NotWritten(why), actions);
                }
                if same {
                    self.reseat(id, actions);
                } else {
                    self.begin_anew(id, actions);
                }
            }
        }
    }

    /// Withdraws a file from the gate if it was not stored. The copy may already be published,
    /// because the journal is written last. It stays only if a previous acceptance is still valid.
    /// Otherwise it would remain behind the gate when the file changes.
    fn unpublish_unstored(&mut self, file: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get_mut(file) else {
            return;
        };
        let accepted = |judged: &Arc<Judged>| judged.verdict == Verdict::Accepted;
        let stands =
            !entry.unpublished && !entry.stale && entry.judged.as_ref().is_some_and(accepted);
        if !stands {
            entry.unpublished = true;
            let path = entry.path.clone();
            actions.push(Action::CloseGate { path });
        }
    }

    fn is_judged(&mut self, file: FileId, judged: Arc<Judged>, actions: &mut Actions) {
        self.rate.note(self.now);
        if let Some(entry) = self.files.get_mut(file) {
            entry.judged = Some(judged.clone());
            (entry.unpublished, entry.half_written) = (false, false);
            let (path, fresh) = (entry.path.clone(), true);
            let stale = entry.stale && judged.verdict == Verdict::Accepted;
            let (gated, told, now) = (path.clone(), judged.clone(), judged);
            actions.push(Action::Judged {
                path,
                judged: told,
                fresh,
            });
            if stale {
                // The file changed while its acceptance was being stored.
                entry.unpublished = true;
                actions.push(Action::CloseGate { path: gated });
            }
            self.counts_for_others(file, &now);
        }
        self.deliver_to_all(file, actions);
        self.let_shadows_try(file);
    }

    /// Discards the job, and its file is read again.
    pub(super) fn begin_anew(&mut self, id: JobId, actions: &mut Actions) {
        let file = self.jobs.get(&id).map(|job| job.file);
        if let Some(entry) = file.and_then(|file| self.files.get_mut(file)) {
            entry.stale = true;
        }
        self.end_job(id, actions);
    }

    /// Ends the job, whatever its outcome. The file is queued again if it changed meanwhile, or if
    /// its required bundles have changed.
    pub(super) fn end_job(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.remove(&id) else {
            return;
        };
        match job.stage {
            JobStage::Preparing | JobStage::Storing | JobStage::Finished(_) => {}
            JobStage::Checking => self.cancel_tasks(id, &job, actions),
        }
        actions.push(Action::Release { job: id });
        if job.prepared.is_some() {
            self.let_one_in();
        }
        self.files.set_stage(job.file, Stage::Idle);
        if let Some(on_demand) = &job.on_demand {
            return self.on_demand_is_over(job.file, on_demand.request_id, actions);
        }
        self.what_follows(job.file, actions);
        // At this point the file is already queued again, if necessary.
        self.verdict_has_come(job.file, actions);
    }

    /// Decides what follows a job: the file is queued again, is withdrawn or has a valid verdict.
    fn what_follows(&mut self, file: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get(file) else {
            return;
        };
        let stands = |judged: &Arc<Judged>| self.stands(entry.kind, judged);
        if !entry.present {
            self.vanished_file(file, actions);
        } else if entry.stale || entry.judged.is_none() {
            self.files.enqueue(file, Priority::Fresh, self.now);
        } else if entry.judged.as_ref().is_some_and(stands) {
            self.settle_waits(file, actions);
        } else {
            let priority = self.priority_of(&entry.path);
            self.files.enqueue(file, priority, self.now);
        }
    }

    /// Returns the priority of a file with an invalid verdict. It is judged at once if a client waits for it.
    pub(super) fn priority_of(&self, path: &Path) -> Priority {
        if self.is_awaited(path) {
            Priority::Fresh
        } else {
            Priority::Background
        }
    }
}
