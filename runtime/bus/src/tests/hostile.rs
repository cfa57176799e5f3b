//! Misbehaving peers: the other peers are served as if they did not exist.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Poll;
use std::thread::JoinHandle;
use std::time::Duration;

use crate::{Host, HostEvent, Instance, PeerEvent, PeerId};
use qcbus_messages::services::FRAME_BYTES;
use qcbus_messages::{ToPeer, codec};

use super::rogue::{Header, Rogue};
use super::support::{
    Site, fresh_number, hello, join, numbered, numbered_job, run, watched, welcome,
};

/// A thread that floods the bus until it is dropped.
struct Flooder {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Flooder {
    /// Joins in its own session. Then it sends the result of `frame` for each number as fast as
    /// possible, and ignores acknowledgements.
    fn start(
        instance: &Instance,
        frame: impl Fn(Header, u64) -> (Header, Vec<u8>) + Send + 'static,
    ) -> Flooder {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let instance = instance.clone();
        let thread = std::thread::spawn(move || {
            let mut rogue = Rogue::new(&instance).unwrap();
            let incarnation = fresh_number();
            let hello = qcbus_messages::Hello {
                incarnation,
                pid: std::process::id(),
                ..hello("rogue")
            };
            let bytes = codec::encode(&hello).unwrap();
            while !stopped.load(Ordering::Relaxed) && !rogue.connect(incarnation, 1, true) {
                rogue.introduce(incarnation, 1, &bytes);
                std::thread::sleep(Duration::from_millis(5));
            }
            let base = Header {
                generation: rogue.generation(),
                incarnation,
                attempt: 1,
                kind: 1,
                ..Header::default()
            };
            let mut number = 1;
            while !stopped.load(Ordering::Relaxed) {
                while rogue.receive().is_some() {}
                let (header, bytes) = frame(
                    Header {
                        seq: number,
                        ..base
                    },
                    number,
                );
                if rogue.send(header, &bytes) {
                    number += 1;
                }
                rogue.ring();
            }
        });
        Flooder {
            stop,
            thread: Some(thread),
        }
    }
}

impl Drop for Flooder {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking());
        }
    }
}

/// Returns a message that takes exactly this many bytes of a stream.
fn framed(bytes: usize) -> Vec<u8> {
    let empty = codec::encode(&numbered(1, 0)).unwrap().len();
    let message = codec::encode(&numbered(1, bytes - 4 - empty)).unwrap();
    let length = u32::try_from(message.len()).unwrap();
    [&length.to_le_bytes()[..], &message].concat()
}

/// Serves until the rogue has joined, and welcomes it.
async fn admit(host: &mut Host) -> PeerId {
    loop {
        if let HostEvent::Hello { peer, hello, .. } = host.next().await {
            assert_eq!(hello.name, "rogue");
            let welcome = welcome(host);
            host.accept(peer, &welcome);
            return peer;
        }
    }
}

#[test]
fn repeated_frames_are_bounded_by_the_receive_budget() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        // All frames are full and have the same number. The broker reads each and accepts none.
        let flooder = Flooder::start(&site.instance, |header, _| {
            (Header { seq: 7, ..header }, vec![0; FRAME_BYTES])
        });
        let rogue = admit(&mut host).await;
        let (_, mut polite) = join(&mut host, &site, "polite").await;
        let mut told = false;
        // After a while the flood counts as a broken stream, and the broker stops reading it.
        while !told {
            tokio::select! {
                event = host.next() => {
                    let HostEvent::Garbage { peer, what } = event else { panic!("{event:?}") };
                    assert_eq!(peer, rogue);
                    assert!(what.contains("useless frames were received in a row"), "{what}");
                    told = true;
                }
                event = polite.next() => panic!("{event:?}"),
            }
        }
        drop(flooder);
    });
}

/// Creates a welcomed rogue in the test's own thread.
async fn rogue(host: &mut Host, site: &Site) -> (Rogue, Header) {
    let mut rogue = Rogue::new(&site.instance).unwrap();
    let incarnation = fresh_number();
    let hello = qcbus_messages::Hello {
        incarnation,
        pid: std::process::id(),
        ..hello("rogue")
    };
    assert!(rogue.introduce(incarnation, 1, &codec::encode(&hello).unwrap()));
    admit(host).await;
    assert!(rogue.connect(incarnation, 1, true));
    let header = Header {
        generation: rogue.generation(),
        incarnation,
        attempt: 1,
        seq: 1,
        kind: 1,
        ..Header::default()
    };
    (rogue, header)
}

/// Number of polls that are examined. It is so small that no rogue reaches the end of its message.
const TURNS: usize = 18;

