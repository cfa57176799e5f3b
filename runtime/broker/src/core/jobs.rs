//! Jobs: from the queue through reading and checking to a stored result.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_formats::xqar::Status;
use qcbus_messages::{Catalogue, DocId, JobId, ToPeer};

use super::action::Action;
use super::files::{FileId, Priority, Stage};
use super::outcome::{outcome, signature};
use super::staging::Staged;
use super::types::{
    BundleOutcome, CheckerOutcome, FinishedJob, PrepareFailure, PreparedJob, StoreOutcome,
};
use super::{Actions, State};

/// Between two notices that there is no room.
const ROOM_NOTICE_PAUSE: Duration = Duration::from_secs(10);

/// A job in flight.
#[derive(Debug)]
pub(super) struct ActiveJob {
    pub file: FileId,
    pub path: Arc<Path>,
    pub kind: FileKind,
    pub since: Duration,
    pub stage: JobStage,
    pub prepared: Option<Arc<PreparedJob>>,
    pub unreadable: Option<String>,
    /// By bundle name.
    pub shares: BTreeMap<String, Share>,
}

/// How far a job is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JobStage {
    Preparing,
    Checking,
    /// All shares are there; waits for a place among the writers, not before the given time.
    Finished(Duration),
    Storing,
}

/// One bundle's share of a job.
#[derive(Debug)]
pub(super) struct Share {
    pub state: ShareState,
    pub version: String,
    /// As it was when the job was given out; `None` for a bundle that was never seen.
    pub catalogue: Option<Arc<Catalogue>>,
    pub demanded: Vec<u32>,
    pub staged: BTreeMap<u32, Staged>,
    pub staged_bytes: usize,
    pub micros: u64,
    /// It was with a bundle that died; it is tried alone from now on.
    pub suspect: bool,
    /// How often the bundle died with this job alone in a fresh process.
    pub strikes: u8,
    /// The failure means that the bundle was not there, not that it broke on this file.
    pub absent: bool,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ShareState {
    Queued,
    Sent {
        since: Duration,
        alone_and_fresh: bool,
    },
    Done,
    Failed(String),
}

impl Share {
    fn over(&self) -> bool {
        matches!(self.state, ShareState::Done | ShareState::Failed(_))
    }

    /// Forgets what a session that has ended said.
    pub fn unstage(&mut self) {
        self.staged.clear();
        self.staged_bytes = 0;
    }
}

impl State {
    /// Starts as many jobs as there is room for.
    pub(super) fn pump(&mut self, actions: &mut Actions) {
        if !self.may_judge() {
            return;
        }
        while self.jobs.len() < self.settings.max_active
            && self.preparing < self.settings.max_preparing
            && self.documents_active() < self.settings.max_documents
        {
            let Some(id) = self.files.dequeue(self.now) else {
                break;
            };
            self.take(id, actions);
        }
        self.store_finished(actions);
    }

    fn documents_active(&self) -> usize {
        let documents = |job: &ActiveJob| {
            job.prepared
                .as_ref()
                .map_or(1, |it| it.documents.len().max(1))
        };
        self.jobs.values().map(documents).sum()
    }

    /// Begins with one file, unless its verdict still stands.
    fn take(&mut self, id: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get(id) else {
            return;
        };
        if !entry.present {
            return;
        }
        if let Some(judged) = &entry.judged {
            let known = judged.inputs.first().and_then(|root| root.content);
            let same_bytes =
                !judged.racy && !entry.dirty && known.map(|it| it.0) == Some(entry.stamp);
            if same_bytes && self.stands(entry.kind, judged) {
                let (path, judged) = (entry.path.clone(), judged.clone());
                actions.push(Action::Judged {
                    path,
                    judged,
                    fresh: false,
                });
                self.settle_waits(id, actions);
                return;
            }
        }
        let (path, kind) = (entry.path.clone(), entry.kind);
        let job = self.next_job();
        self.files.set_stage(id, Stage::Active(job));
        if let Some(entry) = self.files.get_mut(id) {
            entry.dirty = false;
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
                shares: BTreeMap::new(),
            },
        );
        actions.push(Action::Prepare { job, path });
    }

