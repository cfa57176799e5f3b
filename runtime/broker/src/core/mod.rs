//! The heart of the broker: a state machine without a clock and without I/O.
//!
//! `State::handle(now, event)` turns everything that can happen into what is to be done. The loop
//! around it (`crate::engine`) turns the world into events and carries the actions out. Nothing
//! in here can block, fail or panic on input, and everything can be tested as a table.

mod action;
mod bundles;
mod children;
mod event;
mod files;
mod jobs;
mod outcome;
mod reporters;
mod settings;
mod staging;
mod status;
mod types;
mod waits;

#[cfg(test)]
mod reporter_tests;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_messages::{Digest, JobId, Role, ToPeer};

pub use action::Action;
pub use event::Event;
pub use files::{FileId, Priority, Stage};
pub(crate) use outcome::weight;
pub use settings::Settings;
pub use types::*;

use bundles::Bundle;
use children::{Child, Retired};
use files::Files;
use jobs::ActiveJob;
use reporters::Reporter;
use status::Rate;
use waits::Waiter;

/// What one event makes necessary.
type Actions = Vec<Action>;

/// The state machine.
#[derive(Debug)]
pub struct State {
    settings: Settings,
    now: Duration,
    files: Files,
    jobs: BTreeMap<JobId, ActiveJob>,
    bundles: BTreeMap<String, Bundle>,
    reporters: Vec<Reporter>,
    sessions: BTreeMap<SessionId, (Role, String)>,
    children: BTreeMap<String, Child>,
    retired: BTreeMap<SessionId, Retired>,
    waiters: Vec<Waiter>,
    config: Digest,
    demand: Arc<dyn Demand>,
    phase: Phase,
    scanned: bool,
    preparing: usize,
    storing: usize,
    next_job: u64,
    next_launch: u64,
    notices: VecDeque<String>,
    rate: Rate,
    judged_once: bool,
    /// Until then nobody need be told again that there is no room.
    mute_room_until: Duration,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Running,
    /// No new jobs since then; what is there is finished.
    Draining(Duration),
    /// Peers have been told to go.
    Leaving(Duration),
    Stopped,
}

/// How long peers may take to leave at the end.
const GOODBYE_LIMIT: Duration = Duration::from_secs(3);

/// Notices kept for `status`.
const NOTICES: usize = 50;

impl State {
    /// A broker that knows nothing yet.
    pub fn new(settings: Settings, config: Digest, demand: Arc<dyn Demand>) -> State {
        // Launch numbers differ from those of earlier generations, whose children may be adopted.
        let next_launch = (settings.generation << 20) + 1;
        State {
            settings,
            now: Duration::ZERO,
            files: Files::default(),
            jobs: BTreeMap::new(),
            bundles: BTreeMap::new(),
            reporters: Vec::new(),
            sessions: BTreeMap::new(),
            children: BTreeMap::new(),
            retired: BTreeMap::new(),
            waiters: Vec::new(),
            config,
            demand,
            phase: Phase::Running,
            scanned: false,
            preparing: 0,
            storing: 0,
            next_job: 0,
            next_launch,
            notices: VecDeque::new(),
            rate: Rate::default(),
            judged_once: false,
            mute_room_until: Duration::ZERO,
        }
    }

    /// Puts in what the journal knows of a file. It counts as present only once a scan has seen it.
    pub fn remember(&mut self, path: &Arc<Path>, judged: Judged, delivered: &[(String, JobId)]) {
        let Some(kind) = FileKind::of_path(path) else {
            return;
        };
        let delivered: Vec<(u32, JobId)> = delivered
            .iter()
            .map(|(name, job)| (self.reporter_index(name), *job))
            .collect();
        let id = self.files.insert(path, kind, Stamp::default());
        let paths: Vec<Arc<Path>> = judged
            .inputs
            .iter()
            .skip(1)
            .map(|input| input.path.clone())
            .collect();
        self.files.set_dependencies(id, &[], &paths);
        if let Some(entry) = self.files.get_mut(id) {
            entry.present = false;
            entry.judged = Some(Arc::new(judged));
            entry.delivered = delivered;
        }
    }

