//! A bundle's or reporter's end of the bus.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use qcbus_messages::{Digest, DocId, FromPeer, Hello, PROTOCOL_VERSION, ToPeer, codec};

use crate::generation::Generation;
use crate::instance::Instance;
use crate::mapped_image::MappedImage;
use crate::membership::{Membership, MembershipState};
use crate::ports::ICEORYX2_VERSION;
use crate::send_side;
use crate::wake::TICK;

/// Interval at which a peer without a session looks for one.
const SEEK_EVERY: Duration = Duration::from_millis(3);
/// Time during which a new peer looks for a broker at intervals of at most [`EAGER_EVERY`]. A peer
/// started together with its broker arrives when the broker is almost ready, and a timer takes
/// milliseconds.
const EAGER_FOR: Duration = Duration::from_millis(60);
const EAGER_EVERY: Duration = Duration::from_micros(200);
/// Wait after an attempt that failed on this side.
const SEEK_AGAIN_AFTER: Duration = Duration::from_millis(50);
/// Interval at which a peer checks whether its broker still exists.
const WATCH_EVERY: Duration = Duration::from_millis(60);
/// Maximum wait for the last acknowledgement when leaving.
const LEAVE_WITHIN: Duration = Duration::from_secs(3);
/// Maximum number of unfetched events before reading pauses.
const MAX_WAITING: usize = 256;

/// Reason for closing a lost session that is not followed by another one.
const LOST: &str = "the session was lost";

/// Time limits and rejoin behaviour of a peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeerOptions {
    /// Time to look for a broker when joining for the first time.
    pub patience: Duration,
    /// Time to wait for a broker after its loss.
    pub grace: Duration,
    /// Whether a new session follows a lost one. A process that cannot open files any more gets no
    /// second session: it is closed at once. It cannot remove the files of the first session
    /// either. They stay until the process ends, which must happen soon after.
    pub rejoins: bool,
}

impl Default for PeerOptions {
    fn default() -> Self {
        PeerOptions {
            patience: Duration::from_secs(2),
            grace: Duration::from_secs(10),
            rejoins: true,
        }
    }
}

/// Statements of a peer about itself.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claims {
    /// Version of the messages.
    pub protocol: u32,
    /// Whether it proves its identity.
    pub proves: bool,
}

impl Default for Claims {
    fn default() -> Self {
        Claims {
            protocol: PROTOCOL_VERSION,
            proves: true,
        }
    }
}

/// Reason why a peer cannot join.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JoinError {
    /// No broker serves the instance.
    #[error("no broker serves instance `{instance}`; start one with `qcbus serve`")]
    NoBroker {
        /// The instance.
        instance: String,
    },
    /// The broker speaks another version of the messages.
    #[error(
        "the broker speaks protocol {theirs}, this program speaks {ours}; install the same version of both"
    )]
    ProtocolMismatch {
        /// Version of this program.
        ours: u32,
        /// Version of the broker.
        theirs: u32,
    },
    /// The broker uses another version of iceoryx2.
    #[error(
        "the broker uses iceoryx2 {theirs}, this program uses {ours}; install the same version of both"
    )]
    IceoryxMismatch {
        /// Version of this program.
        ours: String,
        /// Version of the broker.
        theirs: String,
    },
    /// The broker refuses this peer, with this reason.
    #[error("the broker refused: {0}")]
    Refused(String),
    /// The introduction does not fit a slot.
    #[error("the introduction is too large: {0}")]
    HelloTooLarge(String),
    /// A broker exists, but it does not answer.
    #[error("the broker, process {pid}, does not answer{}", .why.as_ref().map(|why| format!(": {why}")).unwrap_or_default())]
    NoAnswer {
        /// Process id of the broker.
        pid: u32,
        /// The last failure on this side.
        why: Option<String>,
    },
}

