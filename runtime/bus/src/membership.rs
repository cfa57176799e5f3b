//! A peer's side of one session, from the introduction to its end.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use iceoryx2::prelude::*;
use qcbus_messages::services::{HELLO_BYTES, Services};
use qcbus_messages::{Digest, Hello, ToPeer, codec};

use crate::admission::{Statement, introduce};
use crate::generation::Generation;
use crate::host::{ConfigHeader, HelloHeader};
use crate::instance::Instance;
use crate::library::Library;
use crate::link::{FrameHeader, Link, SessionKey, Wants};
use crate::memory::{RoomLocks, free_shared_memory, take_room};
use crate::peer::PeerEvent;
use crate::ports::{self, Hub, PortError, Pub, Sub, TopicService, WakeNotifier};
use crate::process::Process;
use crate::removal_lock::{NoEntry, RemovalLock};
use crate::wake::{TICK, Waker};

/// How often an introduction is repeated.
const HELLO_EVERY: Duration = Duration::from_millis(50);
/// Number of introductions after which the process states its identity again.
const PROVE_EVERY: u32 = 20;
/// Frames read before documents are read.
const QUOTA: usize = 32;

/// State of the relation between peer and broker.
#[derive(Debug)]
pub(crate) enum MembershipState {
    /// The broker has not answered yet.
    Waiting,
    /// The broker has just welcomed the peer.
    JustWelcomed,
    /// In session.
    Welcome,
    /// The broker has refused the peer.
    Refused(String),
    /// The session is over without a reason. Another one is possible.
    Ended,
    /// The session is over because of a failure on this side.
    Failed(String),
}

pub(crate) enum BeginError {
    Hello(String),
    Port(String),
}

impl From<NoEntry> for BeginError {
    fn from(error: NoEntry) -> Self {
        BeginError::Port(error.to_string())
    }
}

impl From<PortError> for BeginError {
    fn from(error: PortError) -> Self {
        BeginError::Port(error.to_string())
    }
}

/// The channels of a session, created by the broker.
struct Channels {
    link: Link,
    waker: Waker,
    to: TopicService<u8, FrameHeader>,
    seen_broker: bool,
}

pub(crate) struct Membership {
    generation: Generation,
    services: Services,
    key: SessionKey,
    broker: Process,
    introduction: Vec<u8>,
    last_hello: Option<Instant>,
    hellos: u32,
    proves: bool,
    instance: Instance,
    /// Statements of this process's identity. Through them the broker sees whether it lives.
    said: Vec<Statement>,
    /// Removal lock, needed because the peer creates files until it is welcome.
    removal_lock: RemovalLock,
    last_tick: Instant,
    welcome: bool,
    refused: Option<String>,
    // Ports are dropped before the node.
    channels: Option<Channels>,
    library: Library,
    config: Sub<u8, ConfigHeader>,
    hello: Pub<u8, HelloHeader>,
    wake_broker: Option<WakeNotifier>,
    hub: Hub,
}

impl Membership {
    /// Joins the generation and subscribes to the shared topics, so that the broker's answer finds
    /// subscribers for documents and configuration.
    pub(crate) fn begin(
        instance: &Instance,
        generation: Generation,
        broker: Process,
        hello: &Hello,
        attempt: u64,
        proves: bool,
    ) -> Result<Membership, BeginError> {
        let introduction =
            codec::encode(hello).map_err(|error| BeginError::Hello(error.to_string()))?;
        if introduction.len() > HELLO_BYTES {
            let len = introduction.len();
            let why = format!("{len} bytes; at most {HELLO_BYTES} are allowed");
            return Err(BeginError::Hello(why));
        }
        let services = Services::new(&generation.limits);
        let room_locks = RoomLocks::new();
        let _lock = room_locks.take();
        let removal_lock = RemovalLock::of(&generation.root)?;
        let inside = removal_lock.enter()?;
        take_part(&generation.root, services.peer_bytes())?;
        let hub = Hub::join(&inside)?;
        let config = hub.topic(&services.config, "")?;
        let greetings = hub.topic(&services.hello, "")?;
        let wake = hub.wake(&services.wake_broker, "")?;
        Ok(Membership {
            key: SessionKey {
                generation: generation.number,
                incarnation: hello.incarnation,
                attempt,
            },
            library: Library::new(&hub, generation.number, &services)?,
            config: ports::subscriber(&config, &services.config)?,
            hello: hub.small_publisher(&greetings, &services.hello)?,
            wake_broker: Some(ports::notifier(&wake)?),
            channels: None,
            generation,
            services,
            broker,
            introduction,
            last_hello: None,
            hellos: 0,
            proves,
            instance: instance.clone(),
            said: Vec::new(),
            removal_lock,
            last_tick: Instant::now(),
            welcome: false,
            refused: None,
            hub,
        })
    }