    /// Takes one event and says what is to be done. `now` is the time since the start and never
    /// runs backwards.
    pub fn handle(&mut self, now: Duration, event: Event) -> Vec<Action> {
        self.now = self.now.max(now);
        let mut actions = Vec::new();
        match event {
            Event::Settled { path, stamp } => self.settled(&path, stamp),
            Event::Present { path } => self.present(&path),
            Event::Touched { path, stamp } => self.touched(&path, stamp),
            Event::Vanished { path } => self.vanished(&path, &mut actions),
            Event::Scanned => self.scanned(&mut actions),
            Event::Prepared { job, result } => self.prepared(job, result, &mut actions),
            Event::Stored { job, outcome } => self.stored(job, outcome, &mut actions),
            Event::Hello { session, hello } => self.hello(session, &hello, &mut actions),
            Event::Message { session, message } => match self.sessions.get(&session).cloned() {
                Some((Role::Bundle, name)) => self.bundle_says(&name, message, &mut actions),
                Some((Role::Reporter, name)) => self.reporter_says(&name, message, &mut actions),
                None => self.retired_says(session, &message, &mut actions),
            },
            Event::Garbage { session, what } => self.garbage(session, &what, &mut actions),
            Event::Gone { session } => self.gone(session, "its process has died", &mut actions),
            Event::Undeliverable { session, job, why } => {
                self.undeliverable(session, job, why, &mut actions);
            }
            Event::Exited {
                launch,
                how,
                success,
            } => {
                self.exited(launch, &how, success, &mut actions);
            }
            Event::Configured { digest, demand } => self.configured(digest, demand, &mut actions),
            Event::Children { specs } => self.set_children(specs, &mut actions),
            Event::Wait {
                ticket,
                path,
                stamp,
                unwatched,
                timeout,
            } => {
                self.wait(ticket, &path, stamp, unwatched, timeout, &mut actions);
            }
            Event::Drain => self.drain(),
            Event::Tick => self.tick(&mut actions),
        }
        self.dispatch_all(&mut actions);
        self.pump(&mut actions);
        self.wind_down(&mut actions);
        actions
    }

    /// A file is there and may still be written to.
    fn present(&mut self, path: &Arc<Path>) {
        let known = self.files.id(path).and_then(|id| self.files.get_mut(id));
        if let Some(entry) = known {
            entry.present = true;
        }
    }

    /// Whether verdicts depend on a file that is not there for a verdict of its own.
    pub fn is_only_a_dependency(&self, path: &Path) -> bool {
        let entry = self.files.id(path).and_then(|id| self.files.get(id));
        !entry.is_some_and(|it| it.present) && !self.files.dependents(path).is_empty()
    }

    /// A file is there and quiet: whose verdict depends on it?
    fn touched(&mut self, path: &Arc<Path>, stamp: Stamp) {
        for dependent in self.files.dependents(path) {
            let differs = self
                .files
                .get(dependent)
                .and_then(|entry| entry.judged.as_ref())
                .is_none_or(|judged| {
                    let input = judged.inputs.iter().find(|input| input.path == *path);
                    judged.racy || input.and_then(|it| it.content).map(|it| it.0) != Some(stamp)
                });
            if differs {
                self.doubt(dependent);
            }
        }
    }

    /// A file is there and quiet.
    fn settled(&mut self, path: &Arc<Path>, stamp: Stamp) {
        self.touched(path, stamp);
        let Some(kind) = FileKind::of_path(path) else {
            return;
        };
        let id = self
            .files
            .id(path)
            .unwrap_or_else(|| self.files.insert(path, kind, stamp));
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        let known = entry
            .judged
            .as_ref()
            .and_then(|it| it.inputs.first().and_then(|root| root.content));
        let racy = entry.judged.as_ref().is_some_and(|it| it.racy);
        let same = entry.present
            && entry.stamp == stamp
            && !racy
            && (known.map(|it| it.0) == Some(stamp) || !matches!(entry.stage(), Stage::Idle));
        entry.present = true;
        entry.stamp = stamp;
        if !same {
            self.changed(id);
        }
    }

    /// Something that the verdict on a file depends on is not what it was. The file's own stamp
    /// does not tell, so the verdict is marked: it stands only after everything was read again.
    fn doubt(&mut self, id: FileId) {
        if let Some(entry) = self.files.get_mut(id) {
            entry.dirty = true;
        }
        self.changed(id);
    }

