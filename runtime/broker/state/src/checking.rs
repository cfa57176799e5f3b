//! Checking: sends the tasks of jobs to bundles and handles their end.

use std::time::Duration;

use qcbus_messages::{DocId, JobId, ToPeer};
use qcbus_types::Action;

use super::jobs::{ActiveJob, JobStage, TaskState};
use super::{Actions, State};

/// Minimum time between two publications of the same document for a bundle that is missing it.
const LACK_PAUSE: Duration = Duration::from_millis(250);

impl State {
    /// Fixes the required bundles of a job that has been read, and sends it to them.
    pub(super) fn give_out(&mut self, id: JobId, actions: &mut Actions) {
        if let Some(job) = self.jobs.get_mut(&id) {
            job.stage = JobStage::Checking;
            job.config = self.config;
        }
        self.reseat(id, actions);
        self.fail_missing();
    }

    /// Sends a bundle its next jobs: quarantined jobs one at a time and alone, other jobs up to its capacity.
    pub(super) fn dispatch(&mut self, name: &str, actions: &mut Actions) {
        loop {
            let findings = self.room_for_findings();
            let Some(bundle) = self.bundles.get_mut(name) else {
                return;
            };
            let (Some(session), true) = (bundle.session, bundle.ready && !bundle.draining) else {
                return;
            };
            let room = if bundle.quarantine.is_empty() {
                bundle.capacity
            } else {
                1
            };
            if bundle.active.len() >= room {
                return;
            }
            let Some((id, quarantined)) = bundle.next_job(findings) else {
                return;
            };
            let fresh = bundle.fresh_process;
            let Some(job) = self.jobs.get_mut(&id) else {
                continue;
            };
            let Some(task) = job.tasks.get_mut(name) else {
                continue;
            };
            if task.state != TaskState::Queued {
                continue;
            }
            let Some(prepared) = job.prepared.clone() else {
                continue;
            };
            task.state = TaskState::Sent {
                alone_and_fresh: quarantined && fresh,
            };
            let message = qcbus_types::job_message(id, self.config, job.kind, &prepared);
            bundle.give(id, self.now);
            actions.push(Action::Send {
                session,
                message: ToPeer::Job(message),
            });
        }
    }

    /// Sends the next jobs to every bundle that has room. Cancelled jobs also make room.
    pub(super) fn dispatch_all(&mut self, actions: &mut Actions) {
        let waiting = self
            .bundles
            .iter()
            .filter(|(_, it)| !(it.queue.is_empty() && it.quarantine.is_empty()));
        let names: Vec<String> = waiting.map(|(name, _)| name.clone()).collect();
        for name in names {
            self.dispatch(&name, actions);
        }
    }

    /// Handles the report of a bundle that it is missing a document of one of its jobs.
    pub(super) fn need_document(&mut self, name: &str, doc: DocId, actions: &mut Actions) {
        let now = self.now;
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        let has = |id: &&JobId| {
            let prepared = self.jobs.get(id).and_then(|job| job.prepared.as_ref());
            prepared.is_some_and(|it| it.documents.iter().any(|document| document.doc == doc))
        };
        let Some(job) = bundle.active.keys().find(has) else {
            return;
        };
        bundle.lacks.retain(|_, then| now < *then + LACK_PAUSE);
        if let std::collections::btree_map::Entry::Vacant(e) = bundle.lacks.entry(doc) {
            e.insert(now);
            actions.push(Action::PublishAgain { job: *job, doc });
        }
    }

    /// Handles the end of a bundle's task.
    pub(super) fn job_done(
        &mut self,
        name: &str,
        id: JobId,
        micros: u64,
        actions: &mut Actions,
    ) -> bool {
        let Some(task) = self
            .jobs
            .get_mut(&id)
            .and_then(|job| job.tasks.get_mut(name))
        else {
            return false;
        };
        if !matches!(task.state, TaskState::Sent { .. }) {
            return false;
        }
        task.state = TaskState::Done;
        task.micros = micros;
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.take(id, self.now);
        }
        self.finish_if_over(id);
        self.dispatch(name, actions);
        true
    }

    /// Cancels the task of one bundle in a job.
    pub(super) fn cancel_task(&mut self, id: JobId, name: &str, actions: &mut Actions) {
        let job = self.jobs.get_mut(&id);
        let Some(task) = job.and_then(|job| job.tasks.remove(name)) else {
            return;
        };
        if matches!(task.state, TaskState::Sent { .. }) {
            self.call_back(id, name, actions);
        }
    }

    pub(super) fn cancel_tasks(&mut self, id: JobId, job: &ActiveJob, actions: &mut Actions) {
        for (name, task) in &job.tasks {
            if matches!(task.state, TaskState::Sent { .. }) {
                self.call_back(id, name, actions);
            }
        }
    }

    fn call_back(&mut self, id: JobId, name: &str, actions: &mut Actions) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        bundle.active.remove(&id);
        if let Some(session) = bundle.session {
            let message = ToPeer::Cancel { job: id };
            actions.push(Action::Send { session, message });
        }
    }
}