    /// Returns the root directory of the generation.
    pub(crate) fn root(&self) -> &Path {
        &self.generation.root
    }

    pub(crate) fn library(&self) -> &Library {
        &self.library
    }

    pub(crate) fn library_mut(&mut self) -> &mut Library {
        &mut self.library
    }

    pub(crate) fn is_welcome(&self) -> bool {
        self.welcome
    }

    pub(crate) fn push(&mut self, message: &[u8]) {
        if let Some(channels) = &mut self.channels {
            channels.link.push(message);
        }
    }

    pub(crate) fn backlog(&self) -> usize {
        self.channels
            .as_ref()
            .map_or(0, |channels| channels.link.backlog())
    }

    pub(crate) fn hurry(&mut self) {
        if let Some(channels) = &mut self.channels {
            channels.link.hurry();
        }
    }

    pub(crate) fn flush(&mut self) {
        let now = Instant::now();
        let ticked = now.duration_since(self.last_tick) >= TICK;
        if ticked {
            self.last_tick = now;
        }
        match &mut self.channels {
            Some(channels) if ticked => channels.link.tick(now),
            Some(channels) => channels.link.flush(),
            None => {}
        }
    }

    pub(crate) fn farewell(&mut self) {
        if let Some(channels) = &mut self.channels {
            channels.link.farewell("leaving");
        }
    }

    /// Returns when the broker has woken this peer, or after `limit`. While there are no channels,
    /// it returns when the broker has created them. Cancel-safe.
    pub(crate) async fn wait(&self, limit: Duration) {
        match &self.channels {
            Some(channels) => channels.waker.wait(limit).await,
            None => match self.said.last() {
                Some(said) => said.answered(limit).await,
                None => tokio::time::sleep(limit).await,
            },
        }
    }

    /// Does everything that is possible without waiting.
    pub(crate) fn exchange(
        &mut self,
        now: Instant,
        max_events: usize,
        events: &mut VecDeque<PeerEvent>,
        config: &mut Option<(Digest, Arc<[u8]>)>,
    ) -> MembershipState {
        let removal_lock = self.removal_lock.clone();
        let _inside = match (!self.welcome).then(|| removal_lock.enter()).transpose() {
            Ok(inside) => inside,
            Err(lock_for_removal) => return MembershipState::Failed(lock_for_removal.to_string()),
        };
        if self.channels.is_none()
            && let Err(error) = self.connect(now)
        {
            return MembershipState::Failed(error);
        }
        let was_welcome = self.welcome;
        let ended = self.read(max_events, events, config);
        self.flush();
        if let Some(reason) = self.refused.take() {
            return MembershipState::Refused(reason);
        }
        match (was_welcome, self.welcome) {
            _ if ended => MembershipState::Ended,
            (false, true) => MembershipState::JustWelcomed,
            (_, true) => MembershipState::Welcome,
            (_, false) => MembershipState::Waiting,
        }
    }

    /// Reads messages first and documents after them. The documents of a received job have then
    /// arrived, because they were published before the job was sent. Returns `true` if the broker
    /// has ended the session.
    pub(crate) fn read(
        &mut self,
        max_events: usize,
        events: &mut VecDeque<PeerEvent>,
        config: &mut Option<(Digest, Arc<[u8]>)>,
    ) -> bool {
        let mut messages = Vec::new();
        let mut ended = false;
        if let Some(channels) = &mut self.channels {
            loop {
                let drained = channels.link.drain(QUOTA, |bytes| {
                    messages.push(codec::decode::<ToPeer>(bytes));
                    Wants::More
                });
                ended |= drained.farewell.is_some() || drained.broken.is_some();
                if drained.frames < QUOTA || messages.len() + events.len() >= max_events {
                    break;
                }
            }
        }
        self.read_config(events, config);
        let asked = self
            .library
            .drain(|doc| events.push_back(PeerEvent::Document(doc)));
        if asked {
            events.push_back(PeerEvent::LetGo);
        }
        // Documents and configurations precede the messages that refer to them, but the welcome
        // comes first.
        let behind = events.len();
        for message in messages {
            self.hear(message, events);
        }
        if let Some(at) = (behind..events.len())
            .find(|at| matches!(events[*at], PeerEvent::Message(ToPeer::Welcome { .. })))
            && let Some(welcome) = events.remove(at)
        {
            events.push_front(welcome);
        }
        ended
    }

