//! The broker's end of the bus.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::fs::File;
use std::ops::Bound;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use qcbus_messages::codec;
use qcbus_messages::services::{
    FRAME_BUFFER, Growth, HELLO_BYTES, Limits, SPARE_SESSIONS, Services, Topic,
};
use qcbus_messages::{Digest, FromPeer, Hello, ToPeer};

use crate::admission::{Admission, Known};
use crate::documents::Documents;
use crate::generation::{Generation, close_to_others, sweep};
use crate::instance::{Instance, InstanceLock, LockError};
use crate::janitor::Janitor;
use crate::link::SessionKey;
use crate::memory::{RoomLocks, SharedMemory, fitting_reserve, keep_room};
use crate::options::{HostOptions, StartError};
use crate::ports::{self, Hub, PortError, Pub, Sub};
use crate::process::Process;
use crate::receive_budget::{Budget, Waiting};
use crate::runtime_files::{LockSlot, RuntimeFiles};
use crate::session::Session;
use crate::wake::{TICK, Waker};

/// Frames read from one peer before the next peer is served.
const QUOTA: usize = 8;
/// Iterations without an event before the other tasks of the process run.
const TURNS_IN_A_ROW: usize = 8;
/// Introductions read in one iteration.
const HELLOS: usize = 64;
/// Time that an ended session waits until the peer has read its final output.
const LINGER: Duration = Duration::from_secs(1);
/// Maximum time from a peer's introduction to the proof of its identity.
const PROVE_WITHIN: Duration = Duration::from_secs(1);
/// Maximum number of remembered peers without proof of identity, and the time they are remembered.
const MAX_STRANGERS: usize = 64;
const STRANGE_FOR: Duration = Duration::from_secs(60);
/// Maximum number of sessions that only tell such a peer why it may not join.
const MAX_TOLD: usize = 4;
/// Maximum number of processes with remembered attempts. Beyond it, only those in session stay.
const MAX_REMEMBERED: usize = 4096;
/// Maximum bytes of documents that may stay until the process ends.
const LEFT_TO_THE_END: usize = 16 << 20;
/// Interval of the check of processes.
const WATCH_EVERY: Duration = Duration::from_millis(20);

/// One session with a peer. The number is never used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PeerId(pub u64);

impl fmt::Display for PeerId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "peer {}", self.0)
    }
}

/// An event that the broker must handle.
#[derive(Debug)]
pub enum HostEvent {
    /// A peer wants to join. Answer with [`Host::accept`] or [`Host::refuse`].
    Hello {
        /// Its new session.
        peer: PeerId,
        /// Its introduction with the true process id, or 0 if the process is not visible from here.
        hello: Hello,
        /// Its process, as reported by the kernel.
        process: Option<Process>,
        /// Value of [`crate::LAUNCH`] in its environment, set by its starter. Empty if unset.
        launch: String,
    },
    /// A process wanted to join without proving its identity. It was told the reason.
    TurnedAway {
        /// Text for a person.
        why: String,
    },
    /// A peer has sent a message.
    Message {
        /// The session.
        peer: PeerId,
        /// The message.
        message: FromPeer,
    },
    /// A peer has sent an invalid message. Its earlier and later messages count, unless the broker
    /// disconnects it.
    Garbage {
        /// The session.
        peer: PeerId,
        /// Text for a person.
        what: String,
    },
    /// A peer's process has ended or has left the bus. The session is over.
    Gone {
        /// The session.
        peer: PeerId,
    },
}

