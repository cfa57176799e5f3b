//! Children: the bundles and reporters that the broker itself starts and keeps running.

use std::collections::VecDeque;
use std::time::Duration;

use qcbus_messages::Role;
use qcbus_types::{Action, ChildEnd, ChildSpec, Launch, Notice, Restart, SessionId};

use super::draining::Retired;
use super::upgrades::Upgrade;
use super::{Actions, State};

/// A child, identified by its name.
#[derive(Debug)]
pub(super) struct Child {
    pub spec: ChildSpec,
    pub state: ChildState,
    /// Starts within the restart window.
    starts: VecDeque<Duration>,
    /// Number of consecutive failures.
    pub failures: u32,
    /// Reason why it does not get as far as joining. The broker does not wait for it meanwhile.
    stuck: Option<String>,
    /// Last reason why the wanted process was not ready. It is cleared when the process is ready or
    /// when another process becomes the wanted one.
    pub failure: Option<String>,
    pub restarts: u32,
    /// A newer process that will take over once it has joined.
    pub upgrade: Option<Upgrade>,
}

/// State of a child.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChildState {
    /// It is started at this time.
    Due(Duration),
    /// It was started at this time and has not sent hello yet.
    Starting(Launch, Duration),
    /// It has joined. If a former broker started it, this broker does not know its launch.
    Joined,
    /// It failed too often and is started once more at this time.
    GaveUp(Duration),
    /// It ended and is not started again.
    Ended,
}

/// Maximum time from the start of a child until its hello.
const START_LIMIT: Duration = Duration::from_secs(15);
/// The same limit for a child that first runs other programs, which may come from a slow disk.
const SLOW_START_LIMIT: Duration = Duration::from_secs(120);

/// Number of consecutive failures without joining after which the broker no longer waits for a child.
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

    /// Takes a new manifest. A running process continues until a newer one has joined. It stays for good if it
    /// matches the manifest, because the user has reverted a change. A process that was started and has not joined
    /// belongs to the previous manifest. Its launch is returned, because it is not wanted any more.
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

    /// Returns the maximum time until its hello.
    pub fn start_limit(&self) -> Duration {
        match self.spec.slow_start {
            true => SLOW_START_LIMIT,
            false => START_LIMIT,
        }
    }

    /// Returns the process that was started and has not joined, with its start time.
    fn starting(&self) -> Option<(Launch, Duration)> {
        match (self.state, self.upgrade) {
            (ChildState::Starting(launch, since), _)
            | (_, Some(Upgrade::Starting(launch, since))) => Some((launch, since)),
            _ => None,
        }
    }

    /// Returns the process that must take over from a joined process that is not the wanted one.
    fn successor(&self, now: Duration) -> Upgrade {
        match (self.starting(), self.state) {
            (Some((launch, since)), _) => Upgrade::Starting(launch, since),
            (None, ChildState::Due(at) | ChildState::GaveUp(at)) => Upgrade::Due(at.max(now)),
            (None, _) => Upgrade::Due(now),
        }
    }

    /// Returns the pause before the next start. It varies so that children that failed together do
    /// not restart together.
    pub fn pause(&self, backoff: Duration, most: Duration) -> Duration {
        let doubled = backoff * 2_u32.saturating_pow(self.failures.saturating_sub(1).min(16));
        let pause = doubled.min(most);
        pause + pause.mul_f64(f64::from(jitter_of(&self.spec.name, self.restarts)) / 1024.0)
    }
}

