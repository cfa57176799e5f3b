//! Every service on the bus and its quality of service, as one table of plain data.
//!
//! iceoryx2's own defaults lose data (buffers of two, overflow on, two publishers), so nothing is
//! opened with defaults: `qcbus-bus` has one constructor, and it takes a row of this table. The
//! broker writes its [`Limits`] where peers find them, so both sides compute the same table.

use serde::{Deserialize, Serialize};

/// Payload bytes of one frame of a message stream.
pub const FRAME_BYTES: usize = 16 << 10;
/// Frames that a receiver's buffer takes.
pub const FRAME_BUFFER: usize = 64;
/// Frames that a sender leaves unacknowledged. Half of the buffer: the other half is for resent
/// frames and for acknowledgements, so that a window never overflows a buffer.
pub const FRAME_WINDOW: usize = FRAME_BUFFER / 2;
/// Largest introduction, in bytes; it must fit one slot.
pub const HELLO_BYTES: usize = 4 << 10;
/// Documents are lent in blocks of this size, so that every image starts on a cache line.
pub const BLOCK_BYTES: usize = 64;
/// Ports kept free on shared services for debugging tools and a tunnel.
pub const SPARE_PORTS: usize = 4;
/// Bytes by which the memory of a stream grows, and half of which is had ahead of the frames in use:
/// four frames.
pub const STREAM_STEP_BYTES: u64 = 4 * (FRAME_BYTES as u64 + 256);
/// Sessions beyond the peers allowed, used to tell a peer that there is no room for it.
pub const SPARE_SESSIONS: usize = 4;

/// What the numbers in the table follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// Bundles and reporters at once.
    pub peers: usize,
    /// Documents of the small class that jobs under way may need: the broker must not exceed it.
    pub small_active: usize,
    /// Documents of the small class that one process holds at most; at least `small_active`.
    pub small_held: usize,
    /// Largest document of the small class, in bytes.
    pub small_bytes: usize,
    /// Documents of the large class that jobs under way may need.
    pub large_active: usize,
    /// Documents of the large class that one process holds at most; at least `large_active`.
    pub large_held: usize,
    /// Slot size that the large class starts with, in bytes; it grows by powers of two.
    pub large_initial_bytes: usize,
    /// Documents of a class that worker threads fill at once.
    pub loans: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            peers: 32,
            small_active: 64,
            small_held: 96,
            small_bytes: 512 << 10,
            large_active: 8,
            large_held: 12,
            large_initial_bytes: 4 << 20,
            loans: 8,
        }
    }
}

/// How a publisher's memory grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Growth {
    /// Never: what was sent survives the sender.
    Fixed,
    /// To the next power of two. (Growing to the best fit fails for good at the 256th step.)
    PowerOfTwo,
}

/// A publish-subscribe service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// Name; services of one session append the session's key.
    pub name: &'static str,
    /// Publishers at most.
    pub publishers: usize,
    /// Subscribers at most.
    pub subscribers: usize,
    /// Processes at most.
    pub nodes: usize,
    /// Samples that wait in a subscriber's buffer.
    pub buffer: usize,
    /// Samples that one subscriber holds at once.
    pub borrowed: usize,
    /// Samples that a late joiner still gets.
    pub history: usize,
    /// Samples that a publisher fills at once.
    pub loans: usize,
    /// `true`: a full buffer drops its oldest sample. `false`: the new one is not delivered, and
    /// the sender is told.
    pub overflow: bool,
    /// Bytes of one payload element.
    pub element: usize,
    /// Elements of a slot; with [`Growth::PowerOfTwo`] to begin with.
    pub elements: usize,
    /// How slots grow.
    pub growth: Growth,
}

impl Topic {
    /// Slots that a publisher needs so that lending never fails: what every subscriber may have
    /// waiting and hold, the history, and what is being filled.
    pub const fn slots(&self) -> usize {
        self.subscribers * (self.buffer + self.borrowed) + self.history + self.loans
    }

    /// Bytes of shared memory that a publisher takes, at most, before it has lent anything.
    pub const fn publisher_bytes(&self) -> u64 {
        (16 * self.slots() + (64 << 10)) as u64
    }