/// The broker's end of the bus: one generation of one instance.
///
/// Dropping it removes everything, including what a returned `Documents` still refers to. Memory
/// that a process has mapped stays readable.
pub struct Host {
    generation: Generation,
    runtime_files: Arc<RuntimeFiles>,
    limits: Limits,
    services: Services,
    waiting: Waiting,
    sessions: BTreeMap<PeerId, Session>,
    /// The last attempt of every process to get a session.
    attempts: HashMap<u64, u64>,
    /// Peers without proof of identity: since when, and whether they were told so.
    strangers: HashMap<SessionKey, (Instant, bool)>,
    next_peer: u64,
    /// The peer that was read from last. The next iteration starts after it.
    last_read: PeerId,
    last_turn: Instant,
    last_tick: Instant,
    last_watch: Instant,
    admission: Admission,
    // The following fields are dropped in this order: ports, the janitor, the node.
    waker: Waker,
    hello: Sub<u8, HelloHeader>,
    config: Pub<u8, ConfigHeader>,
    documents: Documents,
    janitor: Option<Janitor>,
    hub: Hub,
    _memory_lock: File,
    remains: Option<Remains>,
}

/// Dropped last: unlinks the remaining files and only then releases the instance.
struct Remains {
    instance: Instance,
    lock: LockSlot,
}

impl Drop for Remains {
    fn drop(&mut self) {
        // The ports have unlinked their own files. Workers and peers may still hold other files.
        sweep(&self.instance, None);
        let mut lock = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(lock) = lock.take() {
            lock.release();
        }
    }
}

/// Header of an introduction.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("qcbus.HelloHeader.1")]
#[repr(C)]
pub(crate) struct HelloHeader {
    pub(crate) incarnation: u64,
    pub(crate) attempt: u64,
}

/// Header of the configuration.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("qcbus.ConfigHeader.1")]
#[repr(C)]
pub(crate) struct ConfigHeader {
    pub(crate) digest: [u8; 32],
    pub(crate) used: u64,
}

impl Host {
    /// Takes the instance's lock, begins a new generation and removes the remains of older ones.
    /// Must be called within a tokio runtime.
    ///
    /// # Errors
    /// See [`StartError`].
    pub fn start(instance: &Instance, options: HostOptions) -> Result<Host, StartError> {
        instance.create_dir()?;
        let lock = InstanceLock::take(instance).map_err(|error| match error {
            LockError::Taken { pid } => StartError::AlreadyRunning {
                instance: instance.name().to_owned(),
                pid,
            },
            LockError::Io(error) => StartError::Io(error),
        })?;
        let lock: LockSlot = Arc::new(Mutex::new(Some(lock)));
        let remains = Remains {
            instance: instance.clone(),
            lock: Arc::clone(&lock),
        };
        let space = rustix::process::getrlimit(rustix::process::Resource::As).current;
        let limits = options.limits_within(space)?;
        let mut services = Services::new(&limits);
        if !options.config_grows {
            services.config.growth = Growth::Fixed;
        }
        let room_locks = RoomLocks::new();
        let room_lock = room_locks.take();
        let expected = options.expected_peers.min(limits.peers) as u64;
        let room = expected * services.peer_bytes();
        let own = services.broker_bytes();
        let needed = own + room + fitting_reserve(options.shm_reserve_bytes);
        look_for_room(needed)?;
        let generation = Generation::begin(instance, limits)?;
        let memory_lock = generation
            .lock_memory()
            .map_err(StartError::shared_memory)?;
        // A process that does not wait for the memory lock may have taken the room.
        keep_room(&generation.root, room).map_err(|error| StartError::no_room(error, needed))?;
        let hub = Hub::create(&generation.root)?;
        let documents = Documents::new(
            &hub,
            generation.number,
            [services.document_small, services.document_large],
            fitting_reserve(options.shm_reserve_bytes),
            own + room,
        )?;
        let wake = hub.wake(&services.wake_broker, "")?;
        let hello = subscribe(&hub, &services.hello)?;
        let config = publish(&hub, &services.config)?;
        let waker = Waker::new(ports::listener(&wake)?)?;
        close_to_others(&generation.root).map_err(StartError::shared_memory)?;
        let runtime_files = Arc::new(RuntimeFiles::new(instance, &generation, &lock));
        let host = Host {
            hello,
            config,
            waker,
            janitor: Some(Janitor::start(
                instance,
                &generation,
                Arc::clone(&runtime_files),
            )?),
            runtime_files,
            documents,
            hub,
            waiting: Waiting::default(),
            sessions: BTreeMap::new(),
            attempts: HashMap::new(),
            strangers: HashMap::new(),
            admission: Admission::open(instance, generation.number)?,
            next_peer: 1,
            last_read: PeerId(0),
            last_turn: Instant::now(),
            last_tick: Instant::now(),
            last_watch: Instant::now(),
            remains: Some(remains),
            _memory_lock: memory_lock,
            generation,
            limits,
            services,
        };
        drop(room_lock);
        host.runtime_files.announce()?;
        Ok(host)
    }

