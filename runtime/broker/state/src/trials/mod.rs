//! Trials: the findings of shadows. A *shadow* is a bundle of a manifest that checks every file and has no weight in
//! any verdict. It shows its effect before it counts.
//!
//! A trial is an on-demand check of the broker itself. It begins after the verdict on its file has been stored. Each
//! shadow has one trial at a time, and all other work takes precedence. A trial takes no job place, delays no
//! findings, and ends if the bus has no room for other jobs. It leaves no trace in results, in the journal or behind
//! the gate. The state of trials is in memory only. The results of trials with findings are in the state directory. A
//! restarted broker repeats all trials.

mod ends;
mod told;

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::JobId;
use qcbus_types::{Action, OnDemand, RequestId, Requirement, TrialEnd, VersionDigest};

use super::files::{FileId, Stage};
use super::jobs::TaskState;
use super::{Actions, Phase, State};

/// Pause between two trials of a shadow while files wait for their verdicts. Thus a shadow
/// progresses even under permanent load.
const PAUSE: Duration = Duration::from_millis(500);

/// Pause after a trial that could not be done.
const PUT_BACK_PAUSE: Duration = Duration::from_secs(1);

/// Number of deaths of a shadow with one file after which the file is not retried.
const DEATHS: u8 = 2;

/// The wanted shadows, by name.
#[derive(Debug, Default)]
pub(super) struct Trials {
    shadows: BTreeMap<String, Shadow>,
    last_request_id: u64,
}

#[derive(Debug, Default)]
struct Shadow {
    /// Version digest that its trials belong to.
    version_digest: Option<VersionDigest>,
    waiting: VecDeque<Arc<Path>>,
    /// Set of the same paths for fast lookup.
    waits: HashSet<Arc<Path>>,
    under_way: Option<(RequestId, Arc<Path>)>,
    /// Number of consecutive deaths with the first file in the queue.
    deaths: u8,
    tried: BTreeMap<Arc<Path>, Result<TrialEnd, String>>,
    not_before: Duration,
    /// Until this time trials start only if no file waits.
    pause_until: Duration,
}

impl Shadow {
    fn wait(&mut self, path: &Arc<Path>) {
        if self.waits.insert(path.clone()) {
            self.waiting.push_back(path.clone());
        }
    }

    fn first(&mut self) -> Option<Arc<Path>> {
        let path = self.waiting.pop_front()?;
        self.waits.remove(&path);
        Some(path)
    }

    fn put_back(&mut self, path: Arc<Path>) {
        if self.waits.insert(path.clone()) {
            self.waiting.push_front(path);
        }
    }

    fn forget(&mut self, path: &Path) -> bool {
        if self.waits.remove(path) {
            self.waiting.retain(|it| **it != *path);
        }
        self.tried.remove(path).is_some()
    }
}

impl Trials {
    /// Returns the number of active trials.
    pub fn under_way(&self) -> usize {
        let shadows = self.shadows.values();
        shadows.filter(|it| it.under_way.is_some()).count()
    }

    fn of(&mut self, request_id: RequestId) -> Option<&mut Shadow> {
        let mut shadows = self.shadows.values_mut();
        shadows.find(|it| {
            it.under_way
                .as_ref()
                .is_some_and(|(its, _)| *its == request_id)
        })
    }

    fn next_request_id(&mut self) -> RequestId {
        self.last_request_id += 1;
        RequestId(RequestId::FIRST_OF_TRIALS.0 + self.last_request_id)
    }
}

impl State {
    /// Checks whether a bundle is a shadow.
    pub(super) fn is_shadow(&self, name: &str) -> bool {
        self.children.get(name).is_some_and(|it| it.spec.shadow)
    }

    /// Returns the shadow of a trial job, or `None` for other jobs.
    pub fn tried_out(&self, job: JobId) -> Option<&str> {
        let on_demand = self.jobs.get(&job)?.on_demand.as_ref()?;
        let name = on_demand
            .bundles
            .first()
            .filter(|_| on_demand.request_id.is_trial());
        name.map(String::as_str)
    }

