//! Messages arrive once and in order. Their size and the actions of others do not matter.

use std::time::Duration;

use qcbus_bus::{
    Host, HostEvent, HostOptions, Instance, JoinError, Peer, PeerEvent, PeerOptions, StartError,
};
use qcbus_messages::{Digest, FromPeer, JobId, PROTOCOL_VERSION, ToPeer};

use crate::helper::Helper;
use crate::support::{Site, hello, join, join_with, numbered, numbered_job, run, watched, welcome};

/// Sizes around the limits that matter: nothing, the end of a frame, many frames, and nearly the
/// maximum of a peer's message.
const SIZES: [usize; 10] = [
    0, 1, 100, 16_300, 16_384, 16_400, 40_000, 700_000, 3, 4_190_000,
];

#[test]
fn messages_arrive_in_order_both_ways() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "polite").await;
        let count = 40;
        for number in 0..count {
            let len = SIZES[number as usize % SIZES.len()];
            host.send(id, &numbered_job(number, len));
            peer.send(&numbered(number, len));
        }
        let (mut from_peer, mut from_host) = (0, 0);
        while from_peer < count || from_host < count {
            tokio::select! {
                event = host.next() => {
                    let HostEvent::Message { peer, message } = event else { panic!("{event:?}") };
                    let len = SIZES[from_peer as usize % SIZES.len()];
                    assert_eq!((peer, message), (id, numbered(from_peer, len)));
                    from_peer += 1;
                }
                event = peer.next() => {
                    let PeerEvent::Message(message) = event else { panic!("{event:?}") };
                    let len = SIZES[from_host as usize % SIZES.len()];
                    assert_eq!(message, numbered_job(from_host, len));
                    from_host += 1;
                }
            }
        }
        // Acknowledgements follow without further messages.
        watched(async {
            while host.backlog(id) > 0 || peer.backlog() > 0 {
                tokio::select! {
                    event = host.next() => panic!("{event:?}"),
                    event = peer.next() => panic!("{event:?}"),
                    () = tokio::time::sleep(Duration::from_millis(5)) => {}
                }
            }
        })
        .await;
    });
}

#[test]
fn messages_sent_before_leaving_arrive() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "leaver").await;
        let count = 200;
        for number in 0..count {
            peer.send(&numbered(number, 20_000));
        }
        let leaving = peer.leave();
        tokio::pin!(leaving);
        let (mut got, mut gone, mut left) = (0, false, false);
        while !(gone && left) {
            tokio::select! {
                () = &mut leaving, if !left => left = true,
                event = host.next() => match event {
                    HostEvent::Message { message, .. } => {
                        assert_eq!(message, numbered(got, 20_000));
                        got += 1;
                    }
                    HostEvent::Gone { peer } => gone = peer == id,
                    other => panic!("{other:?}"),
                }
            }
        }
        assert_eq!(got, count);
    });
}

#[test]
fn stopped_reader_does_not_affect_other_peers() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let mut deaf = Helper::start("answers_jobs", &site.instance);
        let deaf_id = loop {
            if let HostEvent::Hello { peer, .. } = host.next().await {
                let welcome = welcome(&host);
                host.accept(peer, &welcome);
                break peer;
            }
        };
        while host.backlog(deaf_id) > 0 {
            tokio::select! {
                _ = host.next() => {}
                () = tokio::time::sleep(Duration::from_millis(5)) => {}
            }
        }
        assert_eq!(deaf.line(), "joined");
        deaf.signal(rustix::process::Signal::STOP);
        let (id, mut peer) = join(&mut host, &site, "polite").await;
        // The flood is far larger than a window. The rest stays in the host.
        let flood = 3_000;
        for number in 0..flood {
            host.send(deaf_id, &numbered_job(number, 1_000));
        }
        for number in 0..500 {
            host.send(id, &numbered_job(number, 1_000));
            tokio::select! {
                event = host.next() => panic!("{event:?}"),
                event = peer.next() => {
                    let PeerEvent::Message(message) = event else { panic!("{event:?}") };
                    assert_eq!(message, numbered_job(number, 1_000));
                }
            }
        }
        assert!(host.backlog(deaf_id) > 2_000_000);
        // The helper has missed no message when it continues.
        deaf.signal(rustix::process::Signal::CONT);
        let mut next = 0;
        while next < flood {
            if let HostEvent::Message {
                peer,
                message: FromPeer::JobDone { job, .. },
            } = host.next().await
            {
                assert_eq!((peer, job), (deaf_id, JobId(next)));
                next += 1;
            }
        }
    });
}

