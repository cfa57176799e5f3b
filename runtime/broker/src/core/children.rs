//! Children: the bundles and reporters that the broker itself keeps running.

use std::collections::VecDeque;
use std::time::Duration;

use qcbus_messages::Role;

use super::action::Action;
use super::draining::Retired;
use super::notice::Notice;
use super::types::{ChildEnd, ChildSpec, Launch, Restart, SessionId};
use super::upgrades::Upgrade;
use super::{Actions, State};

/// A child by name.
#[derive(Debug)]
pub(super) struct Child {
    pub spec: ChildSpec,
    pub state: ChildState,
    /// Starts within the restart window.
    starts: VecDeque<Duration>,
    /// Failures in a row.
    pub failures: u32,
    /// Why it does not get as far as to join; nobody waits for it meanwhile.
    stuck: Option<String>,
    /// Why the process that is wanted was last not ready, since it was last ready or became wanted.
    pub failure: Option<String>,
    pub restarts: u32,
    /// A newer process that will take over once it has joined.
    pub upgrade: Option<Upgrade>,
}

/// Where a child stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChildState {
    /// To be started then.
    Due(Duration),
    /// Started, has not said hello.
    Starting(Launch, Duration),
    /// It has joined. One that a former broker started has a launch that this one does not know.
    Joined,
    /// It failed too often; to be started once more then.
    GaveUp(Duration),
    /// It ended and is not to be started again.
    Ended,
}

/// How long a child may take until it says hello.
const START_LIMIT: Duration = Duration::from_secs(15);
/// The same of one that runs programs first, which may have to come from a slow disk.
const SLOW_START_LIMIT: Duration = Duration::from_secs(120);

/// Failures in a row, without ever having joined, after which nobody waits for a child.
const STUCK_AFTER: u32 = 3;

impl Child {
    fn new(spec: ChildSpec, due: Duration) -> Child {
        Child {
            spec,
            state: ChildState::Due(due),
            starts: VecDeque::new(),
            failures: 0,
            stuck: None,
            failure: None,
            restarts: 0,
            upgrade: None,
        }
    }

    /// Takes a new manifest. A process that runs goes on until a newer one has joined, and for good when it is what
    /// the manifest wants (somebody has taken back what he had changed); one that was started and has not
    /// joined is of the manifest before, and is returned: nobody wants it.
    fn respecify(
        &mut self,
        spec: ChildSpec,
        runs: Option<Launch>,
        now: Duration,
    ) -> Option<Launch> {
        let unwanted = self.starting().map(|(launch, _)| launch);
        self.spec = spec;
        self.failures = 0;
        self.stuck = None;
        self.failure = None;
        self.starts.clear();
        let is_wanted = runs.is_some_and(|it| it.is_of(&self.spec));
        match self.state {
            ChildState::Joined => self.upgrade = (!is_wanted).then_some(Upgrade::Due(now)),
            _ => self.state = ChildState::Due(now),
        }
        unwanted
    }

    /// How long it may take until it says hello.
    pub fn start_limit(&self) -> Duration {
        match self.spec.slow_start {
            true => SLOW_START_LIMIT,
            false => START_LIMIT,
        }
    }

    /// The process that was started and has not joined, and since when.
    fn starting(&self) -> Option<(Launch, Duration)> {
        match (self.state, self.upgrade) {
            (ChildState::Starting(launch, since), _)
            | (_, Some(Upgrade::Starting(launch, since))) => Some((launch, since)),
            _ => None,
        }
    }

    /// The process that is to take over from one that has joined and is not the one wanted.
    fn successor(&self, now: Duration) -> Upgrade {
        match (self.starting(), self.state) {
            (Some((launch, since)), _) => Upgrade::Starting(launch, since),
            (None, ChildState::Due(at) | ChildState::GaveUp(at)) => Upgrade::Due(at.max(now)),
            (None, _) => Upgrade::Due(now),
        }
    }

    /// The pause before the next start; children that fell together should not get up together.
    pub fn pause(&self, backoff: Duration, most: Duration) -> Duration {
        let doubled = backoff * 2_u32.saturating_pow(self.failures.saturating_sub(1).min(16));
        let pause = doubled.min(most);
        pause + pause.mul_f64(f64::from(jitter_of(&self.spec.name, self.restarts)) / 1024.0)
    }
}

impl State {
    /// The children that should run: starts what is new, replaces what has changed, drains what
    /// is no longer wanted.
    pub(super) fn set_children(&mut self, specs: Vec<ChildSpec>, actions: &mut Actions) {
        let unwanted = |name: &&String| specs.iter().all(|it| it.name != **name);
        let gone: Vec<String> = self.children.keys().filter(unwanted).cloned().collect();
        for name in gone {
            self.dismiss(&name, actions);
        }
        for spec in specs.iter().filter(|it| it.role == Role::Reporter) {
            // Known from now on, so that it hears of files that go before it has joined.
            self.reporter_index(&spec.name);
        }
        let due = self.now.max(self.settings.collect);
        for spec in specs {
            let runs = self.runs_as(&spec.name);
            match self.children.get_mut(&spec.name) {
                Some(child) if child.spec == spec => {}
                Some(child) => {
                    let unwanted = child.respecify(spec, runs, self.now);
                    actions.extend(unwanted.map(Action::kill_unjoined));
                }
                None => {
                    let name = spec.name.clone();
                    self.children.insert(name, Child::new(spec, due));
                }
            }
        }
        self.enrol_children(actions);
        self.watch_children(actions);
    }