    /// Applies a change of the children. New shadows are not required any more, and the trials of
    /// former shadows are discarded.
    pub(super) fn follow_shadows(&mut self, actions: &mut Actions) {
        let children = self.children.iter();
        let wanted = children.filter(|(_, it)| it.spec.shadow);
        let wanted: Vec<String> = wanted.map(|(name, _)| name.clone()).collect();
        let known = self.trials.shadows.keys();
        let gone: Vec<String> = known.filter(|it| !wanted.contains(it)).cloned().collect();
        for name in gone {
            self.end_trial_of(&name, actions);
            self.trials.shadows.remove(&name);
            actions.push(Action::ForgetTrials {
                shadow: name,
                file: None,
            });
        }
        for name in wanted {
            if let Some(bundle) = self.bundles.get_mut(&name)
                && bundle.origin.take().is_some()
            {
                actions.push(Action::Strike { name: name.clone() });
            }
            self.trials.shadows.entry(name).or_default();
        }
    }

    /// Starts the trials of a shadow that has sent its catalogue, unless it has done them in this version.
    pub(super) fn shadow_is_ready(
        &mut self,
        name: &str,
        version_digest: VersionDigest,
        actions: &mut Actions,
    ) {
        let known = self
            .trials
            .shadows
            .get(name)
            .and_then(|it| it.version_digest);
        if known == Some(version_digest) {
            return;
        }
        self.end_trial_of(name, actions);
        let mut shadow = Shadow {
            version_digest: Some(version_digest),
            ..Shadow::default()
        };
        let files = self.files.iter().map(|(_, it)| it);
        let judged = files.filter(|it| it.present && it.on_demand.is_none() && it.judged.is_some());
        judged.for_each(|it| shadow.wait(&it.path));
        self.trials.shadows.insert(name.to_owned(), shadow);
        actions.push(Action::ForgetTrials {
            shadow: name.to_owned(),
            file: None,
        });
    }

    /// Queues a file with a new verdict for the shadows. The kind of file is checked later, because
    /// a disconnected shadow has not sent its catalogue.
    pub(super) fn let_shadows_try(&mut self, file: FileId) {
        let Some(entry) = self.files.get(file) else {
            return;
        };
        // A shadow that has never sent its catalogue gets all files when it does.
        let ready = self.trials.shadows.values_mut();
        for shadow in ready.filter(|it| it.version_digest.is_some()) {
            shadow.tried.remove(&entry.path);
            shadow.wait(&entry.path);
        }
    }

    /// Discards the trials of a removed file.
    pub(super) fn forget_trials(&mut self, path: &Arc<Path>, actions: &mut Actions) {
        for (name, shadow) in &mut self.trials.shadows {
            if shadow.forget(path) {
                actions.push(Action::ForgetTrials {
                    shadow: name.clone(),
                    file: Some(path.clone()),
                });
            }
        }
    }

    /// Returns the requirements of a shadow for files of a kind. They are empty if it checks none
    /// of them or if its catalogue is unknown.
    pub(super) fn requirements_of_trial(
        &self,
        names: &[String],
        kind: FileKind,
    ) -> Arc<[Requirement]> {
        let requirement = |name: &String| {
            let bundle = self.bundles.get(name)?;
            bundle.catalogue.as_ref()?;
            self.place_of(name, bundle, kind)
        };
        names.iter().filter_map(requirement).collect()
    }

    /// Begins all due trials.
    pub(super) fn pump_trials(&mut self, actions: &mut Actions) {
        if self.trials.shadows.is_empty() || self.phase != Phase::Running || !self.may_judge() {
            return;
        }
        let somebody_waits = self.files.counts().fresh > 0;
        let is_due = |name: &str, it: &Shadow| {
            let due = it.not_before <= self.now && !(somebody_waits && it.pause_until > self.now);
            let heard = self.bundles.get(name).is_some_and(|it| it.is_heard());
            due && heard && it.under_way.is_none() && !it.waiting.is_empty()
        };
        let shadows = self.trials.shadows.iter();
        let due = shadows.filter(|(name, it)| is_due(name, it));
        for name in due.map(|(name, _)| name.clone()).collect::<Vec<_>>() {
            self.begin_trial(&name, actions);
        }
    }