/// An event that a peer must handle.
#[derive(Debug)]
pub enum PeerEvent {
    /// The broker has sent a message. The first one is always the welcome.
    Message(ToPeer),
    /// A document has arrived. [`Peer::document`] returns it.
    Document(DocId),
    /// The broker needs shared memory. Cached documents that no job uses must be dropped.
    LetGo,
    /// A configuration has arrived. [`Peer::config`] returns it.
    Config(Digest),
    /// This is a new session after the old one ended without a message. Older jobs, document
    /// numbers and unsent messages are invalid. Held documents stay readable. A welcome follows.
    Rejoined,
    /// The session is over and no other one follows.
    Closed {
        /// Text for a person.
        reason: String,
    },
}

enum State {
    /// The peer has a session or is joining.
    Member(Box<Membership>),
    /// The peer has no broker.
    Seeking,
    Closed(String),
}

/// A bundle's or reporter's end of the bus.
pub struct Peer {
    instance: Instance,
    hello: Hello,
    proves: bool,
    options: PeerOptions,
    attempts: u64,
    state: State,
    /// Time since which there is no session.
    lost: Option<Instant>,
    joined_before: bool,
    last_error: Option<String>,
    last_watch: Instant,
    seek_at: Instant,
    events: VecDeque<PeerEvent>,
    config: Option<(Digest, Arc<[u8]>)>,
}

impl Peer {
    /// Joins the broker of an instance. Must be called within a tokio runtime. It fills in
    /// `hello.protocol` and `hello.pid`.
    ///
    /// # Errors
    /// See [`JoinError`].
    pub async fn join(
        instance: &Instance,
        hello: Hello,
        options: PeerOptions,
    ) -> Result<Peer, JoinError> {
        let hello = Hello {
            pid: std::process::id(),
            ..hello
        };
        Peer::join_claiming(Claims::default(), instance, hello, options).await
    }

    /// Joins with these claims and with the process id in `hello`. This is for tests of how a
    /// broker treats a peer of another version, or one with false claims.
    #[doc(hidden)]
    pub async fn join_claiming(
        claims: Claims,
        instance: &Instance,
        hello: Hello,
        options: PeerOptions,
    ) -> Result<Peer, JoinError> {
        let mut peer = Peer {
            instance: instance.clone(),
            hello: Hello {
                protocol: claims.protocol,
                ..hello
            },
            proves: claims.proves,
            options,
            // Successive processes may have the same incarnation.
            attempts: u64::from(std::process::id()) << 32,
            state: State::Seeking,
            lost: Some(Instant::now()),
            joined_before: false,
            last_error: None,
            last_watch: Instant::now(),
            seek_at: Instant::now(),
            events: VecDeque::new(),
            config: None,
        };
        let until = Instant::now() + options.patience;
        // An existing broker gets more time, because it may be busy starting.
        let answer_until = until.max(Instant::now() + options.grace);
        loop {
            peer.exchange()?;
            if peer.joined_before {
                send_side::joined();
                return Ok(peer);
            }
            let now = Instant::now();
            match (&peer.state, Generation::current(instance)) {
                (State::Closed(reason), _) => return Err(JoinError::Refused(reason.clone())),
                (State::Seeking, None) if now >= until => return Err(peer.no_broker()),
                (_, Some(generation)) if now >= answer_until => {
                    return Err(match generation.broker() {
                        None => peer.no_broker(),
                        Some(_) => JoinError::NoAnswer {
                            pid: generation.pid,
                            why: peer.last_error.take(),
                        },
                    });
                }
                (State::Seeking, Some(generation))
                    if now >= until && generation.broker().is_none() =>
                {
                    return Err(peer.no_broker());
                }
                (_, None) if now >= answer_until => return Err(peer.no_broker()),
                _ => peer.wait().await,
            }
        }
    }

    /// Returns the next event and meanwhile sends everything queued. Cancel-safe: dropping the
    /// future loses nothing. Nothing moves on the bus unless this is awaited. After
    /// [`PeerEvent::Closed`], every call returns it again.
    pub async fn next(&mut self) -> PeerEvent {
        loop {
            if let Some(event) = self.events.pop_front() {
                return event;
            }
            if let State::Closed(reason) = &self.state {
                return PeerEvent::Closed {
                    reason: reason.clone(),
                };
            }
            if let Err(error) = self.exchange() {
                self.close(error.to_string());
            }
            if self.events.is_empty() && !matches!(self.state, State::Closed(_)) {
                self.wait().await;
            }
        }
    }