    /// What the process of this name that has joined was started as.
    fn runs_as(&self, name: &str) -> Option<Launch> {
        let bundle = self.bundles.get(name).filter(|it| it.session.is_some());
        let reporter = self.reporter_named(name).filter(|it| it.session.is_some());
        bundle
            .and_then(|it| it.launch)
            .or_else(|| reporter.and_then(|it| it.launch))
    }

    /// A child is no longer wanted: what runs of it is told to go.
    fn dismiss(&mut self, name: &str, actions: &mut Actions) {
        let Some(child) = self.children.remove(name) else {
            return;
        };
        let starting = child.starting();
        actions.extend(starting.map(|(launch, _)| Action::kill_unjoined(launch)));
        self.drain_peer(name, actions);
    }

    /// A process of a child has said hello. It need not be the one that is wanted: a former broker
    /// may have started it by an older manifest, and of one that was killed the last words may come
    /// now. Then it goes on until the one that is wanted has joined.
    pub(super) fn child_joined(
        &mut self,
        name: &str,
        launch: Option<Launch>,
        version: &str,
        actions: &mut Actions,
    ) {
        let (now, first) = (self.now, Launch::first_of(self.settings.generation));
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        let starting = child.starting();
        if starting.is_some_and(|(wanted, _)| Some(wanted) == launch) {
            child.upgrade = None;
        } else if child.state != ChildState::Joined {
            let as_wanted = child.spec.version.as_deref().is_none_or(|it| it == version);
            let stale_children = |it: Launch| it < first && it.is_of(&child.spec) && as_wanted;
            let goes_on = launch.is_some_and(stale_children);
            if goes_on {
                actions.extend(starting.map(|(launch, _)| Action::kill_unjoined(launch)));
            }
            child.upgrade = (!goes_on).then(|| child.successor(now));
        }
        child.state = ChildState::Joined;
        child.stuck = None;
    }

    /// A child has left as it was told, or of its own will.
    pub(super) fn child_left(&mut self, name: &str) {
        let draining = self.draining();
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        if child.upgrade.take().is_none() {
            child.failure = Some("it took its leave".to_owned());
        }
        child.state = if child.spec.restart == Restart::Always && !draining {
            ChildState::Due(self.now + self.settings.backoff)
        } else {
            ChildState::Ended
        };
    }

    /// A child is down: when is it started again?
    pub(super) fn child_down(
        &mut self,
        name: &str,
        proved: bool,
        why: &str,
        actions: &mut Actions,
    ) {
        let (now, draining) = (self.now, self.draining());
        let settings = &self.settings;
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        // The next start is of the newest manifest anyway.
        match child.upgrade.take() {
            Some(Upgrade::Starting(launch, _)) => actions.push(Action::kill_unjoined(launch)),
            Some(Upgrade::Due(_)) => {}
            // It was the one that is wanted.
            None => child.failure = Some(why.to_owned()),
        }
        if child.spec.restart == Restart::Never || draining {
            child.state = ChildState::Ended;
            return;
        }
        child.failures = if proved { 1 } else { child.failures + 1 };
        let window = settings.restart_window;
        let old = |at: &Duration| now.saturating_sub(*at) > window;
        while child.starts.front().is_some_and(old) {
            child.starts.pop_front();
        }
        if child.starts.len() <= settings.max_restarts as usize || proved {
            let pause = child.pause(settings.backoff, settings.backoff_max);
            child.state = ChildState::Due(now + pause);
            return;
        }
        child.state = ChildState::GaveUp(now + window);
        let (times, seconds) = (child.starts.len(), window.as_secs());
        let name = name.to_owned();
        let why = format!(
            "failed {times} times within {seconds} s and is tried again in {seconds} s: {why}"
        );
        self.notice(Notice::GaveUp { name, why }, actions);
        self.fail_missing();
    }

    /// A child process has ended or could not be started.
    pub(super) fn exited(&mut self, launch: Launch, end: &ChildEnd, actions: &mut Actions) {
        let gone = |it: &(&SessionId, &Retired)| it.1.launch == Some(launch);
        let gone: Vec<SessionId> = self
            .retired
            .iter()
            .filter(gone)
            .map(|(it, _)| *it)
            .collect();
        for session in gone {
            self.retired.remove(&session);
            self.retired_has_gone(session, actions);
        }
        let is_it =
            |child: &Child| matches!(child.state, ChildState::Starting(it, _) if it == launch);
        let mut children = self.children.iter();
        if let Some(name) = children.find_map(|(name, it)| is_it(it).then(|| name.clone())) {
            return self.ended_before_joining(&name, end, actions);
        }
        let mut children = self.children.iter();
        let upgrade = children.find(|(_, child)| child.is_upgraded_by(launch));
        if let Some(name) = upgrade.map(|(name, _)| name.clone()) {
            return self.upgrade_failed(&name, end.how(), actions);
        }
        let bundle = self
            .bundles
            .iter()
            .find(|(_, it)| it.launch == Some(launch) && it.session.is_some());
        if let Some(name) = bundle.map(|(name, _)| name.clone()) {
            self.bundle_died(&name, end.how(), actions);
            return;
        }
        let reporter = self
            .reporters
            .iter()
            .find(|it| it.launch == Some(launch) && it.session.is_some());
        if let Some(name) = reporter.map(|it| it.name.clone()) {
            self.reporter_died(&name, end.how(), actions);
        }
    }

