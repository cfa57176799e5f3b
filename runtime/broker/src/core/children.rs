//! Children: the bundles and reporters that the broker itself keeps running.

use std::collections::VecDeque;
use std::time::Duration;

use qcbus_messages::{Role, ToPeer};

use super::action::Action;
use super::types::{ChildSpec, Launch, Restart, SessionId};
use super::{Actions, State};

/// A child by name.
#[derive(Debug)]
pub(super) struct Child {
    pub spec: ChildSpec,
    pub state: ChildState,
    /// Starts within the restart window.
    starts: VecDeque<Duration>,
    /// Failures in a row.
    failures: u32,
    pub restarts: u32,
    /// A newer one that will take over once it has joined.
    successor: Option<Launch>,
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

/// A process that has been told to go.
#[derive(Debug)]
pub(super) struct Retired {
    pub launch: Option<Launch>,
    pub pid: u32,
    pub since: Duration,
}

/// How long a child may take until it says hello.
const START_LIMIT: Duration = Duration::from_secs(15);

/// How long a process may take to leave after it was told to drain.
pub(super) const LEAVE_LIMIT: Duration = Duration::from_secs(10);

impl State {
    /// The children that should run: starts what is new, replaces what has changed, drains what
    /// is no longer wanted.
    pub(super) fn set_children(&mut self, specs: Vec<ChildSpec>, actions: &mut Actions) {
        let gone: Vec<String> = self
            .children
            .keys()
            .filter(|name| specs.iter().all(|it| &it.name != *name))
            .cloned()
            .collect();
        for name in gone {
            self.children.remove(&name);
            self.drain_peer(&name, actions);
        }
        for spec in specs.iter().filter(|it| it.role == Role::Reporter) {
            // Known from now on, so that it hears of files that go before it has joined.
            self.reporter_index(&spec.name);
        }
        let due = self.now.max(self.settings.collect);
        for spec in specs {
            match self.children.get_mut(&spec.name) {
                Some(child) if child.spec == spec => {}
                Some(child) => {
                    let running = matches!(child.state, ChildState::Joined);
                    child.spec = spec;
                    child.failures = 0;
                    child.starts.clear();
                    if running {
                        let launch = Launch(self.next_launch);
                        self.next_launch += 1;
                        child.successor = Some(launch);
                        actions.push(Action::Spawn {
                            launch,
                            spec: child.spec.clone(),
                        });
                    } else {
                        child.state = ChildState::Due(self.now);
                    }
                }
                None => {
                    let child = Child {
                        spec: spec.clone(),
                        state: ChildState::Due(due),
                        starts: VecDeque::new(),
                        failures: 0,
                        restarts: 0,
                        successor: None,
                    };
                    self.children.insert(spec.name, child);
                }
            }
        }
    }

    /// Tells a peer to finish and go, and forgets that it was wanted.
    fn drain_peer(&mut self, name: &str, actions: &mut Actions) {
        let now = self.now;
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.leaving = true;
            bundle.moved = now;
            match bundle.session {
                Some(session) => actions.push(Action::Send {
                    session,
                    message: ToPeer::Drain,
                }),
                None => {
                    self.drop_bundle(name, actions);
                    self.requeue_outdated();
                }
            }
            return;
        }
        let reporter = self.reporter_named(name);
        let process = reporter.and_then(|it| Some((it.session?, it.launch, it.pid)));
        if let Some((session, launch, pid)) = process {
            self.retire(session, launch, pid);
            actions.push(Action::Send {
                session,
                message: ToPeer::Drain,
            });
        }
    }

    /// A process that a former broker started and that nobody wants any more is told to go.
    pub(super) fn drain_unwanted(
        &mut self,
        name: &str,
        launch: Option<Launch>,
        actions: &mut Actions,
    ) {
        if launch.is_some() && !self.children.contains_key(name) {
            self.drain_peer(name, actions);
        }
    }

    /// Whether this launch is the newer one of a child that runs.
    pub(super) fn is_successor(&self, name: &str, launch: Launch) -> bool {
        self.children
            .get(name)
            .is_some_and(|child| child.successor == Some(launch))
    }

    /// A child has said hello.
    pub(super) fn child_joined(&mut self, name: &str, launch: Option<Launch>) {
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        if child.successor == launch {
            child.successor = None;
        }
        child.state = ChildState::Joined;
    }

    /// A child has left as it was told, or of its own will.
    pub(super) fn child_left(&mut self, name: &str) {
        let draining = self.draining();
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        child.state = if child.spec.restart == Restart::Always && !draining {
            ChildState::Due(self.now + self.settings.backoff)
        } else {
            ChildState::Ended
        };
    }

