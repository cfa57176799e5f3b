//! State machine of the broker: it works without a clock and without I/O.
//!
//! `State::handle(now, event)` turns events into actions. The loop around it (`qcbus_broker::main_loop`)
//! creates the events and executes the actions. The state machine cannot block, fail or panic on
//! input, so all of it can be tested with tables.

mod bundles;
mod changes;
mod checking;
mod children;
mod delivering;
mod draining;
mod early;
mod ending;
mod files;
mod finishing;
mod jobs;
mod missing;
mod on_demand;
mod outcome;
mod pending_findings;
mod quarantine;
mod queue;
mod readiness;
mod registration;
mod registry;
mod reported;
mod reporters;
mod rests_on;
mod retries;
mod status;
mod trials;
mod upgrades;
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
use qcbus_messages::{Digest, JobId, Role};
use qcbus_types::{
    Action, Demand, Epoch, Event, Input, Judged, Launch, Notice, Reported, RequestId, SessionId,
    Settings, Stamp,
};

use bundles::Bundle;
use children::Child;
use draining::Retired;
use early::ReadingEnd;
use files::Files;
use jobs::ActiveJob;
use on_demand::OnDemandChecks;
use registration::Changes;
use registry::Requirements;
use reporters::Reporter;
use status::Rate;
pub use status::Summary;
use trials::Trials;
use waits::Waiter;

/// Actions that follow from one event.
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
    /// Recent registration changes of bundles, by name.
    changes: BTreeMap<String, Changes>,
    sessions: BTreeMap<SessionId, (Role, Arc<str>)>,
    children: BTreeMap<String, Child>,
    retired: BTreeMap<SessionId, Retired>,
    /// All stale children have joined or were killed.
    stale_children_are_gone: bool,
    waiters: Vec<Waiter>,
    on_demand_checks: OnDemandChecks,
    trials: Trials,
    config: Digest,
    demand: Arc<dyn Demand>,
    epoch: Epoch,
    requirements: Requirements,
    /// The registry has changed or a required bundle has returned, so active jobs must be adapted.
    reseat: bool,
    phase: Phase,
    scanned: bool,
    preparing: usize,
    storing: usize,
    next_job: u64,
    last_launch: Launch,
    /// Time when unreadable files are retried.
    next_reading: Duration,
    /// Notices, each with the time when it was last valid.
    notices: VecDeque<(Notice, Duration)>,
    rate: Rate,
    judged_once: bool,
    /// Files that a run has read before its bundles joined.
    read_early: Vec<(JobId, ReadingEnd)>,
    /// Time until which the notice about missing room is not repeated.
    mute_room_until: Duration,
    mute_hindered_until: Duration,
    mute_unwritten_until: Duration,
    /// Files that found no place on the bus, in order. Each job that ends admits one of them.
    crowded: VecDeque<files::FileId>,
    /// Removed files, each with the number of pending journal entries. Until these are written, no
    /// reporter withdraws a report that the journal still contains.
    withdrawing: BTreeMap<Arc<Path>, u32>,
    /// Time since which there has been no room while no job progressed.
    stuck_since: Option<Duration>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Running,
    /// Since this time no new jobs start, and existing jobs are finished.
    Draining(Duration),
    /// Peers were told to leave at this time.
    Leaving(Duration),
    Stopped,
}

/// Maximum number of notices kept for `status`.
const NOTICES: usize = 50;

impl State {
    /// Returns the state of a new broker.
    pub fn new(settings: Settings, config: Digest, demand: Arc<dyn Demand>) -> State {
        // Launches must differ from those of earlier generations, because their children may be adopted.
        let last_launch = Launch::first_of(settings.generation);
        let epoch = Epoch::first_of(settings.numbers);
        let mut state = State {
            settings,
            now: Duration::ZERO,
            files: Files::default(),
            jobs: BTreeMap::new(),
            bundles: BTreeMap::new(),
            reporters: Vec::new(),
            changes: BTreeMap::new(),
            sessions: BTreeMap::new(),
            children: BTreeMap::new(),
            retired: BTreeMap::new(),
            stale_children_are_gone: false,
            waiters: Vec::new(),
            on_demand_checks: OnDemandChecks::new(),
            trials: Trials::default(),
            config,
            demand,
            epoch,
            requirements: Requirements::new(),
            reseat: false,
            phase: Phase::Running,
            scanned: false,
            preparing: 0,
            storing: 0,
            next_job: 0,
            last_launch,
            next_reading: Duration::ZERO,
            notices: VecDeque::new(),
            rate: Rate::default(),
            judged_once: false,
            read_early: Vec::new(),
            mute_room_until: Duration::ZERO,
            mute_hindered_until: Duration::ZERO,
            mute_unwritten_until: Duration::ZERO,
            crowded: VecDeque::new(),
            withdrawing: BTreeMap::new(),
            stuck_since: None,
        };
        state.begin_epoch();
        state
    }

