//! Upgrades: a newer process of a child joins and takes over from the older one, which then drains.

use std::time::Duration;

use qcbus_types::{Action, Launch, Notice, Restart};

use super::children::Child;
use super::{Actions, State};

/// State of the newer process of a child while the older one continues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Upgrade {
    /// It is started at this time.
    Due(Duration),
    /// It was started at this time and has not sent hello yet.
    Starting(Launch, Duration),
}

impl Child {
    pub fn is_upgraded_by(&self, launch: Launch) -> bool {
        matches!(self.upgrade, Some(Upgrade::Starting(it, _)) if it == launch)
    }

    /// Starts the newer process when it is due. Returns its launch if it should have joined by now.
    pub fn watch_upgrade(
        &mut self,
        now: Duration,
        last: &mut Launch,
        actions: &mut Actions,
    ) -> Option<Launch> {
        match self.upgrade? {
            Upgrade::Due(at) if at <= now => {
                let launch = last.next(&self.spec);
                *last = launch;
                self.upgrade = Some(Upgrade::Starting(launch, now));
                let spec = self.spec.clone();
                actions.push(Action::Spawn { launch, spec });
                None
            }
            Upgrade::Starting(launch, since) if now.saturating_sub(since) > self.start_limit() => {
                Some(launch)
            }
            _ => None,
        }
    }
}

impl State {
    /// Checks whether this launch is the newer process of a running child.
    pub(super) fn is_successor(&self, name: &str, launch: Launch) -> bool {
        let child = self.children.get(name);
        child.is_some_and(|child| child.is_upgraded_by(launch))
    }

    /// Handles a newer process that has ended or hangs before it joined. It is started again later.
    pub(super) fn upgrade_failed(&mut self, name: &str, why: &str, actions: &mut Actions) {
        let (now, draining, settings) = (self.now, self.draining(), &self.settings);
        let Some(child) = self.children.get_mut(name) else {
            return;
        };
        child.failures += 1;
        child.failure = Some(why.to_owned());
        let pause = child.pause(settings.backoff, settings.backoff_max);
        let again = child.spec.restart != Restart::Never && !draining;
        child.upgrade = again.then(|| Upgrade::Due(now + pause));
        let (name, why) = (name.to_owned(), why.to_owned());
        self.notice(Notice::NotUpgraded { name, why }, actions);
    }
}