    /// Ends for all others as if it were dropped: peers are told, all files are removed, and the
    /// instance is free. The kernel releases the private resources of this process when it ends.
    /// Closing every port here takes longer than checking many a file. Returns `false` if it was
    /// dropped instead, because others may wait for a large amount of shared memory.
    pub fn end_with_process(mut self) -> bool {
        if self.documents.bytes() > LEFT_TO_THE_END {
            return false;
        }
        self.say_goodbye();
        self.admission.close();
        // Otherwise the janitor would recreate the files that are now removed.
        self.janitor = None;
        self.remains = None;
        std::mem::forget(self);
        true
    }

    fn say_goodbye(&mut self) {
        self.runtime_files.withdraw();
        self.documents.stop();
        for session in self.sessions.values_mut() {
            session.link.farewell("");
        }
    }

    /// Returns the number of this start of a broker on this instance.
    pub fn generation(&self) -> u64 {
        self.generation.number
    }

    /// Returns the next event and meanwhile sends everything queued. Cancel-safe: dropping the
    /// future loses nothing. Nothing moves on the bus unless this is awaited. Reading is split into
    /// intervals of a few milliseconds, so other tasks run however much peers send.
    pub async fn next(&mut self) -> HostEvent {
        let mut intervals = 0;
        loop {
            // This also runs while events wait, or nothing would be sent until the last is fetched.
            let more = if self.waiting.is_empty() || self.last_turn.elapsed() >= TICK {
                self.exchange()
            } else {
                false
            };
            if let Some(event) = self.waiting.pop() {
                return event;
            }
            intervals += 1;
            if more || intervals % TURNS_IN_A_ROW == 0 {
                tokio::task::yield_now().await;
            }
            if more {
                continue;
            }
            let documents = self.documents.clone();
            tokio::select! {
                () = self.waker.wait(TICK) => {}
                () = documents.published_again() => self.ring(),
            }
        }
    }

    /// Welcomes a peer. Later messages to it are sent after the welcome.
    pub fn accept(&mut self, peer: PeerId, welcome: &ToPeer) {
        self.send(peer, welcome);
        self.documents.update_connections();
        if let Err(why) = self.config.update_connections() {
            tracing::debug!(?why, "cannot connect every peer to the configuration");
        }
        if let Some(session) = self.sessions.get_mut(&peer) {
            session.link.flush();
        }
    }

    /// Refuses a peer. The session ends when the peer has read the reason, or after a second.
    pub fn refuse(&mut self, peer: PeerId, reason: &str) {
        let message = ToPeer::Refused {
            reason: reason.to_owned(),
        };
        self.send(peer, &message);
        if let Some(session) = self.sessions.get_mut(&peer) {
            session.end(Instant::now() + LINGER, reason);
        }
    }

    /// Sends a message and keeps it until the peer has acknowledged it. Never blocks. Messages to
    /// an unknown peer are dropped. Messages above [`codec::MAX_MESSAGE`] are refused and logged.
    pub fn send(&mut self, peer: PeerId, message: &ToPeer) {
        let Some(session) = self.sessions.get_mut(&peer) else {
            return;
        };
        match codec::encode(message) {
            Ok(bytes) => session.link.push(&bytes),
            Err(error) => tracing::error!(%peer, %error, "a message was not sent"),
        }
    }

