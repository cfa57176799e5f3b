//! A reliable, ordered stream of messages over frames that may get lost: pure logic, no I/O.
//!
//! A message is written as a length of four bytes and its bytes. Messages are packed into frames
//! back to back. So a frame carries many small ones and a large one spans many frames. Frames are
//! numbered from 1. The sender keeps each frame until it is acknowledged. The receiver takes only
//! the next in order, drops duplicates and frames after a gap, and acknowledges cumulatively.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use qcbus_messages::codec::MAX_MESSAGE;
use qcbus_messages::services::{FRAME_BYTES, FRAME_WINDOW};

/// Time without an acknowledgement after which taken frames are sent again. A frame in the
/// receiver's buffer is not normally lost, so this only covers unexpected cases.
const RESEND_AFTER: Duration = Duration::from_millis(500);
const RESEND_AT_MOST_EVERY: Duration = Duration::from_secs(8);

/// The sending half.
#[derive(Debug)]
pub(crate) struct Outgoing {
    /// Unacknowledged frames in order. The last one may still be filled if it was never sent.
    frames: VecDeque<Vec<u8>>,
    /// Number of the first of `frames`.
    base: u64,
    /// Number of `frames` that the receiver's buffer has taken.
    taken: usize,
    /// Number of `frames` that were tried at least once and must not change any more.
    sealed: usize,
    spare: Vec<Vec<u8>>,
    bytes: usize,
    last_progress: Instant,
    patience: Duration,
}

impl Outgoing {
    pub(crate) fn new(now: Instant) -> Outgoing {
        Outgoing {
            frames: VecDeque::new(),
            base: 1,
            taken: 0,
            sealed: 0,
            spare: Vec::new(),
            bytes: 0,
            last_progress: now,
            patience: RESEND_AFTER,
        }
    }

    /// Appends a message. The caller must check that it is not larger than [`MAX_MESSAGE`].
    pub(crate) fn push(&mut self, message: &[u8]) {
        debug_assert!(message.len() <= MAX_MESSAGE);
        let length = u32::try_from(message.len()).unwrap_or(u32::MAX);
        self.append(&length.to_le_bytes());
        self.append(message);
    }

    fn append(&mut self, mut bytes: &[u8]) {
        self.bytes += bytes.len();
        while !bytes.is_empty() {
            let room = match self.frames.back() {
                Some(frame) if self.frames.len() > self.sealed => FRAME_BYTES - frame.len(),
                _ => 0,
            };
            if room == 0 {
                let fresh = self.spare.pop().unwrap_or_default();
                self.frames.push_back(fresh);
                continue;
            }
            let (now, later) = bytes.split_at(room.min(bytes.len()));
            if let Some(frame) = self.frames.back_mut() {
                frame.extend_from_slice(now);
            }
            bytes = later;
        }
    }

    /// Returns the next frame to send, with its number. Returns `None` if all frames were taken or
    /// the window is full. A returned frame no longer changes.
    pub(crate) fn next(&mut self) -> Option<(u64, &[u8])> {
        if self.taken >= self.frames.len().min(FRAME_WINDOW) {
            return None;
        }
        self.sealed = self.sealed.max(self.taken + 1);
        Some((self.base + self.taken as u64, &self.frames[self.taken]))
    }

    /// Records that the receiver's buffer took the frame returned by [`Outgoing::next`].
    pub(crate) fn was_taken(&mut self, now: Instant) {
        if self.taken == 0 {
            self.last_progress = now;
        }
        self.taken += 1;
    }

    /// Records that everything up to and including `seq` has arrived. Numbers that were never sent
    /// are ignored. Returns `true` if this is new.
    pub(crate) fn acknowledge(&mut self, seq: u64, now: Instant) -> bool {
        if seq < self.base || seq >= self.base + self.sealed as u64 {
            return false;
        }
        let arrived = (seq + 1 - self.base) as usize;
        for mut frame in self.frames.drain(..arrived) {
            self.bytes -= frame.len();
            frame.clear();
            if self.spare.len() < FRAME_WINDOW {
                self.spare.push(frame);
            }
        }
        self.base = seq + 1;
        self.taken = self.taken.saturating_sub(arrived);
        self.sealed -= arrived;
        self.last_progress = now;
        self.patience = RESEND_AFTER;
        true
    }

    /// Goes back to the first unacknowledged frame after too long without progress.
    pub(crate) fn tick(&mut self, now: Instant) {
        if self.taken > 0 && now.duration_since(self.last_progress) >= self.patience {
            self.taken = 0;
            self.last_progress = now;
            self.patience = (self.patience * 2).min(RESEND_AT_MOST_EVERY);
        }
    }

    /// Returns the bytes not yet acknowledged.
    pub(crate) fn backlog(&self) -> usize {
        self.bytes
    }

    /// Checks whether more than one frame waits.
    pub(crate) fn has_full_frame(&self) -> bool {
        self.frames.len() > self.taken + 1
    }
}