impl State {
    /// Sets the children that must run. Starts new ones, replaces changed ones and drains the others.
    pub(super) fn set_children(&mut self, specs: Vec<ChildSpec>, actions: &mut Actions) {
        let unwanted = |name: &&String| specs.iter().all(|it| it.name != **name);
        let gone: Vec<String> = self.children.keys().filter(unwanted).cloned().collect();
        for name in gone {
            self.dismiss(&name, actions);
        }
        for spec in specs.iter().filter(|it| it.role == Role::Reporter) {
            // The reporter is registered now, so that it also learns of files that are removed before it joins.
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

    /// Returns the launch of the joined process with this name.
    fn runs_as(&self, name: &str) -> Option<Launch> {
        let bundle = self.bundles.get(name).filter(|it| it.session.is_some());
        let reporter = self.reporter_named(name).filter(|it| it.session.is_some());
        bundle
            .and_then(|it| it.launch)
            .or_else(|| reporter.and_then(|it| it.launch))
    }

    /// Removes a child that is not wanted any more and drains its process.
    fn dismiss(&mut self, name: &str, actions: &mut Actions) {
        let Some(child) = self.children.remove(name) else {
            return;
        };
        let starting = child.starting();
        actions.extend(starting.map(|(launch, _)| Action::kill_unjoined(launch)));
        self.drain_peer(name, actions);
    }

    /// Handles the hello of a child's process. It may be another process than the wanted one. A
    /// former broker may have started it from an older manifest. The hello of a killed process may
    /// also arrive late. Such a process continues until the wanted one has joined.
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
            let is_stale = |it: Launch| it < first && it.is_of(&child.spec) && as_wanted;
            let goes_on = launch.is_some_and(is_stale);
            if goes_on {
                actions.extend(starting.map(|(launch, _)| Action::kill_unjoined(launch)));
            }
            child.upgrade = (!goes_on).then(|| child.successor(now));
        }
        child.state = ChildState::Joined;
        child.stuck = None;
    }

    /// Handles a child that has left, either on request or by itself.
    pub(super) fn child_left(&mut self, name: &str) {
        let draining = self.draining();
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        if child.upgrade.take().is_none() {
            child.failure = Some("it has left".to_owned());
        }
        child.state = if child.spec.restart == Restart::Always && !draining {
            ChildState::Due(self.now + self.settings.backoff)
        } else {
            ChildState::Ended
        };
    }

    /// Handles a child that is down, and decides when it is started again.
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
        // The next start uses the newest manifest anyway.
        match child.upgrade.take() {
            Some(Upgrade::Starting(launch, _)) => actions.push(Action::kill_unjoined(launch)),
            Some(Upgrade::Due(_)) => {}
            // The process was the wanted one.
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
            "failed {times} times within {seconds} s and is restarted in {seconds} s: {why}"
        );
        self.notice(Notice::GaveUp { name, why }, actions);
        self.fail_missing();
    }

    /// Handles a child process that has ended or could not be started.
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

    /// Handles a child that ended before it joined. The broker does not wait for a child that
    /// cannot be started, has no work here, or has failed repeatedly.
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
            // It was rejected because another process uses its name, or it had no work.
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

    /// Starts due children, and kills children that do not join or do not leave in time.
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
        let why = "it was started but did not join";
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

    /// Checks whether a child of this name is starting or will start soon.
    pub(super) fn child_is_coming(&self, name: &str) -> bool {
        self.children.get(name).is_some_and(|child| {
            matches!(child.state, ChildState::Due(_) | ChildState::Starting(..))
        })
    }

    /// Checks whether a child has failed so often that waiting for it is useless.
    pub(super) fn child_gave_up(&self, name: &str) -> bool {
        self.children
            .get(name)
            .is_some_and(|child| matches!(child.state, ChildState::GaveUp(_) | ChildState::Ended))
    }

    /// Returns the reason why waiting for a child that has not joined is useless, or `None`.
    pub(super) fn child_cannot_start(&self, name: &str) -> Option<&str> {
        let child = self.children.get(name)?;
        child.stuck.as_deref()
    }

    /// Checks whether every bundle that should be started has joined or cannot be waited for any more.
    pub(super) fn children_settled(&self) -> bool {
        let children = self.children.iter();
        let mut bundles = children.filter(|(_, child)| child.spec.judges());
        bundles.all(|(name, _)| {
            let ready = self.bundles.get(name).is_some_and(|it| it.ready);
            ready || self.hopeless(name).is_some()
        })
    }
}

/// Returns a number below 256 that differs between children and between starts. It is the same in
/// every run, because the state machine has no random numbers.
fn jitter_of(name: &str, restarts: u32) -> u8 {
    name.bytes().fold(restarts.to_le_bytes()[0], |sum, byte| {
        sum.wrapping_mul(31).wrapping_add(byte)
    })
}
