//! Leaving: what nobody wants any more is told to finish and go, and killed when it does not.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use qcbus_messages::ToPeer;

use super::action::Action;
use super::types::{Launch, SessionId};
use super::{Actions, State};

/// A process that has been told to go.
#[derive(Debug)]
pub(super) struct Retired {
    pub launch: Option<Launch>,
    pub since: Duration,
}

/// How long a process may take to leave after it was told to drain.
pub(super) const LEAVE_LIMIT: Duration = Duration::from_secs(10);

/// How long what a former broker started may take to join this one. A process that is well notices
/// at once that its broker has gone, and ends when it finds no other within ten seconds.
const RETURN_LIMIT: Duration = Duration::from_secs(15);

impl State {
    /// Tells a peer to finish and go, and forgets that it was wanted.
    pub(super) fn drain_peer(&mut self, name: &str, actions: &mut Actions) {
        let now = self.now;
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.draining = true;
            bundle.moved = now;
            // From now on nobody misses it, also when the broker ends before it has left.
            if bundle.origin.take().is_some() {
                let name = name.to_owned();
                actions.push(Action::Strike { name });
            }
            match bundle.session {
                Some(session) => actions.push(Action::Send {
                    session,
                    message: ToPeer::Drain,
                }),
                None => self.drop_bundle(name, actions),
            }
            self.begin_epoch();
            return;
        }
        let reporter = self.reporter_named(name);
        let process = reporter.and_then(|it| Some((it.session?, it.launch)));
        if let Some((session, launch)) = process {
            self.retire(session, launch);
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

    /// A process that should go: it is killed when it does not.
    pub(super) fn retire(&mut self, session: SessionId, launch: Option<Launch>) {
        self.retired.insert(
            session,
            Retired {
                launch,
                since: self.now,
            },
        );
    }

    /// A process that hung when its broker was killed has no session with this one, so
    /// nobody would ever miss it: what has not come back in time is killed, once.
    pub(super) fn kill_what_did_not_return(&mut self, actions: &mut Actions) {
        if self.stale_children_are_gone || self.now < RETURN_LIMIT {
            return;
        }
        self.stale_children_are_gone = true;
        let bundles = self.bundles.values().map(|it| it.launch);
        let reporters = self.reporters.iter().map(|it| it.launch);
        let draining = self.retired.values().map(|it| it.launch);
        let joined: BTreeSet<Launch> = bundles.chain(reporters).chain(draining).flatten().collect();
        actions.push(Action::KillStaleChildren { joined });
    }

    /// Kills what was told to go long ago.
    pub(super) fn kill_overdue(&mut self, actions: &mut Actions) {
        let now = self.now;
        let overdue = |it: &Retired| now.saturating_sub(it.since) > LEAVE_LIMIT;
        let (over, rest): (BTreeMap<_, _>, BTreeMap<_, _>) = std::mem::take(&mut self.retired)
            .into_iter()
            .partition(|(_, retired)| overdue(retired));
        self.retired = rest;
        for (session, Retired { launch, .. }) in over {
            actions.extend(launch.map(|launch| Action::Kill { launch }));
            self.retired_has_gone(session, actions);
        }
    }
}