    /// Reading is over.
    pub(super) fn prepared(
        &mut self,
        id: JobId,
        result: Result<Box<PreparedJob>, PrepareFailure>,
        actions: &mut Actions,
    ) {
        if !matches!(self.jobs.get(&id), Some(job) if job.stage == JobStage::Preparing) {
            return;
        }
        self.preparing -= 1;
        match result {
            Ok(prepared) => self.read(id, &Arc::new(*prepared), actions),
            Err(PrepareFailure::Vanished) => {
                let file = self.jobs.get(&id).map(|job| job.file);
                self.end_job(id, actions);
                if let Some(file) = file {
                    self.vanished_file(file, actions);
                }
            }
            Err(PrepareFailure::NoRoom(why)) => {
                // Every file in the queue would say the same and push out all other notices.
                if self.now >= self.mute_room_until {
                    self.mute_room_until = self.now + ROOM_NOTICE_PAUSE;
                    self.notice(why, actions);
                }
                self.requeue_later(id, self.settings.retry_after, actions);
            }
            Err(PrepareFailure::Busy) => {
                self.requeue_later(id, self.settings.busy_pause, actions);
            }
            Err(PrepareFailure::Unreadable { reason, stamp }) => {
                if let Some(job) = self.jobs.get_mut(&id) {
                    job.unreadable = Some(reason);
                    let stamp = stamp.map(|stamp| (stamp, qcbus_messages::Digest::default()));
                    let input = super::types::Input {
                        path: job.path.clone(),
                        content: stamp,
                    };
                    job.prepared = Some(Arc::new(PreparedJob {
                        inputs: vec![input],
                        basis: qcbus_messages::Digest::default(),
                        racy: true,
                        documents: Vec::new(),
                        missing: Vec::new(),
                        bytes: 0,
                    }));
                }
                self.give_out(id, actions);
            }
        }
    }