    /// Returns the bytes that the peer has not acknowledged.
    pub fn backlog(&self, peer: PeerId) -> usize {
        self.sessions
            .get(&peer)
            .map_or(0, |session| session.link.backlog())
    }

    /// Returns the bytes of messages that were read but not yet fetched, for tests of the limit.
    #[doc(hidden)]
    pub fn waiting_bytes(&self) -> usize {
        self.waiting.bytes()
    }

    /// Ends a session at once and releases its window, even if the peer does not react. A peer that
    /// is still alive may introduce itself again.
    pub fn disconnect(&mut self, peer: PeerId) {
        if let Some(session) = self.sessions.get_mut(&peer) {
            session.link.farewell("");
        }
        self.sessions.remove(&peer);
    }

    /// Publishes the configuration to all peers, including later ones.
    pub fn set_config(&mut self, digest: Digest, bytes: &[u8]) {
        if let Err(why) = self.publish_config(digest, bytes) {
            tracing::error!(why, "the configuration was not published");
        }
        self.ring();
    }

    /// Returns the reason why no peer can join any more, for a person. It is returned only once.
    pub fn loss(&self) -> Option<String> {
        self.runtime_files.loss()
    }

    /// Returns the object that lends and publishes documents, from any thread.
    pub fn documents(&self) -> Documents {
        self.documents.clone()
    }

    /// Sends the queued data and reads as much as one receive budget allows, without waiting.
    /// Returns `true` if there may be more to read.
    fn exchange(&mut self) -> bool {
        let now = Instant::now();
        self.greet(now, &Budget::new(now));
        // Reading has its own budget, so repeated introductions cannot delay other messages.
        let more = self.read(&mut Budget::new(Instant::now()));
        let ticked = now.duration_since(self.last_tick) >= TICK;
        if ticked {
            self.last_tick = now;
            self.admission.exchange(now);
        }
        for session in self.sessions.values_mut() {
            if ticked {
                session.link.tick(now);
            } else {
                session.link.flush();
            }
        }
        if now.duration_since(self.last_watch) >= WATCH_EVERY {
            self.last_watch = now;
            self.watch(now);
        }
        self.last_turn = Instant::now();
        more
    }

    /// Reads a few frames from every peer, starting after the one that was read from last. Returns
    /// `true` if it stopped although there may be more.
    fn read(&mut self, budget: &mut Budget) -> bool {
        let behind = (Bound::Excluded(self.last_read), Bound::Unbounded);
        let later = self.sessions.range(behind).map(|(peer, _)| *peer);
        let earlier = self
            .sessions
            .range(..=self.last_read)
            .map(|(peer, _)| *peer);
        let order: Vec<PeerId> = later.chain(earlier).collect();
        loop {
            let mut progress = false;
            for peer in &order {
                if self.waiting.is_full() {
                    return true;
                }
                if let Some(session) = self.sessions.get_mut(peer)
                    && session.read(*peer, QUOTA, budget, &mut self.waiting)
                {
                    self.last_read = *peer;
                    progress = true;
                }
                // The check comes afterwards, so that even a slow machine reads from one peer each
                // time.
                if progress && budget.is_spent() {
                    return true;
                }
            }
            if !progress {
                return false;
            }
        }
    }

    /// Opens a session for every new peer.
    fn greet(&mut self, now: Instant, budget: &Budget) {
        for read in 0..HELLOS {
            // Opening a session is the slowest step.
            if read > 0 && budget.is_spent() {
                return;
            }
            let sample = match self.hello.receive() {
                Ok(Some(sample)) => sample,
                Ok(None) => return,
                Err(why) => {
                    tracing::debug!(?why, "cannot read introductions");
                    return;
                }
            };
            let header = *sample.user_header();
            let key = SessionKey {
                generation: self.generation.number,
                incarnation: header.incarnation,
                attempt: header.attempt,
            };
            // Introductions are repeated until they are answered, so most are known. Those of an
            // ended session may still be queued.
            let known = self.attempts.get(&key.incarnation);
            if known.is_some_and(|attempt| *attempt >= key.attempt) {
                continue;
            }
            match codec::decode::<Hello>(&sample) {
                Ok(hello) if hello.incarnation == key.incarnation => self.meet(key, hello, now),
                Ok(_) => {
                    tracing::warn!("an introduction contains another incarnation than its header");
                }
                Err(error) => tracing::warn!(%error, "an introduction cannot be read"),
            }
        }
    }

