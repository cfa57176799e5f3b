//! The broker's side of one session.

use std::time::{Duration, Instant};

use iceoryx2::prelude::*;
use qcbus_messages::services::Services;
use qcbus_messages::{FromPeer, codec};

use crate::admission::Known;
use crate::host::{HostEvent, PeerId};
use crate::link::{FrameHeader, Link, SessionKey, Wants};
use crate::ports::{self, Hub, PortError, TopicService, WakeService};
use crate::receive_budget::{Budget, Waiting};

/// Maximum time from a peer's introduction until it opens its channels.
const CONNECT_WITHIN: Duration = Duration::from_secs(10);

pub(crate) struct Session {
    key: SessionKey,
    pub(crate) link: Link,
    to: TopicService<u8, FrameHeader>,
    _from: TopicService<u8, FrameHeader>,
    _wake: WakeService,
    /// Facts about the peer. `None` if it is unproven; the session then only reports this.
    known: Option<Known>,
    opened: Instant,
    connected: bool,
    farewell: bool,
    /// End of the session and its reason, after a refusal.
    ends: Option<(Instant, String)>,
}

impl Session {
    /// Creates the services and ports. This takes about 2 ms.
    pub(crate) fn open(
        hub: &Hub,
        services: &Services,
        key: SessionKey,
        now: Instant,
    ) -> Result<Session, PortError> {
        let suffix = key.suffix();
        let wake = hub.wake(&services.wake_peer, &suffix)?;
        let from = hub.topic(&services.from_peer, &suffix)?;
        // This port must exist before the peer creates its end. The peer connects to the existing
        // ports then, and cannot connect to later ones once it is confined.
        let receiver = ports::subscriber(&from, &services.from_peer)?;
        // This service is created last: the peer opens it first and then finds the others.
        let to = hub.topic(&services.to_peer, &suffix)?;
        let link = Link::new(
            key,
            hub.stream_publisher(&to, &services.to_peer)?,
            receiver,
            ports::notifier(&wake)?,
            codec::MAX_FROM_PEER,
        );
        Ok(Session {
            key,
            link,
            to,
            _from: from,
            _wake: wake,
            known: None,
            opened: now,
            connected: false,
            farewell: false,
            ends: None,
        })
    }

    pub(crate) fn key(&self) -> SessionKey {
        self.key
    }

    /// Records the verified facts about the peer.
    pub(crate) fn is_known(&mut self, known: Known) {
        self.known = Some(known);
    }

    /// Checks whether the session belongs to this process.
    pub(crate) fn is_of(&self, known: &Known) -> bool {
        self.known.as_ref().is_some_and(|own| own.is_same(known))
    }

    /// Reads up to `quota` frames and returns `true` if there was one.
    pub(crate) fn read(
        &mut self,
        peer: PeerId,
        quota: usize,
        budget: &mut Budget,
        waiting: &mut Waiting,
    ) -> bool {
        let silent = self.is_silent();
        let before = waiting.len();
        let drained = self.link.drain(quota, |bytes| {
            if !silent {
                waiting.push(understand(peer, bytes), bytes.len());
            }
            match waiting.is_enough_since(before) {
                true => Wants::NoMore,
                false => Wants::More,
            }
        });
        budget.spend(drained.frames, drained.bytes);
        self.farewell |= drained.farewell.is_some();
        let broken = drained.broken.map(|broken| broken.to_string());
        let foreign = (drained.foreign > 0 && !silent)
            .then(|| format!("{} frames belong to no session", drained.foreign));
        for what in broken.into_iter().chain(foreign) {
            waiting.push(HostEvent::Garbage { peer, what }, 0);
        }
        drained.frames > 0
    }

    /// Checks whether the peer's process lives and has its end of the channel open.
    pub(crate) fn is_there(&mut self) -> bool {
        let subscribed = self.to.dynamic_config().number_of_subscribers() > 0;
        self.connected |= subscribed;
        let alive = self.known.as_ref().is_none_or(Known::is_there);
        let left = self.connected && !subscribed;
        let never_came = !self.connected && self.opened.elapsed() > CONNECT_WITHIN;
        alive && !left && !never_came && !self.farewell
    }

    /// Ends the session of a refused peer when it has read the reason, at the latest at `at`.
    pub(crate) fn end(&mut self, at: Instant, reason: &str) {
        self.link.hurry();
        self.ends = Some((at, reason.to_owned()));
    }

    /// Checks whether the broker has finished this session.
    pub(crate) fn is_silent(&self) -> bool {
        self.ends.is_some()
    }

    /// Checks whether an ended session may be removed.
    pub(crate) fn is_over(&mut self, now: Instant) -> bool {
        let Some((at, reason)) = &self.ends else {
            return false;
        };
        let over = now >= *at || self.link.backlog() == 0;
        if over {
            self.link.farewell(reason);
        }
        over
    }
}

fn understand(peer: PeerId, bytes: &[u8]) -> HostEvent {
    match codec::decode::<FromPeer>(bytes) {
        Ok(message) => HostEvent::Message { peer, message },
        Err(error) => HostEvent::Garbage {
            peer,
            what: error.to_string(),
        },
    }
}