    /// Adds a file from the journal. It counts as present only after a scan has found it.
    pub fn remember(&mut self, path: &Arc<Path>, judged: Judged, delivered: &[(String, Reported)]) {
        let Some(kind) = FileKind::of_path(path) else {
            return;
        };
        let delivered: Vec<(u32, Reported)> = delivered
            .iter()
            .map(|(name, reported)| (self.reporter_index(name), *reported))
            .collect();
        let id = self.files.insert(path, kind, Stamp::default());
        let paths: Vec<Arc<Path>> = judged
            .inputs
            .iter()
            .skip(1)
            .map(|input| input.path.clone())
            .collect();
        self.files.set_dependencies(id, paths);
        if let Some(entry) = self.files.get_mut(id) {
            entry.present = false;
            entry.judged = Some(Arc::new(judged));
            entry.delivered = delivered;
        }
    }

    /// Marks a file from the journal as accepted but not published. It is published when its acceptance is confirmed.
    pub fn remember_unpublished(&mut self, path: &Path) {
        let id = self.files.id(path);
        if let Some(entry) = id.and_then(|id| self.files.get_mut(id)) {
            entry.unpublished = true;
        }
    }

    /// Handles one event and returns the resulting actions. `now` is the time since the start and never decreases.
    pub fn handle(&mut self, now: Duration, event: Event) -> Vec<Action> {
        self.now = self.now.max(now);
        let mut actions = Vec::new();
        match event {
            Event::Settled { path, stamp } => self.written(&path, stamp, &mut actions),
            Event::Present { path } => self.present(&path),
            Event::Unfinished { path, stamp } => self.unfinished(&path, stamp, &mut actions),
            Event::Touched { path, stamp } => self.touched(&path, stamp, &mut actions),
            Event::Vanished { path } => self.vanished(&path, &mut actions),
            Event::OutputsLost { lost } => self.outputs_lost(&lost, &mut actions),
            Event::Scanned => self.scanned(&mut actions),
            Event::Prepared { job, result } => self.was_read(job, result, &mut actions),
            Event::Stored { job, outcome } => self.stored(job, outcome, &mut actions),
            Event::Opened { path } => self.opened(&path, &mut actions),
            Event::Withdrawn { path } => self.withdrawn(&path, &mut actions),
            Event::Hello { session, hello } => self.hello(session, &hello, &mut actions),
            Event::Message { session, message } => {
                if !self.message(session, message, &mut actions) {
                    return actions;
                }
            }
            Event::Garbage { session, what } => self.garbage(session, &what, &mut actions),
            Event::Gone { session } => self.gone(session, "its process has ended", &mut actions),
            Event::Undeliverable { session, job, why } => {
                self.undeliverable(session, job, why, &mut actions);
            }
            Event::Exited { launch, end } => self.exited(launch, &end, &mut actions),
            Event::Configured { digest, demand } => self.configured(digest, demand, &mut actions),
            Event::Children { specs } => {
                self.set_children(specs, &mut actions);
                self.dismiss_on_demand("its bundles have changed", &mut actions);
            }
            Event::Wait {
                request_id,
                path,
                stamp,
                unwatched,
                until,
            } => {
                self.wait(request_id, &path, stamp, unwatched, until, &mut actions);
            }
            Event::Check { path, on_demand } => self.on_demand(&path, on_demand, &mut actions),
            Event::Pooled { job, outcome } => self.pooled(job, outcome, &mut actions),
            Event::ClientLeft { request_id } => self.client_left(request_id, &mut actions),
            Event::RemoveBundle { request_id, name } => {
                self.removal(request_id, &name, &mut actions);
            }
            Event::Drain => self.drain(),
            Event::Tick => self.tick(&mut actions),
        }
        self.hear_what_was_read_early(&mut actions);
        self.follow_registry(&mut actions);
        self.dispatch_all(&mut actions);
        self.pump(&mut actions);
        self.pump_trials(&mut actions);
        self.store_finished(&mut actions);
        self.wind_down(&mut actions);
        actions
    }

