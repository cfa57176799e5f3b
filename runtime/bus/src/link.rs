//! The pair of channels of one session: frames of two streams over two iceoryx2 services.

use std::time::Instant;

use iceoryx2::prelude::*;
use qcbus_messages::services::FRAME_BYTES;

use crate::memory::Backing;
use crate::ports::{Pub, Sub, WakeNotifier};
use crate::stream::{BrokenStream, Incoming, Outgoing};

/// Received frames after which a separate acknowledgement is sent, if no data frame could carry it.
/// This is well below the window, so that a sender does not stall.
const ACKNOWLEDGE_EVERY: u32 = 8;

/// Useless frames in a row before a stream counts as broken: duplicates, frames after a gap, known
/// acknowledgements. A correct sender repeats one window of them at most every half a second, and
/// its useful frames arrive in between.
const MAX_USELESS: u32 = 4096;

/// Purpose of a frame; see [`FrameHeader::kind`].
const DATA: u32 = 1;
const ACKNOWLEDGEMENT: u32 = 2;
/// The sender of this frame closes the session. The payload has the reason.
const FAREWELL: u32 = 3;

/// Header of every frame.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("qcbus.FrameHeader.1")]
#[repr(C)]
pub(crate) struct FrameHeader {
    pub(crate) generation: u64,
    pub(crate) incarnation: u64,
    pub(crate) attempt: u64,
    /// Number of the frame in its stream; 0 when it carries no data.
    pub(crate) seq: u64,
    /// Number of the last frame that arrived in the other direction.
    pub(crate) ack: u64,
    pub(crate) kind: u32,
    /// 1 if the sender waits for the acknowledgement, so it must not be delayed.
    pub(crate) urgent: u32,
}

/// Identity of a session. Frames with another identity are invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct SessionKey {
    pub(crate) generation: u64,
    /// Random number of the peer's process.
    pub(crate) incarnation: u64,
    /// Counter of the sessions that the process has requested.
    pub(crate) attempt: u64,
}

impl SessionKey {
    /// Returns the part of the service names that identifies this session.
    pub(crate) fn suffix(&self) -> String {
        format!("{:016x}-{}", self.incarnation, self.attempt)
    }
}

/// Result of a drain besides messages.
#[derive(Debug, Default)]
pub(crate) struct Drained {
    /// Frames read.
    pub(crate) frames: usize,
    /// Bytes in them.
    pub(crate) bytes: usize,
    /// Reason of the farewell, if the other side has sent one.
    pub(crate) farewell: Option<String>,
    /// Error of the other side's stream, if it is broken.
    pub(crate) broken: Option<BrokenStream>,
    /// Frames that belong to no known session.
    pub(crate) foreign: usize,
}

/// Whether the receiver of messages wants another frame.
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
    /// Whether the other side waits for an acknowledgement.
    asked: bool,
    /// Frames since the last useful one.
    useless: u32,
}

impl Link {
    /// Creates a link. The other side may send messages of up to `most` bytes.
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

    /// Queues an encoded message. Full frames are sent at once, the rest with the next flush, so
    /// that consecutive messages share a frame.
    pub(crate) fn push(&mut self, message: &[u8]) {
        self.out.push(message);
        if self.out.has_full_frame() {
            self.flush();
        }
    }

    pub(crate) fn backlog(&self) -> usize {
        self.out.backlog()
    }

    /// Requests immediate acknowledgements from now on, because the session is about to end.
    pub(crate) fn hurry(&mut self) {
        self.urgent = true;
    }

    /// Sends as much as the window and the other side's buffer allow.
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

    /// Sends pending acknowledgements and repeats lost frames. Call it every [`crate::wake::TICK`].
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

    /// Tells the other side that the session ends. This is not repeated: a peer that misses it sees
    /// that the services no longer exist.
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

    /// Wakes the other side without a frame, because a shared topic has new data.
    pub(crate) fn ring(&self) {
        self.notify();
    }

    fn notify(&self) {
        if let Err(why) = self.wake.notify() {
            tracing::debug!(?why, "cannot wake the other side; it polls instead");
        }
    }

    /// Reads up to `quota` frames. `deliver` gets each completed message and returns whether it
    /// wants more.
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
            // The header is copied once, so that the checked values are the used ones.
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
        // The sender's publisher sets the length and may have slots of any size.
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

/// Returns `true` if the other side's buffer took the frame. Any other result, `Ok(0)` included,
/// means that its arrival is unknown.
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
