//! All services on the bus and their quality of service, as one table of plain data.
//!
//! iceoryx2's own defaults lose data (buffers of two, overflow on, two publishers), so no service
//! is opened with defaults. `qcbus-bus` has only one constructor, and it requires a row of this
//! table. The broker publishes its [`Limits`] to the peers, so both sides compute the same table.

use serde::{Deserialize, Serialize};

/// Payload bytes of one frame of a message stream.
pub const FRAME_BYTES: usize = 16 << 10;
/// Capacity of a receiver's buffer, in frames.
pub const FRAME_BUFFER: usize = 64;
/// Maximum number of unacknowledged frames of a sender: half of the buffer. The other half is for
/// resent frames and for acknowledgements, so that a window never overflows a buffer.
pub const FRAME_WINDOW: usize = FRAME_BUFFER / 2;
/// Maximum size of a hello message in bytes; it must fit one slot.
pub const HELLO_BYTES: usize = 4 << 10;
/// Block size for lent documents, so that every image starts on a cache line.
pub const BLOCK_BYTES: usize = 64;
/// Number of ports kept free on shared services for debugging tools and a tunnel.
pub const SPARE_PORTS: usize = 4;
/// Growth step of a stream's memory in bytes: four frames. Half of it is reserved ahead of the
/// frames in use.
pub const STREAM_STEP_BYTES: u64 = 4 * (FRAME_BYTES as u64 + 256);
/// Sessions beyond the maximum number of peers, to tell a peer that the broker is full.
pub const SPARE_SESSIONS: usize = 4;

/// Input values of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// Maximum number of bundles and reporters.
    pub peers: usize,
    /// Maximum number of small documents for running jobs; the broker must not exceed it.
    pub small_active: usize,
    /// Maximum number of small documents in one process; at least `small_active`.
    pub small_held: usize,
    /// Maximum size of a small document, in bytes.
    pub small_bytes: usize,
    /// Maximum number of large documents for running jobs.
    pub large_active: usize,
    /// Maximum number of large documents in one process; at least `large_active`.
    pub large_held: usize,
    /// Initial slot size of the large class, in bytes; it grows by powers of two.
    pub large_initial_bytes: usize,
    /// Documents of a class that worker threads fill at the same time.
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

/// Growth strategy of a publisher's memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Growth {
    /// No growth; sent data survives the sender.
    Fixed,
    /// Growth to the next power of two. (Growth to the best fit fails permanently at the 256th
    /// step.)
    PowerOfTwo,
}

/// A publish-subscribe service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// Name; services of one session append the session's key.
    pub name: &'static str,
    /// Maximum number of publishers.
    pub publishers: usize,
    /// Maximum number of subscribers.
    pub subscribers: usize,
    /// Maximum number of processes.
    pub nodes: usize,
    /// Capacity of a subscriber's buffer, in samples.
    pub buffer: usize,
    /// Samples that one subscriber holds at the same time.
    pub borrowed: usize,
    /// Samples that a late subscriber still receives.
    pub history: usize,
    /// Samples that a publisher fills at the same time.
    pub loans: usize,
    /// `true`: a full buffer drops its oldest sample. `false`: the new sample is not delivered, and
    /// the sender gets an error.
    pub overflow: bool,
    /// Size of one payload element in bytes.
    pub element: usize,
    /// Elements of a slot; with [`Growth::PowerOfTwo`] the initial number.
    pub elements: usize,
    /// Growth strategy of slots.
    pub growth: Growth,
}

impl Topic {
    /// Returns the number of slots that a publisher needs so that lending never fails. It is the
    /// sum of all subscribers' waiting and held samples, the history, and the loans.
    pub const fn slots(&self) -> usize {
        self.subscribers * (self.buffer + self.borrowed) + self.history + self.loans
    }

    /// Returns the maximum shared memory of a publisher in bytes, before it has lent any sample.
    pub const fn publisher_bytes(&self) -> u64 {
        (16 * self.slots() + (64 << 10)) as u64
    }