    /// Bytes of shared memory that a publisher and a subscriber take for knowing each other.
    pub const fn connection_bytes(&self) -> u64 {
        let each = match self.growth {
            Growth::Fixed => 2,
            Growth::PowerOfTwo => GROWING_SLOT_BYTES,
        };
        (each * self.slots() + (16 << 10)) as u64
    }

    /// Bytes of a slot's payload, to begin with.
    pub const fn slot_bytes(&self) -> usize {
        self.element * self.elements
    }
}

/// An event service: it wakes, and says nothing else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wake {
    /// Name; services of one session append the session's key.
    pub name: &'static str,
    /// Notifiers at most.
    pub notifiers: usize,
    /// Listeners at most.
    pub listeners: usize,
    /// Processes at most.
    pub nodes: usize,
    /// Largest event id; only 0 is used.
    pub max_event_id: usize,
}

// What iceoryx2 keeps, measured; `runtime/bus/tests/bus/memory.rs` compares.
/// Kept of a slot that may grow, for each who reads: a byte for each of the 256 sizes that it may have.
const GROWING_SLOT_BYTES: usize = 264;
const FIXED_BYTES: usize = 96 << 10;
/// Addresses for the program itself, its threads and what it allocates.
const ADDRESSES_BESIDE: u64 = 512 << 20;

/// The table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Services {
    /// Document images up to [`Limits::small_bytes`]; broker → all. May drop.
    pub document_small: Topic,
    /// Larger document images; broker → all. May drop.
    pub document_large: Topic,
    /// The configuration; broker → all. The latest wins.
    pub config: Topic,
    /// Introductions; peers → broker. Repeated until answered.
    pub hello: Topic,
    /// Frames of the stream to one peer. Never lost.
    pub to_peer: Topic,
    /// Frames of the stream from one peer. Never lost.
    pub from_peer: Topic,
    /// Wakes the broker.
    pub wake_broker: Wake,
    /// Wakes one peer.
    pub wake_peer: Wake,
}

impl Services {
    /// The table for these limits.
    pub const fn new(limits: &Limits) -> Services {
        let sessions = limits.peers + SPARE_SESSIONS;
        // The broker subscribes as well: that is how it holds what it has published.
        let everybody = sessions + 1 + SPARE_PORTS;
        let stream = Topic {
            name: "to",
            publishers: 1,
            subscribers: 1,
            nodes: 2 + SPARE_PORTS,
            buffer: FRAME_BUFFER,
            borrowed: 2,
            history: 0,
            loans: 1,
            overflow: false,
            element: 1,
            elements: FRAME_BYTES,
            growth: Growth::Fixed,
        };
        let small = Topic {
            name: "document/small",
            publishers: 1 + SPARE_PORTS,
            subscribers: everybody,
            nodes: everybody,
            buffer: limits.small_active,
            borrowed: limits.small_held,
            history: limits.small_active,
            loans: limits.loans,
            overflow: true,
            element: BLOCK_BYTES,
            elements: limits.small_bytes.div_ceil(BLOCK_BYTES),
            growth: Growth::Fixed,
        };
        Services {
            document_small: small,
            document_large: Topic {
                name: "document/large",
                buffer: limits.large_active,
                borrowed: limits.large_held,
                history: limits.large_active,
                elements: limits.large_initial_bytes.div_ceil(BLOCK_BYTES),
                growth: Growth::PowerOfTwo,
                ..small
            },
            config: Topic {
                name: "config",
                buffer: 2,
                borrowed: 2,
                history: 1,
                loans: 1,
                element: 1,
                elements: 64 << 10,
                growth: Growth::PowerOfTwo,
                ..small
            },
            hello: Topic {
                name: "hello",
                publishers: everybody,
                subscribers: 1 + SPARE_PORTS,
                nodes: everybody,
                buffer: 2,
                borrowed: 2,
                overflow: true,
                elements: HELLO_BYTES,
                ..stream
            },
            to_peer: stream,
            from_peer: Topic {
                name: "from",
                ..stream
            },
            wake_broker: Wake {
                name: "wake/broker",
                notifiers: everybody,
                listeners: 1 + SPARE_PORTS,
                nodes: everybody,
                max_event_id: 0,
            },
            wake_peer: Wake {
                name: "wake",
                notifiers: 1 + SPARE_PORTS,
                listeners: 1,
                nodes: 2 + SPARE_PORTS,
                max_event_id: 0,
            },
        }
    }

