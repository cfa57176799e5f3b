//! On-demand checks: clients request checks of any file that this broker may read.
//!
//! An on-demand check is a job without lasting effects. It has no permanent verdict, stored result,
//! gate, journal or reporter. The client gets the findings that its own run would give. If the
//! broker cannot guarantee that, it tells the client to run the check itself.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use qcbus_document::FileKind;
use qcbus_messages::control::Response;
use qcbus_messages::{Absence, JobId, MissingDocument};
use qcbus_types::{Action, OnDemand, OnDemandOutcome, Origin, RequestId, Requirement};

use super::files::{FileId, Priority, Stage};
use super::jobs::{ActiveJob, JobStage, TaskState};
use super::{Actions, Phase, State};

/// On-demand checks in progress, by client.
pub(super) type OnDemandChecks = BTreeMap<RequestId, FileId>;

impl State {
    /// Handles a client's request to check a file.
    pub(super) fn on_demand(
        &mut self,
        path: &Arc<Path>,
        on_demand: OnDemand,
        actions: &mut Actions,
    ) {
        let request_id = on_demand.request_id;
        let kind = match self.takes_on_demand(path, &on_demand) {
            Ok(kind) => kind,
            Err(reason) => return elsewhere(request_id, reason, actions),
        };
        let id = self.files.insert_on_demand(path, kind, on_demand);
        self.on_demand_checks.insert(request_id, id);
        self.files.enqueue(id, Priority::OnDemand, self.now);
    }

    /// Checks whether a job is an on-demand check.
    pub fn is_on_demand(&self, job: JobId) -> bool {
        self.jobs.get(&job).is_some_and(|it| it.on_demand.is_some())
    }

    fn takes_on_demand(&self, path: &Path, on_demand: &OnDemand) -> Result<FileKind, String> {
        if self.phase != Phase::Running {
            return Err("the broker is stopping".to_owned());
        }
        let fails = |name: &&String| !self.is_as_started(name) || self.hopeless(name).is_some();
        if let Some(name) = on_demand.bundles.iter().find(fails) {
            return Err(format!("{name} is not available"));
        }
        FileKind::of_path(path).ok_or_else(|| "it is not a file that qcbus checks".to_owned())
    }

    /// Checks whether a bundle has joined as exactly the program that its name starts now.
    fn is_as_started(&self, name: &str) -> bool {
        let bundle = self.bundles.get(name);
        let bundle = bundle.filter(|it| it.origin == Some(Origin::Supervised));
        let launch = bundle.and_then(|it| it.launch.filter(|_| it.catalogue.is_some()));
        let child = self.children.get(name);
        launch
            .zip(child)
            .is_some_and(|(launch, child)| launch.is_of(&child.spec))
    }

    /// Returns the requirements of a job. For an on-demand check these are only the requested ones.
    pub(super) fn requirements_of(&self, job: &ActiveJob) -> Arc<[Requirement]> {
        let requirements = self.requirements(job.kind);
        match &job.on_demand {
            None => requirements,
            Some(on_demand) if on_demand.request_id.is_trial() => {
                self.requirements_of_trial(&on_demand.bundles, job.kind)
            }
            Some(on_demand) => {
                let asked =
                    |requirement: &&Requirement| on_demand.bundles.contains(&requirement.name);
                requirements.iter().filter(asked).cloned().collect()
            }
        }
    }

    /// Pools an on-demand check that has all its tasks back. Its findings must be the same as in
    /// the client's own run.
    pub(super) fn pool_on_demand(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        let Some(on_demand) = job.on_demand.clone() else {
            return;
        };
        job.stage = JobStage::Storing;
        if on_demand.request_id.is_trial() {
            return self.pool_trial(id, actions);
        }
        let whole = job.tasks.len() == on_demand.bundles.len();
        // The cause of a failed bundle may lie outside the file. Another process of it may succeed.
        let mut tasks = job.tasks.values();
        let done = tasks.all(|task| task.state == TaskState::Done);
        // The client may have rights that this process does not have.
        let refused = |it: &MissingDocument| matches!(it.why, Absence::Unreadable { .. });
        let prepared = job.prepared.as_deref();
        if prepared.is_some_and(|it| it.missing.iter().any(refused)) {
            let reason = "a document that the file refers to cannot be read".to_owned();
            return self.send_elsewhere(id, reason, actions);
        }
        let same = on_demand
            .bundles
            .iter()
            .all(|name| self.is_as_started(name));
        if whole && done && same {
            let finished = self.finished(id);
            actions.extend(finished.map(|it| Action::Pool(Box::new(it))));
        } else {
            let reason = "a bundle that must check it has failed or is not available".to_owned();
            self.send_elsewhere(id, reason, actions);
        }
    }

