//! Trials: what shadows find. A *shadow* is a bundle of a manifest that looks at every file and has no weight in any
//! verdict, so that somebody sees what it would change before it counts.
//!
//! A trial is an errand of the broker's own. It begins after the verdict on its file has been stored, one at a time for
//! each shadow, and gives way to everything else: it takes no place among the jobs, holds up no findings, and ends when
//! the bus has no room for others. Nothing of it is in a result, in the journal or behind the gate. All that is known
//! of trials is in memory, and the results of those that found something in the directory of state; a broker that is
//! started anew tries everything again.

mod told;

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::{JobId, Verdict};

use super::action::Action;
use super::files::{FileId, Stage};
use super::jobs::TaskState;
use super::on_demand::OnDemand;
use super::required_set::{Requirement, VersionDigest};
use super::types::RequestId;
use super::{Actions, Phase, State};

/// Tickets of clients count up from 1, those of trials from here.
const FIRST_REQUEST_ID: u64 = 1 << 63;

/// While files wait for their verdicts, the pause between two trials of a shadow: it gets on all the same where a farm
/// never rests.
const PAUSE: Duration = Duration::from_millis(500);

/// The pause after a trial that was not to be.
const PUT_BACK_PAUSE: Duration = Duration::from_secs(1);

/// Deaths of a shadow with one file, until that is not tried again.
const DEATHS: u8 = 2;

/// What a shadow found in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrialEnd {
    /// What it adds to the verdict of others: rejected by an error, undetermined by a checker that failed, else nothing.
    pub adds: Verdict,
    /// The verdict if nobody else judged.
    pub alone: Verdict,
    /// Its issues by level: errors, warnings, information.
    pub counts: [u64; 3],
    /// Which of its checkers failed, and why.
    pub why: Vec<String>,
    /// Where its result lies; nothing where it found nothing.
    pub result: Option<PathBuf>,
}

impl RequestId {
    /// Whether it is of no client, but of a trial of the broker's own.
    pub(super) fn is_trial(self) -> bool {
        self.0 >= FIRST_REQUEST_ID
    }
}

/// The shadows that are wanted, by name.
#[derive(Debug, Default)]
pub(super) struct Trials {
    shadows: BTreeMap<String, Shadow>,
    last_request_id: u64,
}

#[derive(Debug, Default)]
struct Shadow {
    /// As what it has tried.
    version_digest: Option<VersionDigest>,
    waiting: VecDeque<Arc<Path>>,
    /// The same, to be found.
    waits: HashSet<Arc<Path>>,
    under_way: Option<(RequestId, Arc<Path>)>,
    /// How often it has died in a row with the file that is first in line.
    deaths: u8,
    tried: BTreeMap<Arc<Path>, Result<TrialEnd, String>>,
    not_before: Duration,
    /// Before that only when nobody waits.
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
    /// How many are under way.
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
        RequestId(FIRST_REQUEST_ID + self.last_request_id)
    }
}

impl State {
    /// Whether a bundle is wanted as a shadow.
    pub(super) fn is_shadow(&self, name: &str) -> bool {
        self.children.get(name).is_some_and(|it| it.spec.shadow)
    }

    /// The shadow that a job is a trial of, if it is one.
    pub fn tried_out(&self, job: JobId) -> Option<&str> {
        let on_demand = self.jobs.get(&job)?.on_demand.as_ref()?;
        let name = on_demand
            .bundles
            .first()
            .filter(|_| on_demand.request_id.is_trial());
        name.map(String::as_str)
    }

    /// The children are others: who is a shadow by now need not judge, and who no longer is one is forgotten as such.
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

    /// A shadow has said what it checks: unless it has tried everything as this already, it begins.
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

    /// A file has a verdict: the shadows are to look at it. Whether they take such files is asked when it is their turn,
    /// for one that is away has not said so.
    pub(super) fn let_shadows_try(&mut self, file: FileId) {
        let Some(entry) = self.files.get(file) else {
            return;
        };
        // One that has never said what it checks gets all files when it does.
        let ready = self.trials.shadows.values_mut();
        for shadow in ready.filter(|it| it.version_digest.is_some()) {
            shadow.tried.remove(&entry.path);
            shadow.wait(&entry.path);
        }
    }

    /// A file has gone, and with it what was found in it.
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

    /// What a shadow has to look at in files of a kind; empty when that is nothing, or nobody knows.
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

    /// Begins the trials whose time it is.
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

    /// Begins with the first file in line that has a verdict and is at rest.
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
            // One without a verdict is to be tried when it has got one.
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
        // None of them is at rest.
        if let Some(shadow) = self.trials.shadows.get_mut(name) {
            shadow.not_before = self.now + PAUSE;
        }
    }

    /// The shadow of a trial has answered, or was not to be asked.
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
            // It is not there: its file waits for it.
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

    /// A trial has come to its end.
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
        // One that was judged again meanwhile is in line again, and one that has gone is of no interest.
        if self.files.id(&path).is_some() && !shadow.waits.contains(&path) {
            shadow.tried.insert(path, end);
        }
    }

    /// A trial was not to be; its file is the next.
    pub(super) fn put_trial_back(&mut self, request_id: RequestId) {
        let now = self.now;
        if let Some(shadow) = self.trials.of(request_id)
            && let Some((_, path)) = shadow.under_way.take()
        {
            shadow.put_back(path);
            shadow.not_before = now + PUT_BACK_PAUSE;
        }
    }

    /// A shadow has died with the file of a trial. Whether it is tried again.
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

    /// There is no room on the bus for a job: those of trials give theirs back.
    pub(super) fn trials_give_way(&mut self, to: JobId, actions: &mut Actions) {
        let is_trial = self.jobs.get(&to).is_some_and(|job| job.is_trial());
        if !is_trial {
            self.end_trials(actions);
        }
    }

    /// Ends the trials that are under way; their files wait again.
    pub(super) fn end_trials(&mut self, actions: &mut Actions) {
        let names: Vec<String> = self.trials.shadows.keys().cloned().collect();
        for name in names {
            self.end_trial_of(&name, actions);
        }
    }

    fn end_trial_of(&mut self, name: &str, actions: &mut Actions) {
        let shadow = self.trials.shadows.get(name);
        let under_way = shadow.and_then(|it| it.under_way.as_ref());
        if let Some((request_id, _)) = under_way.cloned() {
            self.put_trial_back(request_id);
            self.abandon(request_id, actions);
        }
    }
}