    /// Bytes of shared memory that a broker takes for itself, without documents: what is kept of
    /// every slot that it may lend, of everybody who may join, and some pages.
    pub const fn broker_bytes(&self) -> u64 {
        let small = 16 * self.document_small.slots();
        let large = (16 + GROWING_SLOT_BYTES) * self.document_large.slots();
        let everybody = 600 * self.document_small.subscribers;
        (small + large + 16 * self.config.slots() + everybody + FIXED_BYTES) as u64
    }

    /// Bytes of shared memory that broker and peer together take for a session, without documents:
    /// what is kept of every slot that the peer may be sent, introductions, the first frames of both
    /// streams, and some pages.
    pub const fn peer_bytes(&self) -> u64 {
        let growing = GROWING_SLOT_BYTES * (self.document_large.slots() + self.config.slots());
        let hello = self.hello.slots() * (self.hello.slot_bytes() + 128);
        let small = 2 * self.document_small.slots();
        (growing + small + hello + FIXED_BYTES) as u64 + 2 * STREAM_STEP_BYTES
    }

    /// Bytes of addresses that a broker needs for the bus. Segments are mapped in full, although
    /// hardly anything of them is ever touched; the broker reads what it publishes, so that it maps
    /// them twice.
    pub const fn address_bytes(&self) -> u64 {
        let documents = self.document_small.slots() * self.document_small.slot_bytes()
            + self.document_large.slots() * self.document_large.slot_bytes();
        let streams = self.hello.publishers * 2 * self.to_peer.slots() * FRAME_BYTES;
        (2 * documents + streams) as u64 + ADDRESSES_BESIDE
    }

    /// All publish-subscribe services.
    pub const fn topics(&self) -> [Topic; 6] {
        [
            self.document_small,
            self.document_large,
            self.config,
            self.hello,
            self.to_peer,
            self.from_peer,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tables() -> impl Iterator<Item = (Limits, Services)> {
        [1, 8, 100].into_iter().map(|peers| {
            let limits = Limits {
                peers,
                ..Limits::default()
            };
            (limits, Services::new(&limits))
        })
    }

    #[test]
    fn slots_cover_the_worst_case() {
        for (_, services) in tables() {
            for topic in services.topics() {
                let worst = topic.subscribers * (topic.buffer + topic.borrowed);
                assert!(topic.slots() >= worst + topic.history + topic.loans);
                assert!(topic.loans >= 1 && topic.borrowed >= 2, "{}", topic.name);
            }
        }
    }

    #[test]
    fn a_window_never_overflows_a_buffer() {
        for (_, services) in tables() {
            for stream in [services.to_peer, services.from_peer] {
                assert!(FRAME_WINDOW < stream.buffer);
                assert!(!stream.overflow && stream.growth == Growth::Fixed);
            }
        }
    }

    #[test]
    fn active_documents_fit_buffer_history_and_hands() {
        for (limits, services) in tables() {
            for (topic, active) in [
                (services.document_small, limits.small_active),
                (services.document_large, limits.large_active),
            ] {
                assert_eq!((topic.buffer, topic.history), (active, active));
                assert!(topic.borrowed > active, "{}", topic.name);
                assert_eq!(topic.element, BLOCK_BYTES);
                assert!(topic.subscribers > limits.peers + 1);
            }
        }
    }

    #[test]
    fn names_are_distinct() {
        for (_, services) in tables() {
            let names = services.topics().map(|topic| topic.name);
            let distinct: std::collections::BTreeSet<_> = names.iter().collect();
            assert_eq!(distinct.len(), names.len());
        }
    }
}