    /// Opens a session for a peer that has proven its identity.
    fn meet(&mut self, key: SessionKey, hello: Hello, now: Instant) {
        // The peer states its identity before it introduces itself.
        self.admission.exchange(now);
        let Some(known) = self.admission.take(&key) else {
            return self.is_strange(key, &hello, now);
        };
        // A session that only reports a refusal does not reserve the number.
        let mut sessions = self.sessions.values().filter(|it| !it.is_silent());
        let older = sessions.find(|it| it.key().incarnation == key.incarnation);
        if older.is_some_and(|it| !it.is_of(&known)) {
            let why = "another running process already uses this incarnation: give every process a number of its \
                       own";
            return self.refuse_hello(key, &hello, why, now);
        }
        self.open(key, hello, known, now);
    }

    /// Records an introduction without proof of identity. The proof may still arrive.
    fn is_strange(&mut self, key: SessionKey, hello: &Hello, now: Instant) {
        self.strangers
            .retain(|_, (since, _)| now.saturating_duration_since(*since) < STRANGE_FOR);
        if self.strangers.len() >= MAX_STRANGERS && !self.strangers.contains_key(&key) {
            return;
        }
        let (since, _) = *self.strangers.entry(key).or_insert((now, false));
        if now.saturating_duration_since(since) >= PROVE_WITHIN {
            let why = "it has not proven its process identity: build it with this version of qcbus, and let it \
                       connect to peers.sock in the instance's directory before it introduces itself (in another \
                       container: share that directory, and run as the same user)";
            self.refuse_hello(key, hello, why, now);
        }
    }

    /// Tells a distrusted peer the reason, once.
    fn refuse_hello(&mut self, key: SessionKey, hello: &Hello, why: &str, now: Instant) {
        let told = self.sessions.values().filter(|it| it.is_silent()).count();
        if self.strangers.get(&key).is_some_and(|(_, told)| *told) || told >= MAX_TOLD {
            return;
        }
        self.strangers.insert(key, (now, true));
        let name: String = hello.name.chars().take(64).collect();
        let why = format!("`{}`: {why}", name.escape_debug());
        match Session::open(&self.hub, &self.services, key, now) {
            Ok(session) => {
                let peer = self.number();
                self.sessions.insert(peer, session);
                self.refuse(peer, &why);
            }
            Err(error) => tracing::warn!(%error, "cannot tell a peer why it was refused"),
        }
        let len = why.len();
        self.waiting.push(HostEvent::TurnedAway { why }, len);
    }

    fn number(&mut self) -> PeerId {
        let peer = PeerId(self.next_peer);
        self.next_peer += 1;
        peer
    }

    fn open(&mut self, key: SessionKey, mut hello: Hello, known: Known, now: Instant) {
        self.supersede(&key);
        let allowed = self.limits.peers + SPARE_SESSIONS;
        if self.sessions.len() >= allowed {
            tracing::warn!(
                name = hello.name,
                "no room even to refuse a peer; it must wait"
            );
            return self.admission.keep(key, known, now);
        }
        let (process, launch) = (known.process.clone(), known.launch.clone());
        hello.pid = process.as_ref().map_or(0, Process::id);
        let mut session = match Session::open(&self.hub, &self.services, key, now) {
            Ok(session) => session,
            Err(error) => {
                tracing::warn!(%error, name = hello.name, "cannot open a session");
                return self.admission.keep(key, known, now);
            }
        };
        known.tell();
        session.is_known(known);
        let peer = self.number();
        let full = self.sessions.len() >= self.limits.peers;
        self.sessions.insert(peer, session);
        self.remember(&key);
        if full {
            let limit = self.limits.peers;
            self.refuse(
                peer,
                &format!("the broker already serves {limit} bundles and reporters"),
            );
        } else {
            let hello = HostEvent::Hello {
                peer,
                hello,
                process,
                launch,
            };
            self.waiting.push(hello, HELLO_BYTES);
        }
    }