    /// A process that should go: it is killed when it does not.
    pub(super) fn retire(&mut self, session: SessionId, launch: Option<Launch>, pid: u32) {
        self.retired.insert(
            session,
            Retired {
                launch,
                pid,
                since: self.now,
            },
        );
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
        if child.spec.restart == Restart::Never || draining {
            child.state = ChildState::Ended;
            return;
        }
        child.failures = if proved { 1 } else { child.failures + 1 };
        while child
            .starts
            .front()
            .is_some_and(|at| now.saturating_sub(*at) > settings.restart_window)
        {
            child.starts.pop_front();
        }
        if child.starts.len() > settings.max_restarts as usize && !proved {
            let pause = settings.restart_window;
            child.state = ChildState::GaveUp(now + pause);
            let text = format!(
                "{name} failed {} times within {} s and is tried again in {} s: {why}",
                child.starts.len(),
                settings.restart_window.as_secs(),
                pause.as_secs()
            );
            self.notice(text, actions);
            self.fail_absent(actions);
            return;
        }
        let doubled =
            settings.backoff * 2_u32.saturating_pow(child.failures.saturating_sub(1).min(16));
        let pause = doubled.min(settings.backoff_max);
        // Children that fell together should not get up together.
        let jitter = pause.mul_f64(f64::from(jitter_of(name, child.restarts)) / 1024.0);
        child.state = ChildState::Due(now + pause + jitter);
    }

    /// A child process has ended or could not be started.
    pub(super) fn exited(
        &mut self,
        launch: Launch,
        how: &str,
        success: bool,
        actions: &mut Actions,
    ) {
        self.retired
            .retain(|_, retired| retired.launch != Some(launch));
        let starting = self.children.iter_mut().find_map(|(name, child)| {
            if child.successor == Some(launch) {
                child.successor = None;
                return None;
            }
            matches!(child.state, ChildState::Starting(it, _) if it == launch).then(|| name.clone())
        });
        if let Some(name) = starting {
            if success
                && self
                    .children
                    .get(&name)
                    .is_some_and(|it| it.spec.restart != Restart::Always)
            {
                // It was turned away because another process bears its name, or had nothing to do.
                if let Some(child) = self.children.get_mut(&name) {
                    child.state = ChildState::Due(self.now + self.settings.backoff_max);
                }
                return;
            }
            if !self.draining() {
                self.notice(format!("{name}: {how}"), actions);
            }
            self.child_down(&name, false, how, actions);
            self.fail_absent(actions);
            return;
        }
        let bundle = self
            .bundles
            .iter()
            .find(|(_, it)| it.launch == Some(launch) && it.session.is_some());
        if let Some(name) = bundle.map(|(name, _)| name.clone()) {
            self.bundle_died(&name, how, actions);
            return;
        }
        let reporter = self
            .reporters
            .iter()
            .find(|it| it.launch == Some(launch) && it.session.is_some());
        if let Some(name) = reporter.map(|it| it.name.clone()) {
            self.reporter_died(&name, how, actions);
        }
    }

    /// Starts what is due, and kills what does not get going or does not go.
    pub(super) fn watch_children(&mut self, actions: &mut Actions) {
        let now = self.now;
        let mut late = Vec::new();
        for (name, child) in &mut self.children {
            match child.state {
                ChildState::Due(at) | ChildState::GaveUp(at) if at <= now => {
                    let launch = Launch(self.next_launch);
                    self.next_launch += 1;
                    child.restarts += u32::from(!child.starts.is_empty());
                    child.starts.push_back(now);
                    child.state = ChildState::Starting(launch, now);
                    actions.push(Action::Spawn {
                        launch,
                        spec: child.spec.clone(),
                    });
                }
                ChildState::Starting(launch, since) if now.saturating_sub(since) > START_LIMIT => {
                    late.push((name.clone(), launch));
                }
                _ => {}
            }
        }
        for (name, launch) in late {
            actions.push(Action::Kill {
                launch: Some(launch),
                pid: 0,
            });
            self.child_down(&name, false, "it was started and did not join", actions);
        }
        self.retired.retain(|_, retired| {
            let overdue = now.saturating_sub(retired.since) > LEAVE_LIMIT;
            if overdue {
                actions.push(Action::Kill {
                    launch: retired.launch,
                    pid: retired.pid,
                });
            }
            !overdue
        });
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

    /// Whether every bundle that was to be started has joined, or has had its chance.
    pub(super) fn children_settled(&self) -> bool {
        self.children
            .iter()
            .filter(|(_, child)| child.spec.role == Role::Bundle)
            .all(|(name, child)| match child.state {
                ChildState::Joined => self.bundles.get(name).is_some_and(|it| it.ready),
                ChildState::Due(_) | ChildState::Starting(..) => {
                    self.now > self.settings.collect + self.settings.absence_limit
                }
                ChildState::GaveUp(_) | ChildState::Ended => true,
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