/// Reason why the received data is not a valid stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum BrokenStream {
    /// The length of a message is invalid.
    #[error("a message of {announced} bytes was announced; at most {most} are allowed")]
    Message {
        /// Announced length in bytes.
        announced: usize,
        /// Maximum length of a message from this sender in bytes.
        most: usize,
    },
    /// The length of a frame is invalid.
    #[error("a frame of {0} bytes was received; at most {FRAME_BYTES} are allowed")]
    Frame(usize),
    /// Too many useless frames arrived in a row.
    #[error("{0} useless frames were received in a row")]
    Useless(u32),
}

/// The receiving half.
#[derive(Debug)]
pub(crate) struct Incoming {
    /// Maximum size of a message from the other side in bytes.
    most: usize,
    /// Number of the last frame taken.
    arrived: u64,
    /// Frames since the last acknowledgement was sent.
    owed: u32,
    length: Vec<u8>,
    body: Vec<u8>,
}

impl Incoming {
    /// Creates the receiving half. No message may have more than `most` bytes.
    pub(crate) fn new(most: usize) -> Incoming {
        Incoming {
            most,
            arrived: 0,
            owed: 0,
            length: Vec::new(),
            body: Vec::new(),
        }
    }

    /// Takes a frame and calls `deliver` with each message that it completes.
    ///
    /// # Errors
    /// Returns [`BrokenStream`]. Later frames cannot be understood, so the session must end.
    pub(crate) fn accept(
        &mut self,
        seq: u64,
        mut bytes: &[u8],
        mut deliver: impl FnMut(&[u8]),
    ) -> Result<(), BrokenStream> {
        self.owed = self.owed.saturating_add(1);
        if seq != self.arrived + 1 {
            return Ok(());
        }
        self.arrived = seq;
        while !bytes.is_empty() || self.expected() == Some(0) {
            let Some(expected) = self.expected() else {
                bytes = fill(&mut self.length, 4, bytes);
                if let Some(length) = self.expected()
                    && length > self.most
                {
                    let (announced, most) = (length, self.most);
                    return Err(BrokenStream::Message { announced, most });
                }
                continue;
            };
            if self.body.is_empty() && bytes.len() >= expected {
                // The whole message lies in this frame, so it need not be copied.
                let (message, rest) = bytes.split_at(expected);
                deliver(message);
                bytes = rest;
                self.length.clear();
                continue;
            }
            // Memory grows with the received bytes, not with the announced length.
            bytes = fill(&mut self.body, expected, bytes);
            if self.body.len() == expected {
                deliver(&self.body);
                self.body = Vec::new();
                self.length.clear();
            }
        }
        Ok(())
    }

    fn expected(&self) -> Option<usize> {
        let length: [u8; 4] = self.length.as_slice().try_into().ok()?;
        Some(u32::from_le_bytes(length) as usize)
    }

    /// Returns the number of the last frame taken in order.
    pub(crate) fn arrived(&self) -> u64 {
        self.arrived
    }

    /// Returns the number of frames that arrived since [`Incoming::acknowledged`] was called.
    pub(crate) fn owed(&self) -> u32 {
        self.owed
    }

    /// Records that an acknowledgement was sent.
    pub(crate) fn acknowledged(&mut self) {
        self.owed = 0;
    }
}