    /// A child did not get as far as to join. Nobody waits for one that cannot be started, has
    /// nothing to do here, or has failed again and again.
    fn ended_before_joining(&mut self, name: &str, end: &ChildEnd, actions: &mut Actions) {
        let there = self
            .bundles
            .get(name)
            .is_some_and(|it| it.session.is_some());
        let (now, most) = (self.now, self.settings.backoff_max);
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        let gives_up = match end {
            ChildEnd::NotStarted(_) => true,
            // It was turned away because another process bears its name, or had nothing to do.
            ChildEnd::Done(_) => !there,
            ChildEnd::Failed(_) => child.failures + 1 >= STUCK_AFTER,
        };
        if gives_up {
            child.stuck = Some(end.how().to_owned());
        }
        child.failure = Some(end.how().to_owned());
        if matches!(end, ChildEnd::Done(_)) && child.spec.restart != Restart::Always {
            child.state = ChildState::Due(now + most);
        } else {
            if !self.draining() {
                self.notice(Notice::ended(name, end.how()), actions);
            }
            self.child_down(name, false, end.how(), actions);
        }
        self.fail_missing();
    }

    /// Starts what is due, and kills what does not get going or does not go.
    pub(super) fn watch_children(&mut self, actions: &mut Actions) {
        if self.draining() {
            return self.kill_overdue(actions);
        }
        let now = self.now;
        let mut late = Vec::new();
        for (name, child) in &mut self.children {
            match child.state {
                ChildState::Due(at) | ChildState::GaveUp(at) if at <= now => {
                    let launch = self.last_launch.next(&child.spec);
                    self.last_launch = launch;
                    child.restarts += u32::from(!child.starts.is_empty());
                    child.starts.push_back(now);
                    child.state = ChildState::Starting(launch, now);
                    let spec = child.spec.clone();
                    actions.push(Action::Spawn { launch, spec });
                }
                ChildState::Starting(launch, since)
                    if now.saturating_sub(since) > child.start_limit() =>
                {
                    late.push((name.clone(), launch));
                }
                _ => {}
            }
            let upgrade = child.watch_upgrade(now, &mut self.last_launch, actions);
            late.extend(upgrade.map(|launch| (name.clone(), launch)));
        }
        for (name, launch) in late {
            self.does_not_join(&name, launch, actions);
        }
        self.kill_overdue(actions);
    }

    fn does_not_join(&mut self, name: &str, launch: Launch, actions: &mut Actions) {
        let why = "it was started and did not join";
        actions.push(Action::kill_unjoined(launch));
        if self.is_successor(name, launch) {
            return self.upgrade_failed(name, why, actions);
        }
        self.notice(Notice::killed(name, why), actions);
        if let Some(child) = self.children.get_mut(name) {
            child.stuck = Some(why.to_owned());
        }
        self.child_down(name, false, why, actions);
        self.fail_missing();
    }

    /// Whether a child of this name is being started, or will be soon.
    pub(super) fn child_is_coming(&self, name: &str) -> bool {
        self.children.get(name).is_some_and(|child| {
            matches!(child.state, ChildState::Due(_) | ChildState::Starting(..))
        })
    }

    /// Whether a child has failed so often that nobody should wait for it.
    pub(super) fn child_gave_up(&self, name: &str) -> bool {
        self.children
            .get(name)
            .is_some_and(|child| matches!(child.state, ChildState::GaveUp(_) | ChildState::Ended))
    }

    /// Why nobody should wait for a child that has not joined, if nobody should.
    pub(super) fn child_cannot_start(&self, name: &str) -> Option<&str> {
        let child = self.children.get(name)?;
        child.stuck.as_deref()
    }

    /// Whether every bundle that was to be started has joined, or has had its chance.
    pub(super) fn children_settled(&self) -> bool {
        let children = self.children.iter();
        let mut bundles = children.filter(|(_, child)| child.spec.judges());
        bundles.all(|(name, _)| {
            let ready = self.bundles.get(name).is_some_and(|it| it.ready);
            ready || self.hopeless(name).is_some()
        })
    }
}

/// A number below 256 that differs from child to child and from start to start, yet is the same
/// in every run: the state machine has no dice.
fn jitter_of(name: &str, restarts: u32) -> u8 {
    name.bytes().fold(restarts.to_le_bytes()[0], |sum, byte| {
        sum.wrapping_mul(31).wrapping_add(byte)
    })
}