    /// The file, or something it depends on, is not what it was.
    fn changed(&mut self, id: FileId) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        if !entry.present {
            return;
        }
        entry.not_before = Duration::ZERO;
        match entry.stage() {
            Stage::Active(_) => entry.dirty = true,
            Stage::Idle | Stage::Waiting(..) => self.files.enqueue(id, Priority::Fresh, self.now),
        }
    }

    fn vanished(&mut self, path: &Arc<Path>, actions: &mut Actions) {
        for dependent in self.files.dependents(path) {
            self.doubt(dependent);
        }
        if let Some(id) = self.files.id(path) {
            self.vanished_file(id, actions);
        }
    }

    /// A file has gone: its result is withdrawn once no job of it is left.
    fn vanished_file(&mut self, id: FileId, actions: &mut Actions) {
        let Some(entry) = self.files.get_mut(id) else {
            return;
        };
        entry.present = false;
        if let Stage::Active(job) = *entry.stage() {
            // Nothing is stored for a file that is not there; a job at the writers' will notice.
            if self
                .jobs
                .get(&job)
                .is_some_and(|it| it.stage == jobs::JobStage::Checking)
            {
                self.end_job(job, actions);
            }
            return;
        }
        let path = entry.path.clone();
        let reporters = self.void_reports(id);
        self.files.remove(id);
        actions.push(Action::Withdraw {
            path: path.clone(),
            reporters,
        });
        self.deliver_everything(actions);
        self.answer_gone(&path, actions);
    }

    /// The first scan is complete: what the journal knew and the scan did not see has gone.
    fn scanned(&mut self, actions: &mut Actions) {
        self.scanned = true;
        let gone: Vec<FileId> = self
            .files
            .iter()
            .filter(|(_, entry)| !entry.present)
            .map(|(id, _)| id)
            .collect();
        for id in gone {
            self.vanished_file(id, actions);
        }
    }

    fn garbage(&mut self, session: SessionId, what: &str, actions: &mut Actions) {
        match self.sessions.get(&session).cloned() {
            Some((Role::Bundle, name)) => {
                self.bundle_fails(
                    &name,
                    &format!("it sends what is no message: {what}"),
                    actions,
                );
            }
            Some((Role::Reporter, name)) => {
                self.reporter_died(
                    &name,
                    &format!("it sends what is no message: {what}"),
                    actions,
                );
            }
            None => actions.push(Action::Disconnect { session }),
        }
    }

    fn gone(&mut self, session: SessionId, why: &str, actions: &mut Actions) {
        self.retired.remove(&session);
        match self.sessions.get(&session).cloned() {
            Some((Role::Bundle, name)) => self.bundle_died(&name, why, actions),
            Some((Role::Reporter, name)) => self.reporter_died(&name, why, actions),
            None => {}
        }
    }

    fn retired_says(
        &mut self,
        session: SessionId,
        message: &qcbus_messages::FromPeer,
        actions: &mut Actions,
    ) {
        if *message == qcbus_messages::FromPeer::Leaving {
            self.retired.remove(&session);
            actions.push(Action::Disconnect { session });
        }
    }

    fn configured(&mut self, digest: Digest, demand: Arc<dyn Demand>, actions: &mut Actions) {
        if digest == self.config {
            return;
        }
        self.config = digest;
        self.demand = demand;
        // What is being checked is checked under the old configuration: it starts anew.
        let ids: Vec<JobId> = self
            .jobs
            .iter()
            .filter(|(_, job)| {
                matches!(
                    job.stage,
                    jobs::JobStage::Checking | jobs::JobStage::Finished(_)
                )
            })
            .map(|(id, _)| *id)
            .collect();
        for id in ids {
            if let Some(entry) = self
                .jobs
                .get(&id)
                .and_then(|job| self.files.get_mut(job.file))
            {
                entry.dirty = true;
            }
            self.end_job(id, actions);
        }
        self.requeue_outdated();
    }

    /// Whether verdicts may be given: not before those who should take part have had their time.
    fn may_judge(&mut self) -> bool {
        if self.phase != Phase::Running {
            return false;
        }
        if !self.judged_once {
            self.judged_once = self.now >= self.settings.collect && self.children_settled();
            if self.judged_once {
                self.requeue_outdated();
            }
        }
        self.judged_once
    }

    fn is_current(&self, id: FileId) -> bool {
        let current = |entry: &files::FileEntry| {
            entry
                .judged
                .as_ref()
                .is_some_and(|judged| self.stands(entry.kind, judged))
        };
        // Without it, a bundle that is away would have its files judged over and over.
        self.files.get(id).is_some_and(|entry| {
            current(entry)
                || entry
                    .judged
                    .as_ref()
                    .is_some_and(|it| it.config == self.config)
        })
    }

    fn tick(&mut self, actions: &mut Actions) {
        self.watch_children(actions);
        self.watch_bundles(actions);
        self.watch_reporters(actions);
        self.fail_absent(actions);
        self.expire_waits(actions);
    }

    fn draining(&self) -> bool {
        self.phase != Phase::Running
    }

    fn drain(&mut self) {
        if self.phase == Phase::Running {
            self.phase = Phase::Draining(self.now);
        }
    }

    /// Moves the end on: jobs first, then reporters, then goodbye.
    fn wind_down(&mut self, actions: &mut Actions) {
        let quiet = self.jobs.is_empty() && self.all_delivered();
        if self.settings.once
            && self.scanned
            && quiet
            && self.files.is_quiet()
            && !self.reporters_coming()
        {
            self.drain();
        }
        match self.phase {
            Phase::Draining(since) => {
                let overdue = self.now.saturating_sub(since) > self.settings.drain_limit;
                if quiet || overdue {
                    self.say_goodbye(actions);
                }
            }
            Phase::Leaving(since) => {
                let alone = self.sessions.values().all(|(_, name)| !self.is_ours(name));
                if !alone && self.now.saturating_sub(since) > GOODBYE_LIMIT {
                    self.kill_ours(actions);
                }
                if alone || self.now.saturating_sub(since) > GOODBYE_LIMIT {
                    self.phase = Phase::Stopped;
                    self.end_waits(actions);
                    actions.push(Action::Stop);
                }
            }
            Phase::Running | Phase::Stopped => {}
        }
    }

    /// Whether a reporter that was to be started may still join.
    fn reporters_coming(&self) -> bool {
        self.children
            .iter()
            .any(|(name, child)| child.spec.role == Role::Reporter && self.child_is_coming(name))
    }

    fn say_goodbye(&mut self, actions: &mut Actions) {
        self.phase = Phase::Leaving(self.now);
        for (session, (_, name)) in &self.sessions {
            if self.is_ours(name) {
                actions.push(Action::Send {
                    session: *session,
                    message: ToPeer::Drain,
                });
            }
        }
    }

    /// Kills what a broker started and what does not leave.
    fn kill_ours(&self, actions: &mut Actions) {
        for (role, name) in self.sessions.values() {
            let process = match role {
                Role::Bundle => self.bundles.get(name).map(|it| (it.launch, it.pid)),
                Role::Reporter => self.reporter_named(name).map(|it| (it.launch, it.pid)),
            };
            if let Some((Some(launch), pid)) = process {
                actions.push(Action::Kill {
                    launch: Some(launch),
                    pid,
                });
            }
        }
    }

    /// Everything that the verdict on a file depends on, as it was read.
    pub fn inputs_of(&self, path: &Path) -> Vec<Input> {
        let entry = self.files.id(path).and_then(|id| self.files.get(id));
        let judged = entry.and_then(|entry| entry.judged.as_ref());
        judged
            .map(|judged| judged.inputs.clone())
            .unwrap_or_default()
    }

    /// Whether a broker started this peer, this one or a former one.
    fn is_ours(&self, name: &str) -> bool {
        self.bundles.get(name).is_some_and(|it| it.launch.is_some())
            || self
                .reporter_named(name)
                .is_some_and(|it| it.launch.is_some())
    }

    fn notice(&mut self, text: String, actions: &mut Actions) {
        if self.notices.back() != Some(&text) {
            if self.notices.len() >= NOTICES {
                self.notices.pop_front();
            }
            self.notices.push_back(text.clone());
            actions.push(Action::Notice(text));
        }
    }
}