/// Sends frames of one long message until the broker's buffer is full. Returns their number.
fn fill(rogue: &Rogue, header: &mut Header) -> u64 {
    let mut bytes = vec![0; FRAME_BYTES];
    let length = u32::try_from(codec::MAX_FROM_PEER).unwrap();
    let mut sent = 0;
    loop {
        let start = if header.seq == 1 { length } else { 0 };
        bytes[..4].copy_from_slice(&start.to_le_bytes());
        if !rogue.send(*header, &bytes) {
            return sent;
        }
        header.seq += 1;
        sent += 1;
    }
}

#[test]
fn receive_budget_is_a_megabyte_and_rotates_between_peers() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let mut rogues = Vec::new();
        for _ in 0..6 {
            rogues.push(rogue(&mut host, &site).await);
        }
        // The broker establishes connections while it polls.
        for (rogue, header) in &mut rogues {
            fill(rogue, header);
        }
        let mut read = vec![0; rogues.len()];
        for _ in 0..TURNS {
            {
                let mut next = std::pin::pin!(host.next());
                let polled =
                    std::future::poll_fn(|context| Poll::Ready(next.as_mut().poll(context))).await;
                assert!(polled.is_pending(), "{polled:?}");
            }
            let mut frames = 0;
            for (number, (rogue, header)) in rogues.iter_mut().enumerate() {
                while rogue.receive().is_some() {}
                let sent = fill(rogue, header);
                read[number] += sent;
                frames += sent;
            }
            // A megabyte is 64 frames. The broker reads a peer to the end of its quota.
            assert!(frames <= 64 + 8, "{frames} frames in one turn");
        }
        let least = read.iter().min().unwrap();
        let most = read.iter().max().unwrap();
        println!("frames read: {read:?}");
        assert!(*least > 0 && *most <= 2 * *least + 64, "{read:?}");
    });
}

#[test]
fn peer_ignoring_its_window_does_not_delay_others() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let frame = framed(FRAME_BYTES);
        let flooder = Flooder::start(&site.instance, move |header, _| (header, frame.clone()));
        let rogue = admit(&mut host).await;
        let (id, mut polite) = join(&mut host, &site, "polite").await;
        let (mut waited, mut flood) = (Vec::new(), 0);
        for number in 0..50 {
            polite.send(&numbered(number, 10));
            host.send(id, &numbered_job(number, 10));
            let (mut there, mut back) = (false, false);
            let from = flood;
            while !(there && back) {
                tokio::select! {
                    event = host.next() => match event {
                        HostEvent::Message { peer, message } if peer == id => {
                            assert_eq!(message, numbered(number, 10));
                            there = true;
                        }
                        HostEvent::Message { peer, .. } => {
                            assert_eq!(peer, rogue);
                            flood += 1;
                        }
                        other => panic!("{other:?}"),
                    },
                    event = polite.next() => {
                        let PeerEvent::Message(ToPeer::Job(_)) = event else { panic!("{event:?}") };
                        back = true;
                    }
                }
            }
            waited.push(flood - from);
        }
        let longest = waited.iter().max().unwrap();
        println!("the polite peer waited for at most {longest} messages of the flood");
        assert!(*longest < 2_000, "{waited:?}");
        drop(flooder);
    });
}

#[test]
fn oversized_frame_ends_the_stream_unread() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let flooder = Flooder::start(&site.instance, |header, _| (header, vec![0; 8 << 20]));
        let rogue = admit(&mut host).await;
        let event = watched(host.next()).await;
        let HostEvent::Garbage { peer, what } = event else {
            panic!("{event:?}")
        };
        assert_eq!(peer, rogue);
        assert!(
            what.contains("a frame of 8388608 bytes was received"),
            "{what}"
        );
        drop(flooder);
    });
}

#[test]
fn unfetched_messages_are_bounded_by_bytes() {
    run(async {
        const FRAMES: usize = 6;
        let site = Site::new();
        let mut host = site.host();
        let stream = framed(FRAMES * FRAME_BYTES);
        let flooder = Flooder::start(&site.instance, move |header, number| {
            let from = (number as usize - 1) % FRAMES * FRAME_BYTES;
            (header, stream[from..from + FRAME_BYTES].to_vec())
        });
        admit(&mut host).await;
        let mut most = 0;
        for _ in 0..40 {
            assert!(matches!(host.next().await, HostEvent::Message { .. }));
            most = most.max(host.waiting_bytes());
            // The broker is busy with something else, for longer than between two polls.
            std::thread::sleep(Duration::from_millis(25));
        }
        println!("at most {most} bytes waited");
        assert!((4 << 20..10 << 20).contains(&most), "{most}");
        drop(flooder);
    });
}