#[test]
fn flooding_peer_does_not_starve_other_peers() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (flooder_id, mut flooder) = join(&mut host, &site, "flooder").await;
        let (polite_id, mut polite) = join(&mut host, &site, "polite").await;
        for number in 0..200_000 {
            flooder.send(&numbered(number, 100));
        }
        let mut flood = 0;
        polite.send(&numbered(7, 10));
        loop {
            tokio::select! {
                event = host.next() => match event {
                    HostEvent::Message { peer, .. } if peer == flooder_id => flood += 1,
                    HostEvent::Message { peer, message } => {
                        assert_eq!((peer, message), (polite_id, numbered(7, 10)));
                        break;
                    }
                    other => panic!("{other:?}"),
                },
                event = flooder.next() => panic!("{event:?}"),
                event = polite.next() => panic!("{event:?}"),
            }
        }
        assert!(
            flood < 100_000,
            "the polite peer waited for {flood} messages of another peer"
        );
    });
}

#[test]
fn disconnecting_a_silent_peer_frees_its_window() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "silent").await;
        for number in 0..1_000 {
            host.send(id, &numbered_job(number, 10_000));
        }
        assert!(host.backlog(id) > 9_000_000);
        host.disconnect(id);
        assert_eq!(host.backlog(id), 0);
        // The process is alive, so it may come back in a new session.
        let (again, event) = loop {
            tokio::select! {
                event = host.next() => if let HostEvent::Hello { peer, .. } = event {
                    let welcome = welcome(&host);
                    host.accept(peer, &welcome);
                    assert_ne!(peer, id);
                },
                event = peer.next() => if matches!(event, PeerEvent::Rejoined) {
                    break (true, peer.next().await);
                },
            }
        };
        assert!(again && matches!(event, PeerEvent::Message(ToPeer::Welcome { .. })));
    });
}

#[test]
fn process_has_one_session_at_a_time() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "returner").await;
        // The peer loses its session without a farewell, while the broker still has it. The file
        // with the generation names a dead broker until the peer notices.
        let current = site.instance.dir().join("current");
        let text = std::fs::read_to_string(&current).unwrap();
        let dead = text.replace("\"pid_started\":", "\"pid_started\":1");
        assert_ne!(dead, text);
        std::fs::write(&current, &dead).unwrap();
        let mut gone = false;
        let mut looked = 0;
        loop {
            tokio::select! {
                event = host.next() => match event {
                    HostEvent::Gone { peer } => {
                        assert_eq!(peer, id);
                        gone = true;
                    }
                    HostEvent::Hello { peer, .. } => {
                        assert!(gone && peer != id);
                        let welcome = welcome(&host);
                        host.accept(peer, &welcome);
                    }
                    other => panic!("{other:?}"),
                },
                event = peer.next() => {
                    assert!(matches!(event, PeerEvent::Rejoined), "{event:?}");
                    break;
                }
                () = tokio::time::sleep(Duration::from_millis(20)) => {
                    looked += 1;
                    if looked == 10 {
                        std::fs::write(&current, &text).unwrap();
                    }
                }
            }
        }
    });
}

#[test]
fn garbage_is_reported_and_does_no_harm() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "garbler").await;
        let (polite_id, mut polite) = join(&mut host, &site, "polite").await;
        peer.send_garbage(&[0xff; 100]);
        peer.send_garbage(&[]);
        peer.send(&numbered(1, 10));
        polite.send(&numbered(2, 10));
        let (mut garbage, mut messages) = (0, 0);
        while garbage < 2 || messages < 2 {
            tokio::select! {
                event = host.next() => match event {
                    HostEvent::Garbage { peer, what } => {
                        assert_eq!(peer, id);
                        assert!(what.contains("not a valid message"), "{what}");
                        garbage += 1;
                    }
                    HostEvent::Message { peer, message } => {
                        let number = if peer == polite_id { 2 } else { 1 };
                        assert_eq!(message, numbered(number, 10));
                        messages += 1;
                    }
                    other => panic!("{other:?}"),
                },
                event = peer.next() => panic!("{event:?}"),
                event = polite.next() => panic!("{event:?}"),
            }
        }
    });
}

#[test]
fn refused_peer_gets_the_reason() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let joining = Peer::join(&site.instance, hello("twin"), PeerOptions::default());
        tokio::pin!(joining);
        let error = loop {
            tokio::select! {
                joined = &mut joining => break joined.err().unwrap(),
                event = host.next() => if let HostEvent::Hello { peer, .. } = event {
                    host.refuse(peer, "`twin` is here already");
                },
            }
        };
        assert_eq!(error, JoinError::Refused("`twin` is here already".into()));
    });
}

#[test]
fn peer_above_the_limit_gets_the_reason() {
    run(async {
        let site = Site::new();
        let options = HostOptions {
            max_peers: 1,
            ..HostOptions::default()
        };
        let mut host = Host::start(&site.instance, options).unwrap();
        let _first = join(&mut host, &site, "first").await;
        let joining = Peer::join(&site.instance, hello("second"), PeerOptions::default());
        tokio::pin!(joining);
        let error = tokio::select! {
            joined = &mut joining => joined.err().unwrap(),
            event = host.next() => panic!("{event:?}"),
        };
        let JoinError::Refused(why) = error else {
            panic!("{error}")
        };
        assert_eq!(why, "the broker already serves 1 bundles and reporters");
    });
}

