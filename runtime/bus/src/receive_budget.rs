//! Receive budget: limits how much the broker reads from its peers before other tasks run.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::host::HostEvent;

/// Bytes of frames read per receive budget.
const TURN_BYTES: usize = 1 << 20;
/// Time of reading per receive budget.
const TURN_TIME: Duration = Duration::from_millis(2);
/// Cost of a frame in addition to its bytes, so that empty frames also count.
const FRAME_COSTS: usize = 1 << 10;
/// Maximum number of unfetched events before reading pauses.
const MAX_WAITING: usize = 512;
/// Maximum bytes of unfetched messages before reading pauses.
const MAX_WAITING_BYTES: usize = 8 << 20;
/// Maximum number of events from one peer in a row. (A frame is read to its end.)
const MAX_IN_A_ROW: usize = 128;

/// Remaining receive budget.
#[derive(Debug)]
pub(crate) struct Budget {
    bytes: usize,
    until: Instant,
}

impl Budget {
    pub(crate) fn new(now: Instant) -> Budget {
        Budget {
            bytes: TURN_BYTES,
            until: now + TURN_TIME,
        }
    }

    /// Subtracts the cost of the frames that were read.
    pub(crate) fn spend(&mut self, frames: usize, bytes: usize) {
        let costs = bytes.saturating_add(frames.saturating_mul(FRAME_COSTS));
        self.bytes = self.bytes.saturating_sub(costs);
    }

    pub(crate) fn is_spent(&self) -> bool {
        self.bytes == 0 || Instant::now() >= self.until
    }
}

/// Events that were read and not yet fetched.
#[derive(Debug, Default)]
pub(crate) struct Waiting {
    events: VecDeque<(HostEvent, usize)>,
    bytes: usize,
}

impl Waiting {
    /// Adds an event that was `bytes` long as a message.
    pub(crate) fn push(&mut self, event: HostEvent, bytes: usize) {
        self.bytes += bytes;
        self.events.push_back((event, bytes));
    }

    pub(crate) fn pop(&mut self) -> Option<HostEvent> {
        let (event, bytes) = self.events.pop_front()?;
        self.bytes -= bytes;
        Some(event)
    }

    pub(crate) fn len(&self) -> usize {
        self.events.len()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// Checks whether reading must pause.
    pub(crate) fn is_full(&self) -> bool {
        self.events.len() >= MAX_WAITING || self.bytes >= MAX_WAITING_BYTES
    }

    /// Checks whether one peer has added enough events, if there were `before` previously.
    pub(crate) fn is_enough_since(&self, before: usize) -> bool {
        self.is_full() || self.events.len() >= before + MAX_IN_A_ROW
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::PeerId;

    fn gone() -> HostEvent {
        HostEvent::Gone { peer: PeerId(1) }
    }

    #[test]
    fn many_small_or_few_large_events_fill_the_queue() {
        let mut waiting = Waiting::default();
        for _ in 0..MAX_WAITING {
            assert!(!waiting.is_full());
            waiting.push(gone(), 10);
        }
        assert!(waiting.is_full());
        while waiting.pop().is_some() {}
        assert!(!waiting.is_full() && waiting.is_empty() && waiting.bytes == 0);
        waiting.push(gone(), MAX_WAITING_BYTES);
        assert!(waiting.is_full());
    }

    #[test]
    fn receive_budget_ends_by_frames_bytes_and_time() {
        let now = Instant::now() + Duration::from_secs(3600);
        let mut budget = Budget::new(now);
        budget.spend(1, TURN_BYTES / 2);
        assert!(!budget.is_spent());
        budget.spend(1, TURN_BYTES / 2);
        assert!(budget.is_spent());
        let mut budget = Budget::new(now);
        budget.spend(usize::MAX, 0);
        assert!(budget.is_spent());
        let long_ago = Instant::now().checked_sub(TURN_TIME).unwrap_or(now);
        assert!(Budget::new(long_ago).is_spent());
    }
}