    /// Forgets the requests of a client that has disconnected.
    fn client_left(&mut self, request_id: RequestId, actions: &mut Actions) {
        self.waiters.retain(|it| it.request_id() != request_id);
        self.abandon(request_id, actions);
    }

    /// Handles a message of a peer. Returns `false` if it has no effect on other peers. This holds
    /// for most messages of bundles, which arrive hundreds of times per file.
    fn message(
        &mut self,
        session: SessionId,
        message: qcbus_messages::FromPeer,
        actions: &mut Actions,
    ) -> bool {
        match self.sessions.get(&session).cloned() {
            Some((Role::Bundle, name)) => return self.bundle_says(&name, message, actions),
            Some((Role::Reporter, name)) => self.reporter_says(&name, message, actions),
            None => self.retired_says(session, &message, actions),
        }
        true
    }

    fn garbage(&mut self, session: SessionId, what: &str, actions: &mut Actions) {
        match self.sessions.get(&session).cloned() {
            Some((Role::Bundle, name)) => {
                self.bundle_fails(&name, &format!("it sent invalid data: {what}"), actions);
            }
            Some((Role::Reporter, name)) => {
                self.reporter_died(&name, &format!("it sent invalid data: {what}"), actions);
            }
            None => actions.push(Action::Disconnect { session }),
        }
    }

    fn gone(&mut self, session: SessionId, why: &str, actions: &mut Actions) {
        if self.retired.remove(&session).is_some() {
            self.retired_has_gone(session, actions);
        }
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
            self.retired_has_gone(session, actions);
            actions.push(Action::Disconnect { session });
        }
    }

    fn configured(&mut self, digest: Digest, demand: Arc<dyn Demand>, actions: &mut Actions) {
        if digest == self.config {
            return;
        }
        self.config = digest;
        self.demand = demand;
        self.dismiss_on_demand("its configuration has changed", actions);
        self.begin_epoch();
        // Active checks use the old configuration, so they start again.
        for id in self.under_way() {
            self.begin_anew(id, actions);
        }
    }

    /// Checks whether verdicts may be given. Expected bundles first have a limited time to join.
    fn may_judge(&mut self) -> bool {
        if self.phase != Phase::Running {
            return false;
        }
        if !self.judged_once {
            self.judged_once = self.now >= self.settings.collect && self.children_settled();
            if self.judged_once {
                self.reseat = true;
            }
        }
        self.judged_once
    }

    fn tick(&mut self, actions: &mut Actions) {
        self.watch_children(actions);
        self.kill_what_did_not_return(actions);
        self.accept_registrations(actions);
        self.watch_bundles(actions);
        self.watch_reporters(actions);
        self.fail_missing();
        self.read_again_what_was_unreadable();
        self.settle_reported(actions);
        self.expire_waits(actions);
    }

    /// Returns all inputs of the verdict on a file as they were read. An active job takes
    /// precedence over the last verdict.
    pub fn inputs_of(&self, path: &Path) -> Vec<Input> {
        let Some(entry) = self.files.id(path).and_then(|id| self.files.get(id)) else {
            return Vec::new();
        };
        let job = match entry.stage() {
            files::Stage::Active(job) => self.jobs.get(job),
            _ => None,
        };
        let coming = job.and_then(|job| Some(&job.prepared.as_ref()?.inputs));
        let last = entry.judged.as_ref().map(|judged| &judged.inputs);
        coming.or(last).cloned().unwrap_or_default()
    }

    /// Returns all paths that verdicts depend on, each with the stamp under which it was read.
    pub fn dependencies(&self) -> Vec<(Arc<Path>, Option<Stamp>)> {
        let files = self.files.iter().map(|(_, entry)| &entry.path);
        let inputs = files.flat_map(|path| self.inputs_of(path).into_iter().skip(1));
        inputs.map(|it| (it.path, it.content.stamp())).collect()
    }

    /// Checks whether the first scan is complete.
    pub fn has_looked(&self) -> bool {
        self.scanned
    }

    fn notice(&mut self, notice: Notice, actions: &mut Actions) {
        if let Some((last, at)) = self.notices.back_mut()
            && *last == notice
        {
            *at = self.now;
            return;
        }
        if self.notices.len() >= NOTICES {
            self.notices.pop_front();
        }
        self.notices.push_back((notice.clone(), self.now));
        actions.push(Action::Notice(notice));
    }
}