#[test]
fn joining_without_a_broker_gives_a_clear_error() {
    run(async {
        let site = Site::new();
        let options = PeerOptions {
            patience: Duration::ZERO,
            ..PeerOptions::default()
        };
        let error = Peer::join(&site.instance, hello("early"), options)
            .await
            .err()
            .unwrap();
        assert_eq!(
            error,
            JoinError::NoBroker {
                instance: "i".into()
            }
        );
    });
}

#[test]
fn other_protocol_version_is_refused() {
    run(async {
        let site = Site::new();
        let _host = site.host();
        let current = site.instance.dir().join("current");
        let text = std::fs::read_to_string(&current).unwrap();
        let (ours, theirs) = (PROTOCOL_VERSION, PROTOCOL_VERSION + 1);
        let newer = text.replace(
            &format!("\"protocol\":{ours}"),
            &format!("\"protocol\":{theirs}"),
        );
        assert_ne!(newer, text);
        std::fs::write(&current, newer).unwrap();
        let joined = Peer::join(&site.instance, hello("old"), PeerOptions::default()).await;
        assert_eq!(
            joined.err(),
            Some(JoinError::ProtocolMismatch { ours, theirs })
        );
        let other = text.replace("\"0.10.0\"", "\"0.11.0\"");
        assert_ne!(other, text);
        std::fs::write(&current, other).unwrap();
        let joined = Peer::join(&site.instance, hello("old"), PeerOptions::default()).await;
        assert!(matches!(
            joined.err(),
            Some(JoinError::IceoryxMismatch { .. })
        ));
    });
}

#[test]
fn second_broker_is_refused_and_names_the_first() {
    run(async {
        let site = Site::new();
        let _host = site.host();
        let second = Host::start(&site.instance, HostOptions::default());
        let Err(StartError::AlreadyRunning { pid, .. }) = second else {
            panic!("a second broker must be refused");
        };
        assert_eq!(pid, Some(std::process::id()));
        assert_eq!(site.instance.broker_pid(), Some(std::process::id()));
    });
}

#[test]
fn long_instance_paths_are_supported() {
    run(async {
        let dir = tempfile::TempDir::new().unwrap();
        let long = dir.path().join("a".repeat(100)).join("b".repeat(80));
        let site = Instance::at(long);
        let mut host = Host::start(&site, HostOptions::default()).unwrap();
        let joining = Peer::join(&site, hello("far"), PeerOptions::default());
        tokio::pin!(joining);
        loop {
            tokio::select! {
                joined = &mut joining => { joined.unwrap(); break; }
                event = host.next() => if let HostEvent::Hello { peer, .. } = event {
                    let welcome = welcome(&host);
                    host.accept(peer, &welcome);
                },
            }
        }
    });
}

#[test]
fn latest_configuration_reaches_every_peer() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut early) = join(&mut host, &site, "early").await;
        for number in 0..10_u8 {
            host.set_config(Digest([number; 32]), &vec![number; 100_000]);
        }
        let (_, mut late) = join_with(&mut host, &site, "late", PeerOptions::default()).await;
        for peer in [&mut early, &mut late] {
            loop {
                tokio::select! {
                    event = host.next() => panic!("{event:?}"),
                    event = peer.next() => {
                        let PeerEvent::Config(digest) = event else { panic!("{event:?}") };
                        if digest == Digest([9; 32]) {
                            break;
                        }
                    }
                }
            }
            let (digest, bytes) = peer.config().unwrap();
            assert_eq!((digest, &*bytes), (Digest([9; 32]), &[9_u8; 100_000][..]));
        }
    });
}

#[test]
fn bus_without_expected_configuration_carries_a_small_one() {
    run(async {
        let site = Site::new();
        let options = HostOptions {
            config_grows: false,
            ..HostOptions::default()
        };
        let mut host = Host::start(&site.instance, options).unwrap();
        host.set_config(Digest([1; 32]), &[7; 60_000]);
        let (_, mut peer) = join(&mut host, &site, "peer").await;
        // A configuration that is too large is not published. The previous one stays.
        host.set_config(Digest([2; 32]), &[8; 100_000]);
        let config = tokio::select! {
            event = host.next() => panic!("{event:?}"),
            event = peer.next() => event,
        };
        assert!(
            matches!(config, PeerEvent::Config(Digest([1, ..]))),
            "{config:?}"
        );
        assert_eq!(&*peer.config().unwrap().1, &[7; 60_000][..]);
    });
}