    /// Sends a message and keeps it until the broker has acknowledged it. Never blocks. Without a
    /// session it sends nothing, because a new session invalidates everything older. A message
    /// above the broker's limit ([`codec::MAX_FROM_PEER`]) ends the session.
    pub fn send(&mut self, message: &FromPeer) {
        let State::Member(membership) = &mut self.state else {
            return;
        };
        match codec::encode(message) {
            Ok(bytes) => membership.push(&bytes),
            Err(error) => {
                tracing::error!(%error, "cannot send a message, the session ends");
                // Without it, the broker would take the other messages for complete. Empty ones are
                // invalid.
                membership.push(&[]);
            }
        }
    }

    /// Sends bytes that are not a message, for tests of the broker.
    #[doc(hidden)]
    pub fn send_garbage(&mut self, bytes: &[u8]) {
        if let State::Member(membership) = &mut self.state {
            membership.push(bytes);
        }
    }

    /// Returns the bytes that the broker has not acknowledged.
    pub fn backlog(&self) -> usize {
        match &self.state {
            State::Member(membership) => membership.backlog(),
            _ => 0,
        }
    }

    /// Returns a document, read in place, or `None` if it has not arrived or was released for room.
    pub fn document(&self, doc: DocId) -> Option<MappedImage> {
        match &self.state {
            State::Member(membership) => membership.library().get(doc),
            _ => None,
        }
    }

    /// Marks a document as finished, so that it is released first when room is needed.
    pub fn forget(&mut self, doc: DocId) {
        if let State::Member(membership) = &mut self.state {
            membership.library_mut().forget(doc);
        }
    }

    /// Returns the latest configuration and its digest.
    pub fn config(&self) -> Option<(Digest, Arc<[u8]>)> {
        self.config.clone()
    }

    /// Ends the session when the broker has acknowledged everything, or after three seconds.
    pub async fn leave(mut self) {
        let until = Instant::now() + LEAVE_WITHIN;
        if let State::Member(membership) = &mut self.state {
            membership.hurry();
        }
        while let State::Member(membership) = &mut self.state {
            membership.flush();
            let broker_is_there = membership.broker_is_there(&self.instance);
            if membership.backlog() == 0 || Instant::now() >= until || !broker_is_there {
                membership.farewell();
                return;
            }
            membership.wait(TICK).await;
            // Messages that arrive now are ignored, but the acknowledgements among them are needed.
            membership.read(usize::MAX, &mut VecDeque::new(), &mut None);
        }
    }

    /// Returns the root directory of its generation, or `None` without a session. Read access to
    /// its files is all that a peer in session needs.
    pub fn memory(&self) -> Option<&Path> {
        match &self.state {
            State::Member(membership) => Some(membership.root()),
            _ => None,
        }
    }

    /// Checks whether it is closed because its session was lost and it does not rejoin (see
    /// [`PeerOptions::rejoins`]).
    pub fn has_lost_its_session(&self) -> bool {
        matches!(&self.state, State::Closed(reason) if reason == LOST)
    }

    fn no_broker(&self) -> JoinError {
        JoinError::NoBroker {
            instance: self.instance.name().to_owned(),
        }
    }

    async fn wait(&self) {
        match &self.state {
            State::Member(membership) if membership.is_welcome() => membership.wait(TICK).await,
            State::Member(membership) => membership.wait(SEEK_EVERY).await,
            _ if self.is_eager() => {
                std::thread::sleep(EAGER_EVERY);
                tokio::task::yield_now().await;
            }
            _ => tokio::time::sleep(SEEK_EVERY).await,
        }
    }

    /// Checks whether it has just started to look for a broker and no attempt to join has failed.
    fn is_eager(&self) -> bool {
        let since = self.lost.filter(|_| !self.joined_before);
        since.is_some_and(|since| since.elapsed() < EAGER_FOR) && self.seek_at <= Instant::now()
    }

