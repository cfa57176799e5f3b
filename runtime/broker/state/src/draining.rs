//! Draining: asks unwanted processes to finish and leave, and kills them if they do not.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use qcbus_messages::ToPeer;
use qcbus_types::{Action, Launch, SessionId};

use super::{Actions, State};

/// A process that was told to leave.
#[derive(Debug)]
pub(super) struct Retired {
    pub launch: Option<Launch>,
    pub since: Duration,
}

/// Maximum time that a process may take to leave after it was told to drain.
pub(super) const LEAVE_LIMIT: Duration = Duration::from_secs(10);

/// Maximum time that a process of a former broker may take to join this one. A healthy process
/// notices the end of its broker at once. It ends if it finds no other broker within ten seconds.
const RETURN_LIMIT: Duration = Duration::from_secs(15);

impl State {
    /// Tells a peer to finish and leave. It is not required any more.
    pub(super) fn drain_peer(&mut self, name: &str, actions: &mut Actions) {
        let now = self.now;
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.draining = true;
            bundle.moved = now;
            // From now on the bundle is not required, even if the broker ends before the bundle has left.
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

    /// Drains a process that a former broker started and that is not wanted any more.
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

    /// Registers a process that must leave. It is killed if it does not.
    pub(super) fn retire(&mut self, session: SessionId, launch: Option<Launch>) {
        self.retired.insert(
            session,
            Retired {
                launch,
                since: self.now,
            },
        );
    }

    /// Kills, once, the processes that have not joined in time. A process that hung when its broker
    /// was killed has no session here, so it would remain unnoticed.
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

    /// Kills processes that have not left within the limit.
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
