//! Peers that send anything: random frames, lengths, orders, numbers, acknowledgements, farewells,
//! hellos and catalogues, against the real broker's end. A polite peer is served beside them all
//! the time. Its messages and those of the broker are never lost, doubled or out of order.
//!
//! `QCBUS_BUS_FUZZ_SECONDS` makes it longer, `QCBUS_BUS_FUZZ_SEED` repeats the messages of the
//! rogues (not their times).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::{Host, HostEvent, Instance, Peer, PeerEvent, PeerId};
use fastrand::Rng;
use qcbus_document::FileKind;
use qcbus_formats::xqar::{Issue, Level};
use qcbus_messages::services::{FRAME_BYTES, HELLO_BYTES};
use qcbus_messages::{Catalogue, CheckerInfo, DocId, FromPeer, Hello, JobId, ToPeer, codec};

use super::rogue::{Header, Rogue};
use super::support::{
    Site, fresh_number, hello, join, numbered, numbered_job, run_forever, watched, welcome,
};

/// Number of simultaneous rogues.
const ROGUES: u64 = 4;

/// Maximum growth of the process's own memory in bytes. For each rogue it covers a message of
/// maximum size, in a buffer that has grown by doubling, and the data read ahead.
const MOST_MEMORY: u64 = 1 << 30;

fn from_environment(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// Returns the anonymous memory of this process in bytes (proc(5), `status`).
fn anonymous_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("RssAnon:"));
    let kibibytes = line.and_then(|line| line.split_whitespace().nth(1));
    kibibytes.unwrap().parse::<u64>().unwrap() << 10
}

/// Statistics of all rogues together.
#[derive(Default)]
struct Deeds {
    stop: AtomicBool,
    hellos: AtomicU64,
    sessions: AtomicU64,
    frames: AtomicU64,
}

impl Deeds {
    fn count(number: &AtomicU64) {
        number.fetch_add(1, Ordering::Relaxed);
    }
}

fn anything(dice: &mut Rng, at_most: usize) -> Vec<u8> {
    let mut bytes = vec![0; dice.usize(..=at_most)];
    dice.fill(&mut bytes);
    bytes
}

fn text(dice: &mut Rng) -> String {
    let len = if dice.u8(..20) == 0 { 20_000 } else { 20 };
    let letter = dice.char(..);
    std::iter::repeat_n(letter, dice.usize(..len)).collect()
}

/// Creates a message that a sensible peer might send.
fn message(dice: &mut Rng) -> FromPeer {
    let job = JobId(dice.u64(..5));
    match dice.u8(..7) {
        0 => FromPeer::Catalogue(Box::new(catalogue(dice))),
        1 => FromPeer::NeedDocument {
            doc: DocId(dice.u64(..)),
        },
        2 => FromPeer::Issues {
            job,
            checker: dice.u32(..),
            issues: (0..dice.usize(..50)).map(|_| issue(dice)).collect(),
        },
        3 => numbered(dice.u64(..), dice.usize(..100_000)),
        4 => FromPeer::JobDone {
            job,
            micros: dice.u64(..),
        },
        5 => FromPeer::Leaving,
        _ => FromPeer::Heartbeat {
            job: Some(job),
            checker: Some(dice.u32(..)),
        },
    }
}