    /// Begins a trial of the first queued file that has a verdict and is idle.
    fn begin_trial(&mut self, name: &str, actions: &mut Actions) {
        let waiting = self
            .trials
            .shadows
            .get(name)
            .map_or(0, |it| it.waiting.len());
        for _ in 0..waiting {
            let Some(shadow) = self.trials.shadows.get_mut(name) else {
                return;
            };
            let Some(path) = shadow.first() else {
                return;
            };
            let entry = self.files.id(&path).and_then(|id| self.files.get(id));
            // A file without a verdict is queued when it gets one.
            let Some(entry) = entry.filter(|it| it.present && it.judged.is_some()) else {
                continue;
            };
            let kind = entry.kind;
            if !matches!(entry.stage(), Stage::Idle) || entry.stale {
                shadow.wait(&path);
                continue;
            }
            if self
                .requirements_of_trial(&[name.to_owned()], kind)
                .is_empty()
            {
                continue;
            }
            let request_id = self.trials.next_request_id();
            let Some(shadow) = self.trials.shadows.get_mut(name) else {
                return;
            };
            shadow.under_way = Some((request_id, path.clone()));
            let on_demand = OnDemand {
                request_id,
                bundles: Arc::new([name.to_owned()]),
            };
            let id = self.files.insert_on_demand(&path, kind, on_demand);
            if let Some(entry) = self.files.get_mut(id) {
                entry.asked = self.now;
            }
            self.on_demand_checks.insert(request_id, id);
            return self.take(id, actions);
        }
        // No queued file is idle.
        if let Some(shadow) = self.trials.shadows.get_mut(name) {
            shadow.not_before = self.now + PAUSE;
        }
    }

    /// Handles the answer of a trial's shadow, or a task that could not be sent.
    pub(super) fn pool_trial(&mut self, id: JobId, actions: &mut Actions) {
        let Some(job) = self.jobs.get(&id) else {
            return;
        };
        let failed = |state: &TaskState| match state {
            TaskState::Failed(why) => Some(why.clone()),
            _ => None,
        };
        let mut tasks = job.tasks.values();
        let Some(task) = tasks.next().filter(|task| !task.missing) else {
            // The shadow is missing, so its file waits for it.
            return self.end_job(id, actions);
        };
        match failed(&task.state) {
            Some(why) => self.send_elsewhere(id, why, actions),
            None => {
                let finished = self.finished(id);
                actions.extend(finished.map(|it| Action::Pool(Box::new(it))));
            }
        }
    }

    /// Handles the end of a trial.
    pub(super) fn trial_ended(&mut self, request_id: RequestId, end: Result<TrialEnd, String>) {
        let now = self.now;
        let Some(shadow) = self.trials.of(request_id) else {
            return;
        };
        let Some((_, path)) = shadow.under_way.take() else {
            return;
        };
        shadow.deaths = 0;
        shadow.pause_until = now + PAUSE;
        // A file with a new verdict is already queued again, and the trial of a removed file is discarded.
        if self.files.id(&path).is_some() && !shadow.waits.contains(&path) {
            shadow.tried.insert(path, end);
        }
    }

    /// Returns the file of a trial that could not be done to the front of the queue.
    pub(super) fn put_trial_back(&mut self, request_id: RequestId) {
        let now = self.now;
        if let Some(shadow) = self.trials.of(request_id)
            && let Some((_, path)) = shadow.under_way.take()
        {
            shadow.put_back(path);
            shadow.not_before = now + PUT_BACK_PAUSE;
        }
    }

    /// Handles the death of a shadow during a trial. Returns whether the file is retried.
    pub(super) fn try_again(&mut self, id: JobId, actions: &mut Actions) -> bool {
        let on_demand = self.jobs.get(&id).and_then(|job| job.on_demand.as_ref());
        let Some(request_id) = on_demand.map(|it| it.request_id).filter(|it| it.is_trial()) else {
            return false;
        };
        let Some(shadow) = self.trials.of(request_id) else {
            return false;
        };
        shadow.deaths += 1;
        if shadow.deaths >= DEATHS {
            return false;
        }
        self.put_trial_back(request_id);
        self.abandon(request_id, actions);
        true
    }
}