    /// The file is read: is the verdict known, has it changed meanwhile, or is there work?
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
        if entry.dirty || !entry.present {
            self.end_job(id, actions);
            return;
        }
        let old = entry.judged.clone();
        self.depend(
            file,
            old.as_deref().map_or(&[], |it| &it.inputs),
            &prepared.inputs,
            actions,
        );
        let same = |judged: &super::types::Judged| judged.basis == prepared.basis;
        match old {
            Some(judged) if same(&judged) && self.stands(kind, &judged) => {
                self.restamp(file, &judged, prepared, actions);
                self.end_job(id, actions);
            }
            _ => self.give_out(id, actions),
        }
    }

    /// The bytes are the same under a new stamp.
    fn restamp(
        &mut self,
        file: FileId,
        judged: &super::types::Judged,
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
                path: path.clone(),
                judged: judged.clone(),
            });
            actions.push(Action::Judged {
                path,
                judged,
                fresh: false,
            });
        }
    }

    fn depend(
        &mut self,
        file: FileId,
        old: &[super::types::Input],
        inputs: &[super::types::Input],
        actions: &mut Actions,
    ) {
        let paths = |inputs: &[super::types::Input]| -> Vec<Arc<Path>> {
            inputs
                .iter()
                .skip(1)
                .map(|input| input.path.clone())
                .collect()
        };
        let new = paths(inputs);
        self.files.set_dependencies(file, &paths(old), &new);
        if !new.is_empty() {
            let stamps = inputs
                .iter()
                .skip(1)
                .map(|it| it.content.map(|content| content.0));
            let files = new.into_iter().zip(stamps).collect();
            actions.push(Action::Depend { files });
        }
    }

    /// Makes a share for every bundle that must check this file and hands them out.
    fn give_out(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.get(&id) else {
            return;
        };
        let kind = job.kind;
        let readable = job.unreadable.is_none();
        let mut shares = self.shares_for(kind);
        if !readable {
            let why = job.unreadable.clone().unwrap_or_default();
            for share in shares.values_mut() {
                share.state = ShareState::Failed(why.clone());
            }
        }
        let names: Vec<String> = shares.keys().cloned().collect();
        if let Some(job) = self.jobs.get_mut(&id) {
            job.stage = JobStage::Checking;
            job.shares = shares;
        }
        for name in names {
            if let Some(bundle) = self.bundles.get_mut(&name) {
                bundle.queue.push_back(id);
            }
            self.dispatch(&name, actions);
        }
        self.fail_absent(actions);
        self.finish_if_over(id, actions);
    }

    /// Gives a bundle its next jobs: suspects one at a time and alone, others up to its capacity.
    pub(super) fn dispatch(&mut self, name: &str, actions: &mut Actions) {
        loop {
            let findings = self.room_for_findings();
            let Some(bundle) = self.bundles.get_mut(name) else {
                return;
            };
            let (Some(session), true) = (bundle.session, bundle.ready && !bundle.leaving) else {
                return;
            };
            let room = if bundle.suspects.is_empty() {
                bundle.capacity
            } else {
                1
            };
            if bundle.active.len() >= room {
                return;
            }
            let Some((id, suspect)) = bundle.next_job(findings) else {
                return;
            };
            let fresh = bundle.fresh_process;
            let Some(job) = self.jobs.get_mut(&id) else {
                continue;
            };
            let Some(share) = job.shares.get_mut(name) else {
                continue;
            };
            if share.state != ShareState::Queued {
                continue;
            }
            let Some(prepared) = job.prepared.clone() else {
                continue;
            };
            share.state = ShareState::Sent {
                since: self.now,
                alone_and_fresh: suspect && fresh,
            };
            let message = super::types::job_message(id, self.config, job.kind, &prepared);
            bundle.active.insert(id);
            bundle.fresh_process = false;
            bundle.moved = self.now;
            actions.push(Action::Send {
                session,
                message: ToPeer::Job(message),
            });
        }
    }

    /// Gives every bundle that has room its next jobs: room also comes from jobs that are cancelled.
    pub(super) fn dispatch_all(&mut self, actions: &mut Actions) {
        let waiting = self
            .bundles
            .iter()
            .filter(|(_, it)| it.ready && !(it.queue.is_empty() && it.suspects.is_empty()));
        let names: Vec<String> = waiting.map(|(name, _)| name.clone()).collect();
        for name in names {
            self.dispatch(&name, actions);
        }
    }

    /// A bundle lacks a document of a job that it has.
    pub(super) fn need_document(&mut self, name: &str, doc: DocId, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get(name) else {
            return;
        };
        let has = |id: &&JobId| {
            let prepared = self.jobs.get(id).and_then(|job| job.prepared.as_ref());
            prepared.is_some_and(|it| it.documents.iter().any(|document| document.doc == doc))
        };
        if let Some(job) = bundle.active.iter().find(has) {
            actions.push(Action::PublishAgain { job: *job, doc });
        }
    }

    /// A bundle is through with a job.
    pub(super) fn job_done(
        &mut self,
        name: &str,
        id: JobId,
        micros: u64,
        actions: &mut Actions,
    ) -> bool {
        let Some(share) = self
            .jobs
            .get_mut(&id)
            .and_then(|job| job.shares.get_mut(name))
        else {
            return false;
        };
        if !matches!(share.state, ShareState::Sent { .. }) {
            return false;
        }
        share.state = ShareState::Done;
        share.micros = micros;
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.active.remove(&id);
            bundle.done += 1;
            bundle.moved = self.now;
            bundle.proved = true;
        }
        self.finish_if_over(id, actions);
        self.dispatch(name, actions);
        true
    }

    /// When every share is there, the job is ready to be stored.
    pub(super) fn finish_if_over(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        if job.stage == JobStage::Checking && job.shares.values().all(Share::over) {
            job.stage = JobStage::Finished(Duration::ZERO);
            self.store_finished(actions);
        }
    }

    fn store_finished(&mut self, actions: &mut Actions) {
        let now = self.now;
        let due = |job: &ActiveJob| matches!(job.stage, JobStage::Finished(at) if at <= now);
        let ids: Vec<JobId> = self
            .jobs
            .iter()
            .filter(|(_, job)| due(job))
            .map(|(id, _)| *id)
            .collect();
        for id in ids {
            if self.storing >= self.settings.max_storing {
                return;
            }
            let finished = self.finished(id);
            if let (Some(finished), Some(job)) = (finished, self.jobs.get_mut(&id)) {
                job.stage = JobStage::Storing;
                self.storing += 1;
                actions.push(Action::Store(Box::new(finished)));
            }
        }
    }

    fn finished(&self, id: JobId) -> Option<FinishedJob> {
        let job = self.jobs.get(&id)?;
        Some(FinishedJob {
            job: id,
            path: job.path.clone(),
            kind: job.kind,
            config: self.config,
            prepared: job.prepared.clone().filter(|_| job.unreadable.is_none()),
            unreadable: job.unreadable.clone(),
            bundles: job
                .shares
                .iter()
                .map(|(name, share)| outcome(name, share))
                .chain(self.inapplicable(job.kind))
                .collect(),
            signature: signature(job.shares.iter().map(|(name, share)| {
                let offer = share.catalogue.as_deref().filter(|_| !share.absent);
                (name.as_str(), share.version.as_str(), offer)
            })),
            elapsed: self.now.saturating_sub(job.since),
        })
    }

    /// Configured bundles that do not take files of this kind: their checkers are listed as
    /// skipped, so that nobody takes them for lost.
    fn inapplicable(&self, kind: FileKind) -> Vec<BundleOutcome> {
        let mut outcomes = Vec::new();
        let named = self.demand.named();
        for (name, bundle) in &self.bundles {
            let Some(catalogue) = &bundle.catalogue else {
                continue;
            };
            let wanted = named
                .iter()
                .any(|it| self.demand.means(it, name, &catalogue.alias));
            if !wanted || catalogue.kinds.contains(&kind) {
                continue;
            }
            let skipped = |checker| CheckerOutcome {
                checker,
                status: Status::Skipped,
                reason: format!("{name} does not check .{} files", kind.as_str()),
                params: Vec::new(),
                issues: Vec::new(),
                metadata: Vec::new(),
            };
            let checkers = self.demand.checkers(name, catalogue, kind);
            outcomes.push(BundleOutcome {
                name: name.clone(),
                version: bundle.version.clone(),
                catalogue: Some(catalogue.clone()),
                failure: None,
                checkers: checkers.into_iter().map(skipped).collect(),
                micros: 0,
            });
        }
        outcomes
    }

    /// Storing is over.
    pub(super) fn stored(&mut self, id: JobId, outcome: StoreOutcome, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        if job.stage != JobStage::Storing {
            return;
        }
        self.storing -= 1;
        let file = job.file;
        match outcome {
            StoreOutcome::Stored(judged) => {
                let judged = Arc::new(*judged);
                self.rate.note(self.now);
                if let Some(entry) = self.files.get_mut(file) {
                    entry.judged = Some(judged.clone());
                    let path = entry.path.clone();
                    actions.push(Action::Judged {
                        path,
                        judged: judged.clone(),
                        fresh: true,
                    });
                }
                self.deliver_to_all(file, actions);
                self.end_job(id, actions);
            }
            StoreOutcome::Stale => {
                if let Some(entry) = self.files.get_mut(file) {
                    entry.dirty = true;
                }
                self.end_job(id, actions);
            }
            StoreOutcome::Failed(why) => {
                job.stage = JobStage::Finished(self.now + self.settings.retry_after);
                self.notice(why, actions);
            }
        }
    }

    /// The job is over, whatever came of it; the file waits again if it changed meanwhile.
    pub(super) fn end_job(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.remove(&id) else {
            return;
        };
        match job.stage {
            JobStage::Preparing => {}
            JobStage::Storing | JobStage::Finished(_) => {}
            JobStage::Checking => self.cancel_shares(id, &job, actions),
        }
        actions.push(Action::Release { job: id });
        self.files.set_stage(job.file, Stage::Idle);
        let Some(entry) = self.files.get_mut(job.file) else {
            return;
        };
        if !entry.present {
            self.vanished_file(job.file, actions);
        } else if entry.dirty || entry.judged.is_none() {
            self.files.enqueue(job.file, Priority::Fresh, self.now);
        } else if !self.is_current(job.file) {
            self.files.enqueue(job.file, Priority::Background, self.now);
        } else {
            self.settle_waits(job.file, actions);
        }
    }

    fn cancel_shares(&mut self, id: JobId, job: &ActiveJob, actions: &mut Actions) {
        for (name, share) in &job.shares {
            let Some(bundle) = self.bundles.get_mut(name) else {
                continue;
            };
            if matches!(share.state, ShareState::Sent { .. }) {
                bundle.active.remove(&id);
                bundle.forgiven = Some(id);
                if let Some(session) = bundle.session {
                    actions.push(Action::Send {
                        session,
                        message: ToPeer::Cancel { job: id },
                    });
                }
            }
        }
    }

    /// Tries the file again after a pause.
    fn requeue_later(&mut self, id: JobId, pause: Duration, actions: &mut Actions) {
        let Some(file) = self.jobs.get(&id).map(|job| job.file) else {
            return;
        };
        if let Some(entry) = self.files.get_mut(file) {
            entry.dirty = true;
            entry.not_before = self.now + pause;
        }
        self.end_job(id, actions);
    }

    fn next_job(&mut self) -> JobId {
        self.next_job += 1;
        JobId((self.settings.generation << 32) | self.next_job)
    }
}