    /// Returns the shared memory of the connection between a publisher and a subscriber, in bytes.
    pub const fn connection_bytes(&self) -> u64 {
        let each = match self.growth {
            Growth::Fixed => 2,
            Growth::PowerOfTwo => GROWING_SLOT_BYTES,
        };
        (each * self.slots() + (16 << 10)) as u64
    }

    /// Returns the initial payload size of a slot in bytes.
    pub const fn slot_bytes(&self) -> usize {
        self.element * self.elements
    }
}

/// An event service: it wakes its listeners and carries no data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wake {
    /// Name; services of one session append the session's key.
    pub name: &'static str,
    /// Maximum number of notifiers.
    pub notifiers: usize,
    /// Maximum number of listeners.
    pub listeners: usize,
    /// Maximum number of processes.
    pub nodes: usize,
    /// Largest event id; only 0 is used.
    pub max_event_id: usize,
}

// Measured memory use of iceoryx2; `runtime/bus/tests/bus/memory.rs` compares it.
/// Bytes per growing slot and reader: one byte for each of the 256 sizes that it may have.
const GROWING_SLOT_BYTES: usize = 264;
const FIXED_BYTES: usize = 96 << 10;
/// Address space for the program itself, its threads and its allocations, in bytes.
const ADDRESSES_BESIDE: u64 = 512 << 20;

/// The table of all services.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Services {
    /// Document images up to [`Limits::small_bytes`]; broker → all. May lose samples.
    pub document_small: Topic,
    /// Larger document images; broker → all. May lose samples.
    pub document_large: Topic,
    /// The configuration; broker → all. Only the latest sample counts.
    pub config: Topic,
    /// Hello messages; peers → broker. Repeated until answered.
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
    /// Creates the table for these limits.
    pub const fn new(limits: &Limits) -> Services {
        let sessions = limits.peers + SPARE_SESSIONS;
        // The broker also subscribes, because that keeps its published samples in memory.
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

    /// Returns the broker's own shared memory in bytes, without documents. It contains the data for
    /// every slot it may lend and for every possible peer, and some pages.
    pub const fn broker_bytes(&self) -> u64 {
        let small = 16 * self.document_small.slots();
        let large = (16 + GROWING_SLOT_BYTES) * self.document_large.slots();
        let everybody = 600 * self.document_small.subscribers;
        (small + large + 16 * self.config.slots() + everybody + FIXED_BYTES) as u64
    }

    /// Returns the shared memory that broker and peer need for a session, in bytes, without
    /// documents. It contains the data for all slots that the peer may receive and hello messages.
    /// It also contains the first frames of both streams, and some pages.
    pub const fn peer_bytes(&self) -> u64 {
        let growing = GROWING_SLOT_BYTES * (self.document_large.slots() + self.config.slots());
        let hello = self.hello.slots() * (self.hello.slot_bytes() + 128);
        let small = 2 * self.document_small.slots();
        (growing + small + hello + FIXED_BYTES) as u64 + 2 * STREAM_STEP_BYTES
    }

    /// Returns the address space that a broker needs for the bus, in bytes. Segments are mapped in
    /// full, although only a small part is ever accessed. The broker also reads its own samples, so
    /// it maps them twice.
    pub const fn address_bytes(&self) -> u64 {
        let documents = self.document_small.slots() * self.document_small.slot_bytes()
            + self.document_large.slots() * self.document_large.slot_bytes();
        let streams = self.hello.publishers * 2 * self.to_peer.slots() * FRAME_BYTES;
        (2 * documents + streams) as u64 + ADDRESSES_BESIDE
    }

    /// Returns all publish-subscribe services.
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
    fn frame_window_is_smaller_than_buffer() {
        for (_, services) in tables() {
            for stream in [services.to_peer, services.from_peer] {
                assert!(FRAME_WINDOW < stream.buffer);
                assert!(!stream.overflow && stream.growth == Growth::Fixed);
            }
        }
    }

    #[test]
    fn active_documents_fit_buffer_history_and_borrows() {
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
    fn topic_names_are_distinct() {
        for (_, services) in tables() {
            let names = services.topics().map(|topic| topic.name);
            let distinct: std::collections::BTreeSet<_> = names.iter().collect();
            assert_eq!(distinct.len(), names.len());
        }
    }
}
