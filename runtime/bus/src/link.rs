//! One session's pair of channels: frames of two streams over two iceoryx2 services.

use std::time::Instant;

use iceoryx2::prelude::*;
use qcbus_messages::services::FRAME_BYTES;

use crate::memory::Backing;
use crate::ports::{Pub, Sub, WakeNotifier};
use crate::stream::{BrokenStream, Incoming, Outgoing};

/// Frames that arrive before an acknowledgement is sent on its own, when none could ride along.
/// Well below the window, so that a sender does not stall.
const ACKNOWLEDGE_EVERY: u32 = 8;

/// Frames in a row that bring nothing before a stream counts as broken: duplicates, frames after a
/// gap, acknowledgements of what is known. Honest ones send a window of them again at most every
/// half a second, and are heard in between.
const MAX_USELESS: u32 = 4096;

/// What a frame is for; see [`FrameHeader::kind`].
const DATA: u32 = 1;
const ACKNOWLEDGEMENT: u32 = 2;
/// The sender of this frame is closing the session, and why is in the payload.
const FAREWELL: u32 = 3;

/// Goes before every frame.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("qcbus.FrameHeader.1")]
#[repr(C)]
pub(crate) struct FrameHeader {
    pub(crate) generation: u64,
    pub(crate) incarnation: u64,
    pub(crate) attempt: u64,
    /// Number of the frame in its stream; 0 when it carries no data.
    pub(crate) seq: u64,
    /// The last frame that arrived in the other direction.
    pub(crate) ack: u64,
    pub(crate) kind: u32,
    /// 1: the sender waits for the acknowledgement, so please do not put it off.
    pub(crate) urgent: u32,
}

/// What a session is bound to; frames of another one are void.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct SessionKey {
    pub(crate) generation: u64,
    /// Random number of the peer's process.
    pub(crate) incarnation: u64,
    /// Counts the sessions that the process has asked for.
    pub(crate) attempt: u64,
}

impl SessionKey {
    /// The part of the service names that distinguishes this session's.
    pub(crate) fn suffix(&self) -> String {
        format!("{:016x}-{}", self.incarnation, self.attempt)
    }
}

/// What a drain found besides messages.
#[derive(Debug, Default)]
pub(crate) struct Drained {
    /// Frames read.
    pub(crate) frames: usize,
    /// Bytes in them.
    pub(crate) bytes: usize,
    /// The other side has said farewell, and why.
    pub(crate) farewell: Option<String>,
    /// The other side sends what is no stream.
    pub(crate) broken: Option<BrokenStream>,
    /// Frames that belong to no session of ours.
    pub(crate) foreign: usize,
}

/// Whether whoever gets messages wants another frame of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wants {
    More,
    NoMore,
}

/// Both directions of a session.
pub(crate) struct Link {
    key: SessionKey,
    sender: Pub<u8, FrameHeader>,
    backing: Backing,
    receiver: Sub<u8, FrameHeader>,
    wake: WakeNotifier,
    out: Outgoing,
    incoming: Incoming,
    broken: bool,
    urgent: bool,
    /// The other side waits for an acknowledgement.
    asked: bool,
    /// Frames since the last one that brought something.
    useless: u32,
}

impl Link {
    /// The other side may send messages of up to `most` bytes.
    pub(crate) fn new(
        key: SessionKey,
        (sender, backing): (Pub<u8, FrameHeader>, Backing),
        receiver: Sub<u8, FrameHeader>,
        wake: WakeNotifier,
        most: usize,
    ) -> Link {
        Link {
            key,
            sender,
            backing,
            receiver,
            wake,
            out: Outgoing::new(Instant::now()),
            incoming: Incoming::new(most),
            broken: false,
            urgent: false,
            asked: false,
            useless: 0,
        }
    }

    /// Queues an encoded message. Full frames leave at once, the rest with the next flush, so that
    /// what is said together travels together.
    pub(crate) fn push(&mut self, message: &[u8]) {
        self.out.push(message);
        if self.out.has_full_frame() {
            self.flush();
        }
    }

    pub(crate) fn backlog(&self) -> usize {
        self.out.backlog()
    }

    /// From now on acknowledgements are asked for at once: the session is about to end.
    pub(crate) fn hurry(&mut self) {
        self.urgent = true;
    }

    /// Puts on the bus what the window and the other side's buffer take.
    pub(crate) fn flush(&mut self) {
        let mut notify = false;
        let ack = self.incoming.arrived();
        while let Some((seq, bytes)) = self.out.next() {
            let header = header(self.key, DATA, seq, ack, self.urgent);
            if !transmit(&self.sender, &mut self.backing, header, bytes) {
                break;
            }
            self.out.was_taken(Instant::now());
            self.incoming.acknowledged();
            self.asked = false;
            notify = true;
        }
        if self.incoming.owed() >= ACKNOWLEDGE_EVERY || self.asked {
            notify |= self.acknowledge();
        }
        if notify {
            self.notify();
        }
    }