    /// Ends the older session of a process, because it has at most one.
    fn supersede(&mut self, key: &SessionKey) {
        let older = self
            .sessions
            .iter()
            .find(|(_, session)| session.key().incarnation == key.incarnation)
            .map(|(peer, session)| (*peer, session.is_silent()));
        if let Some((peer, silent)) = older {
            self.sessions.remove(&peer);
            if !silent {
                self.waiting.push(HostEvent::Gone { peer }, 0);
            }
        }
    }

    fn remember(&mut self, key: &SessionKey) {
        if self.attempts.len() >= MAX_REMEMBERED {
            let there: Vec<u64> = self
                .sessions
                .values()
                .map(|session| session.key().incarnation)
                .collect();
            self.attempts
                .retain(|incarnation, _| there.contains(incarnation));
        }
        self.attempts.insert(key.incarnation, key.attempt);
    }

    /// Looks for peers that have died or left, and ends expired sessions.
    fn watch(&mut self, now: Instant) {
        let over: Vec<(PeerId, bool)> = self
            .sessions
            .iter_mut()
            .filter_map(|(peer, session)| {
                let ended = session.is_over(now);
                (ended || !session.is_there()).then_some((*peer, session.is_silent()))
            })
            .collect();
        for (peer, silent) in over {
            self.hear_out(peer);
            self.sessions.remove(&peer);
            if !silent {
                self.waiting.push(HostEvent::Gone { peer }, 0);
            }
        }
    }

    /// Reads the remaining messages of a departed peer, which still count. They fit its buffer.
    fn hear_out(&mut self, peer: PeerId) {
        let Some(session) = self.sessions.get_mut(&peer) else {
            return;
        };
        let mut budget = Budget::new(Instant::now());
        let mut left = FRAME_BUFFER * 2;
        while left > 0 && session.read(peer, 1, &mut budget, &mut self.waiting) {
            left -= 1;
        }
    }

    fn ring(&mut self) {
        for session in self.sessions.values_mut() {
            session.link.ring();
        }
    }

    fn publish_config(&mut self, digest: Digest, bytes: &[u8]) -> Result<(), String> {
        let mut sample = self
            .config
            .loan_slice_uninit(bytes.len().max(1))
            .map_err(|why| format!("{why:?}"))?;
        *sample.user_header_mut() = ConfigHeader {
            digest: digest.0,
            used: bytes.len() as u64,
        };
        let sample = sample.write_from_fn(|index| bytes.get(index).copied().unwrap_or(0));
        sample.send().map(|_| ()).map_err(|why| format!("{why:?}"))
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.say_goodbye();
        self.sessions.clear();
    }
}

/// Checks whether shared memory has room for a broker.
fn look_for_room(needed: u64) -> Result<(), StartError> {
    let SharedMemory { size, free } = SharedMemory::now().map_err(StartError::shared_memory)?;
    // A size of 0 means that the memory has no limit.
    match size == 0 || free >= needed {
        true => Ok(()),
        false => Err(StartError::NoSharedMemory { size, free, needed }),
    }
}

fn subscribe(hub: &Hub, row: &Topic) -> Result<Sub<u8, HelloHeader>, PortError> {
    ports::subscriber(&hub.topic(row, "")?, row)
}

fn publish(hub: &Hub, row: &Topic) -> Result<Pub<u8, ConfigHeader>, PortError> {
    ports::publisher(&hub.topic(row, "")?, row, row.loans)
}
