//! Upgrades: a newer process of a child joins and takes over beside the older, which then drains.

use std::time::Duration;

use super::action::Action;
use super::children::Child;
use super::notice::Notice;
use super::types::{Launch, Restart};
use super::{Actions, State};

/// How far the newer process of a child is, beside the older that goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Upgrade {
    /// To be started then.
    Due(Duration),
    /// Started, has not said hello.
    Starting(Launch, Duration),
}

impl Child {
    pub fn is_upgraded_by(&self, launch: Launch) -> bool {
        matches!(self.upgrade, Some(Upgrade::Starting(it, _)) if it == launch)
    }

    /// Starts the newer process when it is due. Returns its launch when it should have joined by now.
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
    /// Whether this launch is the newer one of a child that runs.
    pub(super) fn is_successor(&self, name: &str, launch: Launch) -> bool {
        let child = self.children.get(name);
        child.is_some_and(|child| child.is_upgraded_by(launch))
    }

    /// The newer process of a child has ended, or hangs, before it joined: it is tried again.
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