    /// Sends what is owed, and again what got lost. To be called every [`crate::wake::TICK`].
    pub(crate) fn tick(&mut self, now: Instant) {
        self.out.tick(now);
        if self.urgent && self.out.backlog() > 0 {
            self.notify();
        }
        self.flush();
        if self.incoming.owed() > 0 {
            self.acknowledge();
        }
    }

    fn acknowledge(&mut self) -> bool {
        let ack = self.incoming.arrived();
        let header = header(self.key, ACKNOWLEDGEMENT, 0, ack, false);
        let sent = transmit(&self.sender, &mut self.backing, header, &[]);
        if sent {
            self.incoming.acknowledged();
            self.asked = false;
        }
        sent
    }

    /// Tells the other side that the session ends. Not repeated: who misses it sees that the
    /// services are gone.
    pub(crate) fn farewell(&mut self, reason: &str) {
        let mut end = reason.len().min(1024);
        while !reason.is_char_boundary(end) {
            end -= 1;
        }
        let header = header(self.key, FAREWELL, 0, self.incoming.arrived(), false);
        let reason = &reason.as_bytes()[..end];
        transmit(&self.sender, &mut self.backing, header, reason);
        self.notify();
    }

    /// Wakes the other side without a frame: something lies on a shared topic.
    pub(crate) fn ring(&self) {
        self.notify();
    }

    fn notify(&self) {
        if let Err(why) = self.wake.notify() {
            tracing::debug!(?why, "cannot wake the other side; it looks by itself");
        }
    }

    /// Reads up to `quota` frames; `deliver` gets each message that they complete, and says whether
    /// it wants more.
    pub(crate) fn drain(
        &mut self,
        quota: usize,
        mut deliver: impl FnMut(&[u8]) -> Wants,
    ) -> Drained {
        let mut drained = Drained::default();
        let mut wants = Wants::More;
        while drained.frames < quota && wants == Wants::More && !self.broken {
            let sample = match self.receiver.receive() {
                Ok(Some(sample)) => sample,
                Ok(None) => break,
                Err(why) => {
                    tracing::debug!(?why, "cannot read a channel");
                    break;
                }
            };
            drained.frames += 1;
            drained.bytes += sample.len().min(FRAME_BYTES);
            // Copied out once, so that what is checked is what is used.
            let header = *sample.user_header();
            let taken = self.take(header, &sample, &mut drained, |message| {
                wants = deliver(message);
            });
            if let Err(broken) = taken {
                self.broken = true;
                drained.broken = Some(broken);
            }
        }
        drained
    }

    fn take(
        &mut self,
        header: FrameHeader,
        bytes: &[u8],
        drained: &mut Drained,
        deliver: impl FnMut(&[u8]),
    ) -> Result<(), BrokenStream> {
        // The sender's publisher says how long it is, and may have slots of any size.
        if bytes.len() > FRAME_BYTES {
            return Err(BrokenStream::Frame(bytes.len()));
        }
        let session = (header.generation, header.incarnation, header.attempt);
        if session != (self.key.generation, self.key.incarnation, self.key.attempt) {
            drained.foreign += 1;
            return Ok(());
        }
        let mut brings = self.out.acknowledge(header.ack, Instant::now());
        match header.kind {
            DATA => {
                self.asked |= header.urgent != 0;
                let before = self.incoming.arrived();
                self.incoming.accept(header.seq, bytes, deliver)?;
                brings |= self.incoming.arrived() > before && !bytes.is_empty();
            }
            ACKNOWLEDGEMENT => {}
            FAREWELL => {
                drained.farewell = Some(String::from_utf8_lossy(bytes).into_owned());
            }
            _ => drained.foreign += 1,
        }
        self.useless = if brings { 0 } else { self.useless + 1 };
        if self.useless > MAX_USELESS {
            return Err(BrokenStream::Useless(self.useless));
        }
        Ok(())
    }
}

fn header(key: SessionKey, kind: u32, seq: u64, ack: u64, urgent: bool) -> FrameHeader {
    FrameHeader {
        generation: key.generation,
        incarnation: key.incarnation,
        attempt: key.attempt,
        seq,
        ack,
        kind,
        urgent: u32::from(urgent),
    }
}

/// `true` when the other side's buffer took the frame. Everything else, `Ok(0)` included, means
/// that it is not known to have arrived.
fn transmit(
    sender: &Pub<u8, FrameHeader>,
    backing: &mut Backing,
    header: FrameHeader,
    bytes: &[u8],
) -> bool {
    if !backing.is_ahead() {
        return false;
    }
    let Ok(mut sample) = sender.loan_slice_uninit(bytes.len().max(1)) else {
        return false;
    };
    backing.lent(sample.payload().as_ptr().addr(), FRAME_BYTES);
    *sample.user_header_mut() = header;
    let sample = if bytes.is_empty() {
        sample.write_from_slice(&[0])
    } else {
        sample.write_from_slice(bytes)
    };
    matches!(sample.send(), Ok(recipients) if recipients > 0)
}
