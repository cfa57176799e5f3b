//! Shutdown: ends the jobs first, then the reporters, then all peers.

use std::time::Duration;

use qcbus_messages::{Role, ToPeer};
use qcbus_types::Action;

use super::{Actions, Phase, State};

/// Maximum time that peers may take to leave at the end.
const GOODBYE_LIMIT: Duration = Duration::from_secs(3);

impl State {
    /// Checks whether the broker was told to stop.
    pub fn draining(&self) -> bool {
        self.phase != Phase::Running
    }

    pub(super) fn drain(&mut self) {
        if self.phase == Phase::Running {
            self.phase = Phase::Draining(self.now);
        }
    }

    /// Advances the shutdown: jobs first, then reporters, then all peers.
    pub(super) fn wind_down(&mut self, actions: &mut Actions) {
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
                self.refuse_waiting_on_demand(actions);
                self.end_held_up(actions);
                self.end_trials(actions);
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
                    self.dismiss_on_demand("the broker has stopped", actions);
                    actions.push(Action::Stop);
                }
            }
            Phase::Running | Phase::Stopped => {}
        }
    }

    /// Checks whether a reporter that should be started may still join.
    fn reporters_coming(&self) -> bool {
        self.children.iter().any(|(name, child)| {
            child.spec.role == Role::Reporter
                && self.child_is_coming(name)
                && self.child_cannot_start(name).is_none()
        })
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

    /// Kills the processes that a broker started and that do not leave.
    fn kill_ours(&self, actions: &mut Actions) {
        for (role, name) in self.sessions.values() {
            let launch = match role {
                Role::Bundle => self.bundles.get(&**name).and_then(|it| it.launch),
                Role::Reporter => self.reporter_named(name).and_then(|it| it.launch),
            };
            actions.extend(launch.map(|launch| Action::Kill { launch }));
        }
    }

    /// Checks whether this broker or a former one started the peer.
    fn is_ours(&self, name: &str) -> bool {
        self.bundles.get(name).is_some_and(|it| it.launch.is_some())
            || self
                .reporter_named(name)
                .is_some_and(|it| it.launch.is_some())
    }
}