fn fill<'a>(target: &mut Vec<u8>, wanted: usize, bytes: &'a [u8]) -> &'a [u8] {
    let (now, later) = bytes.split_at(bytes.len().min(wanted - target.len()));
    target.extend_from_slice(now);
    later
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use qcbus_messages::codec::MAX_FROM_PEER;

    use super::*;

    /// A simulated wire that may refuse, drop or repeat a frame, and may lose acknowledgements.
    #[derive(Debug, Clone, Copy)]
    enum Fate {
        Arrives,
        IsRefused,
        IsLost,
        ArrivesTwice,
        ArrivesUnacknowledged,
    }

    fn fate() -> impl Strategy<Value = Fate> {
        prop_oneof![
            4 => Just(Fate::Arrives),
            1 => Just(Fate::IsRefused),
            1 => Just(Fate::IsLost),
            1 => Just(Fate::ArrivesTwice),
            1 => Just(Fate::ArrivesUnacknowledged),
        ]
    }

    fn message() -> impl Strategy<Value = Vec<u8>> {
        let len = prop_oneof![0..40_usize, Just(FRAME_BYTES - 4), 16_000..60_000_usize];
        (len, any::<u8>()).prop_map(|(len, byte)| vec![byte; len])
    }

    fn receive(incoming: &mut Incoming, seq: u64, bytes: &[u8], got: &mut Vec<Vec<u8>>) {
        incoming
            .accept(seq, bytes, |message| got.push(message.to_vec()))
            .unwrap();
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn every_message_arrives_once_and_in_order(
            messages in prop::collection::vec(message(), 0..60),
            fates in prop::collection::vec(fate(), 1..200),
        ) {
            let mut now = Instant::now();
            let (mut out, mut incoming) = (Outgoing::new(now), Incoming::new(MAX_MESSAGE));
            let mut got = Vec::new();
            let mut fates = fates.into_iter().cycle();
            let mut to_send = messages.iter();
            for round in 0.. {
                if let Some(message) = to_send.next() {
                    out.push(message);
                } else if out.backlog() == 0 {
                    break;
                }
                // After a limited number of rounds every frame arrives, so that the test ends.
                let fate = fates.next().filter(|_| round < 2_000).unwrap_or(Fate::Arrives);
                if let Some((seq, bytes)) = out.next() {
                    match fate {
                        Fate::IsRefused => continue,
                        Fate::IsLost => {}
                        Fate::ArrivesTwice => {
                            receive(&mut incoming, seq, bytes, &mut got);
                            receive(&mut incoming, seq, bytes, &mut got);
                        }
                        _ => receive(&mut incoming, seq, bytes, &mut got),
                    }
                    out.was_taken(now);
                }
                if !matches!(fate, Fate::ArrivesUnacknowledged) {
                    out.acknowledge(incoming.arrived(), now);
                }
                now += Duration::from_millis(100);
                out.tick(now);
                prop_assert!(round < 20_000, "the transfer must end");
            }
            prop_assert_eq!(got, messages);
        }

        #[test]
        fn arbitrary_frames_never_panic(
            frames in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..64), 0..32),
        ) {
            let mut incoming = Incoming::new(MAX_MESSAGE);
            for (seq, frame) in (1..).zip(&frames) {
                if incoming.accept(seq, frame, |_| {}).is_err() {
                    break;
                }
            }
        }
    }

    #[test]
    fn small_messages_share_a_frame() {
        let now = Instant::now();
        let mut out = Outgoing::new(now);
        for _ in 0..100 {
            out.push(&[7; 100]);
        }
        let (seq, bytes) = out.next().unwrap();
        assert_eq!((seq, bytes.len()), (1, 100 * 104));
        out.was_taken(now);
        assert!(out.next().is_none());
        // A returned frame does not change. More data goes into the next frame.
        out.push(&[8; 10]);
        assert_eq!(
            out.next().unwrap(),
            (2, &[&[10, 0, 0, 0], &[8; 10][..]].concat()[..])
        );
    }

    #[test]
    fn full_window_stops_the_sender_until_acknowledged() {
        let now = Instant::now();
        let mut out = Outgoing::new(now);
        out.push(&vec![0; FRAME_BYTES * (FRAME_WINDOW + 10)]);
        for _ in 0..FRAME_WINDOW {
            assert!(out.next().is_some());
            out.was_taken(now);
        }
        assert!(out.next().is_none());
        out.acknowledge(5, now);
        for seq in 1..=5 {
            assert_eq!(out.next().unwrap().0, (FRAME_WINDOW + seq) as u64);
            out.was_taken(now);
        }
        assert!(out.next().is_none());
    }

    #[test]
    fn acknowledgement_of_an_unsent_frame_is_ignored() {
        let now = Instant::now();
        let mut out = Outgoing::new(now);
        out.push(&[1]);
        out.acknowledge(1, now);
        out.acknowledge(u64::MAX, now);
        assert_eq!(out.backlog(), 5);
        assert_eq!(out.next().unwrap().0, 1);
    }

    #[test]
    fn hostile_length_reserves_nothing_and_ends_the_stream() {
        let mut incoming = Incoming::new(MAX_MESSAGE);
        let huge = u32::try_from(MAX_MESSAGE).unwrap();
        incoming.accept(1, &huge.to_le_bytes(), |_| {}).unwrap();
        assert!(incoming.body.capacity() == 0);
        incoming.accept(2, &[0; 100], |_| {}).unwrap();
        assert!(incoming.body.capacity() < 1_000);
        let mut incoming = Incoming::new(MAX_MESSAGE);
        let too_long = (huge + 1).to_le_bytes();
        let broken = BrokenStream::Message {
            announced: MAX_MESSAGE + 1,
            most: MAX_MESSAGE,
        };
        assert_eq!(incoming.accept(1, &too_long, |_| {}), Err(broken));
    }

    #[test]
    fn peer_may_announce_less_than_a_broker() {
        let largest = u32::try_from(MAX_FROM_PEER).unwrap();
        let mut incoming = Incoming::new(MAX_FROM_PEER);
        assert_eq!(incoming.accept(1, &largest.to_le_bytes(), |_| {}), Ok(()));
        let mut incoming = Incoming::new(MAX_FROM_PEER);
        let said = incoming.accept(1, &(largest + 1).to_le_bytes(), |_| {});
        let text = said.unwrap_err().to_string();
        assert!(
            text.contains("4194305") && text.contains("4194304"),
            "{text}"
        );
    }
}