    fn hear(
        &mut self,
        message: Result<ToPeer, codec::CodecError>,
        events: &mut VecDeque<PeerEvent>,
    ) {
        match message {
            Ok(ToPeer::Refused { reason }) => self.refused = Some(reason),
            Ok(message) => {
                if let ToPeer::Job(job) = &message {
                    let documents = job.documents.iter();
                    documents.for_each(|it| self.library.want(it.doc));
                }
                self.welcome |= matches!(message, ToPeer::Welcome { .. });
                events.push_back(PeerEvent::Message(message));
            }
            Err(error) => tracing::error!(%error, "cannot decode a message of the broker"),
        }
    }

    fn read_config(
        &self,
        events: &mut VecDeque<PeerEvent>,
        config: &mut Option<(Digest, Arc<[u8]>)>,
    ) {
        while let Ok(Some(sample)) = self.config.receive() {
            let header = *sample.user_header();
            let used = usize::try_from(header.used).unwrap_or(usize::MAX);
            let Some(bytes) = sample.payload().get(..used) else {
                continue;
            };
            let digest = Digest(header.digest);
            *config = Some((digest, Arc::from(bytes)));
            events.push_back(PeerEvent::Config(digest));
        }
    }

    /// Introduces itself repeatedly until the broker has created the channels.
    fn connect(&mut self, now: Instant) -> Result<(), String> {
        let due = self
            .last_hello
            .is_none_or(|last| now.duration_since(last) >= HELLO_EVERY);
        if due {
            self.last_hello = Some(now);
            self.introduce()?;
        }
        let suffix = self.key.suffix();
        let Ok(to) = self.hub.topic(&self.services.to_peer, &suffix) else {
            return Ok(());
        };
        self.channels = Some(self.open(to, &suffix).map_err(|error| error.to_string())?);
        Ok(())
    }

    fn open(
        &mut self,
        to: TopicService<u8, FrameHeader>,
        suffix: &str,
    ) -> Result<Channels, PortError> {
        let from = self.hub.topic(&self.services.from_peer, suffix)?;
        let wake = self.hub.wake(&self.services.wake_peer, suffix)?;
        let wake_broker = match self.wake_broker.take() {
            Some(notifier) => notifier,
            None => ports::notifier(&self.hub.wake(&self.services.wake_broker, "")?)?,
        };
        let waker = Waker::new(ports::listener(&wake)?).map_err(|why| PortError::waiting(&why))?;
        let receiver = ports::subscriber(&to, &self.services.to_peer)?;
        let sender = self.hub.stream_publisher(&from, &self.services.from_peer)?;
        let link = Link::new(self.key, sender, receiver, wake_broker, codec::MAX_MESSAGE);
        link.ring();
        Ok(Channels {
            link,
            waker,
            to,
            seen_broker: false,
        })
    }

    fn introduce(&mut self) -> Result<(), String> {
        if self.proves && self.hellos.is_multiple_of(PROVE_EVERY) {
            let said = introduce(&self.instance, self.key).and_then(Statement::new);
            self.said.push(said.map_err(|error| {
                format!("cannot prove the process identity to the broker: {error}")
            })?);
        }
        self.hellos += 1;
        let mut sample = self
            .hello
            .loan_slice_uninit(self.introduction.len())
            .map_err(|why| format!("{why:?}"))?;
        *sample.user_header_mut() = HelloHeader {
            incarnation: self.key.incarnation,
            attempt: self.key.attempt,
        };
        let sent = sample.write_from_slice(&self.introduction).send();
        sent.map_err(|why| format!("{why:?}"))?;
        if let Some(wake) = &self.wake_broker {
            wake.notify().map_err(|why| format!("{why:?}"))?;
        }
        Ok(())
    }

    /// Checks whether the broker lives, serves the same generation and keeps this session.
    pub(crate) fn broker_is_there(&mut self, instance: &Instance) -> bool {
        let kept = match &mut self.channels {
            Some(channels) => {
                let publishers = channels.to.dynamic_config().number_of_publishers();
                channels.seen_broker |= publishers > 0;
                publishers > 0 || !channels.seen_broker
            }
            None => true,
        };
        // A missing file proves nothing. A stopping broker closes its channels, and a running one
        // recreates the file after its directory was cleaned.
        let told = Generation::current(instance);
        kept && self.broker.is_alive() && told.is_none_or(|current| current == self.generation)
    }
}

/// Provides the memory for joining, from the broker's reserve for peers or else from the free
/// memory.
fn take_part(root: &Path, needed: u64) -> Result<(), PortError> {
    let free = free_shared_memory();
    if take_room(root, needed) || free >= needed {
        return Ok(());
    }
    Err(PortError::no_room(needed, free))
}