    fn close(&mut self, reason: String) {
        self.change(State::Closed(reason));
    }

    /// Changes the state and drops the files of the old session. If this process may no longer
    /// remove them, the broker's janitor does so after the process has ended.
    fn change(&mut self, state: State) {
        let earlier = std::mem::replace(&mut self.state, state);
        if self.joined_before && !self.options.rejoins {
            std::mem::forget(earlier);
        }
    }

    /// Does everything that is possible without waiting.
    fn exchange(&mut self) -> Result<(), JoinError> {
        let now = Instant::now();
        if matches!(self.state, State::Seeking) && now >= self.seek_at {
            self.seek()?;
        }
        if let State::Member(membership) = &mut self.state {
            let membership_state =
                membership.exchange(now, MAX_WAITING, &mut self.events, &mut self.config);
            self.take_note(membership_state, now);
        }
        if now.duration_since(self.last_watch) >= WATCH_EVERY {
            self.last_watch = now;
            self.watch(now);
        }
        self.give_up(now);
        Ok(())
    }

    fn take_note(&mut self, membership_state: MembershipState, now: Instant) {
        match membership_state {
            MembershipState::Waiting | MembershipState::Welcome => {}
            MembershipState::JustWelcomed => {
                if self.joined_before {
                    self.events.push_front(PeerEvent::Rejoined);
                }
                self.joined_before = true;
                self.lost = None;
            }
            MembershipState::Refused(reason) => self.close(reason),
            MembershipState::Failed(why) => {
                self.last_error = Some(why);
                self.lose(now);
            }
            MembershipState::Ended => self.lose(now),
        }
    }

    fn lose(&mut self, now: Instant) {
        self.change(if self.joined_before && !self.options.rejoins {
            State::Closed(LOST.to_owned())
        } else {
            State::Seeking
        });
        // Unfetched events belong to the session that is over.
        self.events.clear();
        self.lost.get_or_insert(now);
    }

    /// Tries to join the current generation, if there is one.
    fn seek(&mut self) -> Result<(), JoinError> {
        let Some(generation) = Generation::current(&self.instance) else {
            return Ok(());
        };
        let Some(broker) = generation.broker() else {
            return Ok(());
        };
        check_versions(&generation)?;
        self.attempts += 1;
        self.seek_at = Instant::now() + SEEK_AGAIN_AFTER;
        match Membership::begin(
            &self.instance,
            generation,
            broker,
            &self.hello,
            self.attempts,
            self.proves,
        ) {
            Ok(membership) => self.state = State::Member(Box::new(membership)),
            Err(crate::membership::BeginError::Hello(why)) => {
                return Err(JoinError::HelloTooLarge(why));
            }
            // The broker may have just ended or may not be ready. The next attempt shows it.
            Err(crate::membership::BeginError::Port(why)) => self.last_error = Some(why),
        }
        Ok(())
    }

    fn watch(&mut self, now: Instant) {
        if let State::Member(membership) = &mut self.state
            && !membership.broker_is_there(&self.instance)
        {
            // Its earlier messages are invalid, because the next session starts afresh.
            self.lose(now);
        }
    }

    fn give_up(&mut self, now: Instant) {
        if let Some(since) = self.lost
            && self.joined_before
            && now.duration_since(since) >= self.options.grace
        {
            let seconds = self.options.grace.as_secs_f32();
            self.close(format!("the broker has been unavailable for {seconds} s"));
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.change(State::Seeking);
    }
}

fn check_versions(generation: &Generation) -> Result<(), JoinError> {
    if generation.protocol != PROTOCOL_VERSION {
        return Err(JoinError::ProtocolMismatch {
            ours: PROTOCOL_VERSION,
            theirs: generation.protocol,
        });
    }
    if generation.iceoryx2 != ICEORYX2_VERSION {
        return Err(JoinError::IceoryxMismatch {
            ours: ICEORYX2_VERSION.to_owned(),
            theirs: generation.iceoryx2.clone(),
        });
    }
    Ok(())
}