    /// Handles the outcome of an on-demand check.
    pub(super) fn pooled(&mut self, id: JobId, outcome: OnDemandOutcome, actions: &mut Actions) {
        let Some(job) = self.jobs.get_mut(&id) else {
            return;
        };
        let Some(on_demand) = job.on_demand.clone() else {
            return;
        };
        let request_id = on_demand.request_id;
        if !self.on_demand_checks.contains_key(&request_id) {
            return self.end_job(id, actions);
        }
        match outcome {
            OnDemandOutcome::Pooled(checked) => {
                self.on_demand_checks.remove(&request_id);
                let response = Response::Checked(checked);
                actions.push(Action::Answer {
                    request_id,
                    response,
                });
                self.end_job(id, actions);
            }
            OnDemandOutcome::Tried(found) => {
                self.on_demand_checks.remove(&request_id);
                self.trial_ended(request_id, Ok(found));
                self.end_job(id, actions);
            }
            OnDemandOutcome::Stale => self.end_job(id, actions),
            // The configuration is the same, because a change would have dismissed the check.
            OnDemandOutcome::Outdated => {
                job.stage = JobStage::Checking;
                self.reseat(id, actions);
            }
            OnDemandOutcome::Failed(reason) => self.send_elsewhere(id, reason, actions),
        }
    }

    /// Ends the job of an on-demand check that this broker cannot do.
    pub(super) fn send_elsewhere(&mut self, id: JobId, reason: String, actions: &mut Actions) {
        let on_demand = self.jobs.get(&id).and_then(|job| job.on_demand.as_ref());
        if let Some(request_id) = on_demand.map(|it| it.request_id)
            && self.on_demand_checks.remove(&request_id).is_some()
        {
            if request_id.is_trial() {
                self.trial_ended(request_id, Err(reason));
            } else {
                elsewhere(request_id, reason, actions);
            }
        }
        self.end_job(id, actions);
    }

    /// Handles the end of an on-demand job. The job starts again unless the client was answered or has disconnected.
    pub(super) fn on_demand_is_over(
        &mut self,
        file: FileId,
        request_id: RequestId,
        actions: &mut Actions,
    ) {
        let Some(entry) = self.files.get(file) else {
            return;
        };
        if !self.on_demand_checks.contains_key(&request_id) {
            self.files.remove(file);
        } else if request_id.is_trial() {
            self.on_demand_checks.remove(&request_id);
            self.files.remove(file);
            self.put_trial_back(request_id);
        } else if entry.present {
            self.files.enqueue(file, Priority::OnDemand, self.now);
        } else {
            self.on_demand_checks.remove(&request_id);
            self.files.remove(file);
            elsewhere(request_id, "it does not exist any more".to_owned(), actions);
        }
    }

    /// Dismisses all on-demand checks. The configuration or the bundles have changed, so new
    /// findings would not match the request, or the broker has stopped.
    pub(super) fn dismiss_on_demand(&mut self, reason: &str, actions: &mut Actions) {
        let request_ids: Vec<RequestId> = self.on_demand_checks.keys().copied().collect();
        for request_id in request_ids {
            if request_id.is_trial() {
                self.put_trial_back(request_id);
            } else {
                elsewhere(request_id, reason.to_owned(), actions);
            }
            self.abandon(request_id, actions);
        }
    }

    /// Drops the request of a client that no longer needs it.
    pub(super) fn abandon(&mut self, request_id: RequestId, actions: &mut Actions) {
        let Some(file) = self.on_demand_checks.remove(&request_id) else {
            return;
        };
        match self.files.get(file).map(|entry| entry.stage().clone()) {
            Some(Stage::Active(job)) => {
                let job = self.jobs.get(&job).map(|it| (job, it.stage));
                if let Some((job, stage)) = job
                    && stage.is_before_storing()
                {
                    self.end_job(job, actions);
                }
            }
            _ => self.files.remove(file),
        }
    }

    /// Rejects the on-demand checks of a bundle that died. They are not retried. A verdict would protect other runs
    /// from the same file, but an on-demand check leaves no record. Every job needs this bundle.
    pub(super) fn refuse_quarantined(&mut self, actions: &mut Actions) {
        let quarantined = |job: &ActiveJob| job.tasks.values().any(|task| task.quarantined);
        let jobs = self.jobs.iter();
        let quarantine = jobs.filter(|(_, job)| job.on_demand.is_some() && quarantined(job));
        let quarantine: Vec<JobId> = quarantine.map(|(id, _)| *id).collect();
        for id in quarantine {
            if self.try_again(id, actions) {
                continue;
            }
            let reason = "a bundle failed while it checked the file".to_owned();
            self.send_elsewhere(id, reason, actions);
        }
    }

    /// Rejects the on-demand checks that still wait. The broker starts no new jobs, so these
    /// clients run the checks themselves.
    pub(super) fn refuse_waiting_on_demand(&mut self, actions: &mut Actions) {
        let waits = |file: &FileId| {
            let stage = self.files.get(*file).map(|entry| entry.stage());
            !matches!(stage, Some(Stage::Active(_)))
        };
        let waiting = self.on_demand_checks.iter().filter(|(_, file)| waits(file));
        let waiting: Vec<(RequestId, FileId)> = waiting.map(|(it, file)| (*it, *file)).collect();
        for (request_id, file) in waiting {
            self.on_demand_checks.remove(&request_id);
            self.files.remove(file);
            elsewhere(request_id, "the broker is stopping".to_owned(), actions);
        }
    }
}

fn elsewhere(request_id: RequestId, reason: String, actions: &mut Actions) {
    let response = Response::Elsewhere { reason };
    actions.push(Action::Answer {
        request_id,
        response,
    });
}
