//! A misbehaving peer.

use std::collections::VecDeque;
use std::os::unix::net::UnixStream;
use std::sync::{Mutex, PoisonError};

use qcbus_messages::services::{Growth, Services, Topic};

use crate::admission::introduce;
use crate::generation::Generation;
use crate::host::HelloHeader;
use crate::instance::Instance;
use crate::link::{FrameHeader, SessionKey};
use crate::ports::{self, Hub, Pub, Sub, WakeNotifier};
use crate::removal_lock::RemovalLock;

/// Frame header that can be filled with anything.
#[derive(Debug, Clone, Copy, Default)]
pub struct Header {
    /// Generation, as in `current`.
    pub generation: u64,
    /// Incarnation, as in the introduction.
    pub incarnation: u64,
    /// Attempt, as in the introduction.
    pub attempt: u64,
    /// Number of the frame; the first is 1.
    pub seq: u64,
    /// Number of the last frame that arrived.
    pub ack: u64,
    /// 1 data, 2 acknowledgement, 3 farewell.
    pub kind: u32,
    /// Whether an acknowledgement is requested.
    pub urgent: u32,
}

/// Both ends of a session's channels, as far as they are open.
struct Channels {
    from: Pub<u8, FrameHeader>,
    to: Option<Sub<u8, FrameHeader>>,
}

/// Peer that can send arbitrary data.
pub struct Rogue {
    services: Services,
    generation: u64,
    channels: Option<Channels>,
    hello: Pub<u8, HelloHeader>,
    wake: WakeNotifier,
    /// Removal lock. A rogue uses it only so that it leaves no files in removed memory, because
    /// tests check that.
    removal_lock: RemovalLock,
    hub: Hub,
    instance: Instance,
    /// Latest proofs of the identity of this process.
    proofs: Mutex<VecDeque<UnixStream>>,
}

/// Maximum number of proofs that are kept. With more simultaneous sessions the first ones have no
/// proof.
const PROOFS: usize = 64;

impl Rogue {
    /// Joins the bus of an instance without registration.
    ///
    /// # Errors
    /// A text, if there is no broker or the bus refuses.
    pub fn new(instance: &Instance) -> Result<Rogue, String> {
        let generation = Generation::current(instance).ok_or("no broker")?;
        let services = Services::new(&generation.limits);
        let removal_lock = RemovalLock::of(&generation.root)
            .map_err(|lock_for_removal| lock_for_removal.to_string())?;
        let inside = removal_lock
            .enter()
            .map_err(|lock_for_removal| lock_for_removal.to_string())?;
        let hub = Hub::join(&inside).map_err(|error| in_words(&error))?;
        let greetings = hub
            .topic(&services.hello, "")
            .map_err(|error| in_words(&error))?;
        let hello = growing(services.hello);
        let wake = hub
            .wake(&services.wake_broker, "")
            .map_err(|error| in_words(&error))?;
        Ok(Rogue {
            channels: None,
            hello: ports::publisher(&greetings, &hello, hello.loans)
                .map_err(|error| in_words(&error))?,
            wake: ports::notifier(&wake).map_err(|error| in_words(&error))?,
            generation: generation.number,
            services,
            removal_lock: removal_lock.clone(),
            hub,
            instance: instance.clone(),
            proofs: Mutex::default(),
        })
    }

    /// Returns the number of the broker's generation.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Sends a hello with arbitrary bytes, and lets the kernel prove the identity of the process.
    /// Returns `false` if it was not delivered.
    pub fn introduce(&self, incarnation: u64, attempt: u64, bytes: &[u8]) -> bool {
        self.prove(incarnation, attempt);
        let header = HelloHeader {
            incarnation,
            attempt,
        };
        let Ok(mut sample) = self.hello.loan_slice_uninit(bytes.len()) else {
            return false;
        };
        *sample.user_header_mut() = header;
        let sent = sample.write_from_slice(bytes).send();
        self.ring();
        matches!(sent, Ok(recipients) if recipients > 0)
    }

    fn prove(&self, incarnation: u64, attempt: u64) {
        let key = SessionKey {
            generation: self.generation,
            incarnation,
            attempt,
        };
        let mut proofs = self.proofs.lock().unwrap_or_else(PoisonError::into_inner);
        // The broker limits the number of listened connections. Above the limit there is no proof.
        proofs.extend(introduce(&self.instance, key));
        while proofs.len() > PROOFS {
            proofs.pop_front();
        }
    }

    /// Opens the channels of a session, if the broker has created them. With `reads` it also opens
    /// the channel that the broker writes to. Without that one the broker assumes that the peer is
    /// missing.
    pub fn connect(&mut self, incarnation: u64, attempt: u64, reads: bool) -> bool {
        let key = SessionKey {
            generation: self.generation,
            incarnation,
            attempt,
        };
        let Ok(_inside) = self.removal_lock.enter() else {
            return false;
        };
        let suffix = key.suffix();
        let (to_row, from_row) = (self.services.to_peer, growing(self.services.from_peer));
        let open = || -> Result<Channels, ports::PortError> {
            let to = self.hub.topic(&to_row, &suffix)?;
            let from = self.hub.topic(&self.services.from_peer, &suffix)?;
            let to = reads.then(|| ports::subscriber(&to, &to_row)).transpose()?;
            let from = ports::publisher(&from, &from_row, from_row.loans)?;
            Ok(Channels { from, to })
        };
        let opened = open();
        let connected = opened.is_ok();
        if let Ok(channels) = opened {
            self.channels = Some(channels);
        }
        connected
    }

    /// Puts a frame into the broker's buffer. Returns `false` if the buffer is full or missing.
    pub fn send(&self, header: Header, bytes: &[u8]) -> bool {
        let Some(channels) = &self.channels else {
            return false;
        };
        let Ok(mut sample) = channels.from.loan_slice_uninit(bytes.len()) else {
            return false;
        };
        *sample.user_header_mut() = FrameHeader {
            generation: header.generation,
            incarnation: header.incarnation,
            attempt: header.attempt,
            seq: header.seq,
            ack: header.ack,
            kind: header.kind,
            urgent: header.urgent,
        };
        let sent = sample.write_from_slice(bytes).send();
        matches!(sent, Ok(recipients) if recipients > 0)
    }

    /// Reads one frame of the broker and returns its number.
    pub fn receive(&self) -> Option<u64> {
        let receiver = self.channels.as_ref()?.to.as_ref()?;
        let sample = receiver.receive().ok()??;
        Some(sample.user_header().seq)
    }

    /// Wakes the broker.
    pub fn ring(&self) {
        // The broker may be gone. Then it needs no wake-up.
        let _ = self.wake.notify();
    }

    /// Closes the session's channels without a farewell.
    pub fn hang_up(&mut self) {
        self.channels = None;
    }
}

/// Returns the topic with growing slots. A publisher chooses its slot sizes itself, because no
/// service limits them.
fn growing(row: Topic) -> Topic {
    Topic {
        growth: Growth::PowerOfTwo,
        ..row
    }
}

fn in_words(error: &ports::PortError) -> String {
    error.to_string()
}