fn issue(dice: &mut Rng) -> Issue {
    Issue {
        id: dice.u64(..),
        description: text(dice),
        level: Level::Error,
        rule_uid: text(dice),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}

fn catalogue(dice: &mut Rng) -> Catalogue {
    let checkers = (0..dice.usize(..30)).map(|_| CheckerInfo {
        id: text(dice).into(),
        description: text(dice).into(),
        rule_uids: (0..dice.usize(..5)).map(|_| text(dice)).collect(),
        kinds: vec![FileKind::Xodr; dice.usize(..3)],
        default_on: dice.bool(),
        level: Level::Warning,
        params: Vec::new(),
    });
    let checkers = checkers.collect();
    Catalogue {
        alias: text(dice),
        checkers,
        ..Catalogue::default()
    }
}

/// Corrupts some bytes.
fn spoil(bytes: &mut [u8], dice: &mut Rng) {
    for _ in 0..dice.usize(..4) {
        if let Some(byte) = dice.choice(bytes.iter_mut()) {
            *byte = dice.u8(..);
        }
    }
}

/// Creates the bytes of a stream: messages, most of them sound, with lengths that mostly fit.
fn stream(dice: &mut Rng) -> Vec<u8> {
    let mut bytes = Vec::new();
    for _ in 0..dice.usize(1..20) {
        let mut body = match dice.u8(..8) {
            0 => anything(dice, 300),
            _ => codec::encode(&message(dice)).unwrap(),
        };
        if dice.u8(..6) == 0 {
            spoil(&mut body, dice);
        }
        let length = match dice.u8(..30) {
            0 => dice.u32(..),
            1 => dice.u32(..=codec::MAX_MESSAGE as u32),
            _ => body.len() as u32,
        };
        bytes.extend(length.to_le_bytes());
        bytes.extend(body);
    }
    bytes
}

/// Creates a hello that is valid, nearly valid, or invalid.
fn greeting(dice: &mut Rng, incarnation: u64) -> Vec<u8> {
    let sound = Hello {
        incarnation,
        pid: if dice.u8(..4) == 0 {
            dice.u32(..)
        } else {
            std::process::id()
        },
        ..hello("rogue")
    };
    let mut bytes = codec::encode(&sound).unwrap();
    match dice.u8(..8) {
        0 => spoil(&mut bytes, dice),
        1 => bytes = anything(dice, 2 * HELLO_BYTES),
        2 => bytes.extend(anything(dice, 100)),
        _ => {}
    }
    bytes
}

/// Corrupts a frame header.
fn spoil_header(header: &mut Header, dice: &mut Rng) {
    match dice.u8(..9) {
        0 => header.seq = dice.u64(..),
        1 => header.seq = header.seq.wrapping_sub(dice.u64(..40)),
        2 => header.seq = header.seq.wrapping_add(dice.u64(..40)),
        3 => header.ack = dice.u64(..),
        4 => header.ack = dice.u64(..100),
        5 => header.kind = dice.u32(..6),
        6 => header.generation = dice.u64(..),
        7 => header.attempt = dice.u64(..10),
        _ => header.urgent = dice.u32(..),
    }
}

/// Runs one session from its hello to any end.
fn session(rogue: &mut Rogue, said: &[Vec<u8>], dice: &mut Rng, deeds: &Deeds) {
    let (incarnation, attempt) = (dice.u64(..), dice.u64(..5));
    let reads = dice.u8(..6) != 0;
    let until = Instant::now() + Duration::from_millis(dice.u64(1..400));
    loop {
        rogue.introduce(incarnation, attempt, &greeting(dice, incarnation));
        Deeds::count(&deeds.hellos);
        if rogue.connect(incarnation, attempt, reads) {
            break;
        }
        if Instant::now() >= until {
            return;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Deeds::count(&deeds.sessions);
    let spoils_one_in = [1, 3, 30, 1_000][dice.usize(..4)];
    let (mut seq, mut heard) = (1, 0);
    let mut waiting = Vec::new();
    let until = Instant::now() + Duration::from_millis(dice.u64(1..1_500));
    while Instant::now() < until && !deeds.stop.load(Ordering::Relaxed) {
        if waiting.is_empty() {
            waiting = match dice.u8(..200) {
                // This message takes thousands of frames.
                0 => [&(40_u32 << 20).to_le_bytes()[..], &vec![0; 40 << 20]].concat(),
                1 => anything(dice, 4 * FRAME_BYTES),
                _ => dice.choice(said).cloned().unwrap_or_default(),
            };
        }
        while let Some(number) = rogue.receive() {
            heard = number.max(heard);
        }
        let most = match dice.u8(..100) {
            0 => 20 * FRAME_BYTES,
            1 => 0,
            _ => FRAME_BYTES,
        };
        let bytes: Vec<u8> = waiting.drain(..most.min(waiting.len())).collect();
        let mut header = Header {
            generation: rogue.generation(),
            incarnation,
            attempt,
            seq,
            ack: heard,
            kind: 1,
            urgent: 0,
        };
        if dice.u32(..spoils_one_in) == 0 {
            spoil_header(&mut header, dice);
        }
        if rogue.send(header, &bytes) {
            seq += 1;
            Deeds::count(&deeds.frames);
        }
        if dice.u8(..4) == 0 {
            rogue.ring();
        }
    }
    if dice.bool() {
        rogue.hang_up();
    }
}

fn start_rogue(instance: &Instance, seed: u64, deeds: &Arc<Deeds>) -> JoinHandle<()> {
    let (instance, deeds) = (instance.clone(), Arc::clone(deeds));
    std::thread::spawn(move || {
        let mut dice = Rng::with_seed(seed);
        while !deeds.stop.load(Ordering::Relaxed) {
            let mut rogue = Rogue::new(&instance).unwrap();
            // The streams are created in advance, because they must be sent quickly.
            let said: Vec<Vec<u8>> = (0..20).map(|_| stream(&mut dice)).collect();
            for _ in 0..dice.usize(1..6) {
                session(&mut rogue, &said, &mut dice, &deeds);
            }
        }
    })
}

/// The broker's side, with a polite peer.
struct Table {
    host: Host,
    dice: Rng,
    polite: (PeerId, Peer),
    garbage: u64,
    messages: u64,
}

impl Table {
    /// Handles an event of any peer other than the polite one, as a broker might do.
    fn deal_with(&mut self, event: &HostEvent) {
        match *event {
            HostEvent::Hello { peer, .. } => match self.dice.u8(..10) {
                0 => self.host.refuse(peer, "not you"),
                1 => {}
                _ => {
                    let welcome = welcome(&self.host);
                    self.host.accept(peer, &welcome);
                    self.host
                        .send(peer, &numbered_job(1, self.dice.usize(..50_000)));
                }
            },
            HostEvent::Garbage { peer, .. } => {
                self.garbage += 1;
                // The broker does the same, but sometimes it takes longer.
                if self.dice.u8(..8) != 0 {
                    self.host.disconnect(peer);
                }
            }
            HostEvent::Message { peer, .. } => {
                self.messages += 1;
                if self.dice.u8(..50) == 0 {
                    self.host.send(peer, &numbered_job(2, 10));
                }
            }
            HostEvent::Gone { .. } | HostEvent::TurnedAway { .. } => {}
        }
    }

    /// Sends a message in each direction.
    async fn serve_the_polite_one(&mut self, number: u64) {
        let len = [1, 100, FRAME_BYTES, 3 * FRAME_BYTES][number as usize % 4];
        let id = self.polite.0;
        self.polite.1.send(&numbered(number, len));
        self.host.send(id, &numbered_job(number, len));
        let (mut there, mut back) = (false, false);
        while !(there && back) {
            tokio::select! {
                event = self.host.next() => match event {
                    HostEvent::Message { peer, message } if peer == id => {
                        assert_eq!(message, numbered(number, len));
                        there = true;
                    }
                    HostEvent::Garbage { peer, what } if peer == id => panic!("{what}"),
                    HostEvent::Gone { peer } if peer == id => panic!("the message must arrive before the peer \
                        leaves"),
                    other => self.deal_with(&other),
                },
                event = self.polite.1.next() => {
                    let PeerEvent::Message(message) = event else { panic!("{event:?}") };
                    assert_eq!(message, numbered_job(number, len));
                    back = true;
                }
            }
        }
    }
}

#[test]
fn whatever_rogues_say_a_polite_peer_is_served() {
    let seed = from_environment("QCBUS_BUS_FUZZ_SEED").unwrap_or_else(fresh_number);
    let seconds = from_environment("QCBUS_BUS_FUZZ_SECONDS").unwrap_or(5);
    println!("QCBUS_BUS_FUZZ_SEED={seed}");
    run_forever(async {
        let site = Site::new();
        let mut host = site.host();
        let polite = join(&mut host, &site, "polite").await;
        let mut table = Table {
            host,
            polite,
            dice: Rng::with_seed(seed),
            garbage: 0,
            messages: 0,
        };
        let deeds = Arc::new(Deeds::default());
        let rogues: Vec<JoinHandle<()>> = (1..=ROGUES)
            .map(|number| start_rogue(&site.instance, seed.wrapping_add(number), &deeds))
            .collect();
        let (before, mut most, mut served) = (anonymous_memory(), 0, 0);
        let until = Instant::now() + Duration::from_secs(seconds);
        // On a busy machine the rogues may need longer to send any message.
        while Instant::now() < until || table.messages == 0 || table.garbage == 0 {
            watched(table.serve_the_polite_one(served)).await;
            served += 1;
            if served % 50 == 0 {
                most = most.max(anonymous_memory().saturating_sub(before));
                assert!(most < MOST_MEMORY, "{most} bytes");
            }
        }
        deeds.stop.store(true, Ordering::Relaxed);
        for rogue in rogues {
            let ended = rogue.join();
            assert!(ended.is_ok(), "no rogue may fail on its own");
        }
        // A peer that joins after all this finds a place.
        watched(join_among_the_late(&mut table, &site)).await;
        println!(
            "{} hellos, {} sessions, {} frames; {} messages and {} faults heard; the polite peer was served {served} times; {} MiB of memory at most",
            deeds.hellos.load(Ordering::Relaxed),
            deeds.sessions.load(Ordering::Relaxed),
            deeds.frames.load(Ordering::Relaxed),
            table.messages,
            table.garbage,
            most >> 20,
        );
    });
}

async fn join_among_the_late(table: &mut Table, site: &Site) {
    let options = crate::PeerOptions {
        patience: Duration::from_secs(60),
        grace: Duration::from_secs(60),
        ..crate::PeerOptions::default()
    };
    let joining = Peer::join(&site.instance, hello("late"), options);
    tokio::pin!(joining);
    loop {
        tokio::select! {
            joined = &mut joining => break drop(joined.unwrap()),
            event = table.host.next() => match event {
                HostEvent::Hello { peer, hello, .. } if hello.name == "late" => {
                    let welcome: ToPeer = welcome(&table.host);
                    table.host.accept(peer, &welcome);
                }
                other => table.deal_with(&other),
            }
        }
    }
}
