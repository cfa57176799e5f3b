//! Deaths of processes: the others notice them and go on, and no files are left behind.

use std::time::Duration;

use qcbus_bus::{Host, HostEvent, HostOptions, PeerEvent, PeerOptions};
use qcbus_messages::{FromPeer, ToPeer};

use crate::helper::{Helper, job_with};
use crate::support::{
    Site, WATCHDOG, files_of, identity_of, join, join_with, numbered_job, run, shared_memory_named,
    shared_memory_of, watched, welcome,
};

#[test]
fn clean_stop_leaves_nothing_behind() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let identity = identity_of(&site.instance);
        let (_, peer) = join(&mut host, &site, "there").await;
        assert!(!shared_memory_of(&site.instance).is_empty());
        assert_eq!(host.generation(), 1);
        drop(host);
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
        assert_eq!(shared_memory_named(&identity), Vec::<String>::new());
        drop(peer);
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
        assert_eq!(shared_memory_named(&identity), Vec::<String>::new());
    });
}

#[test]
fn killed_peer_is_gone_and_leaves_nothing_behind() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let identity = identity_of(&site.instance);
        let helper = Helper::start("answers_jobs", &site.instance);
        let id = loop {
            if let HostEvent::Hello { peer, hello, .. } = host.next().await {
                assert_eq!(hello.pid, helper.pid());
                let welcome = welcome(&host);
                host.accept(peer, &welcome);
                host.send(peer, &numbered_job(1, 10));
                break peer;
            }
        };
        let event = host.next().await;
        assert!(
            matches!(
                event,
                HostEvent::Message {
                    message: FromPeer::JobDone { .. },
                    ..
                }
            ),
            "{event:?}"
        );
        helper.kill();
        let event = host.next().await;
        assert!(matches!(event, HostEvent::Gone { peer } if peer == id));
        drop(host);
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
        assert_eq!(shared_memory_named(&identity), Vec::<String>::new());
    });
}

#[test]
fn peers_survive_a_killed_broker_and_join_the_next() {
    run(async {
        let site = Site::new();
        let mut broker = Helper::start("serves", &site.instance);
        assert_eq!(broker.line(), "serves 1");
        let identity = identity_of(&site.instance);
        let mut bundles: Vec<Helper> = (0..3)
            .map(|_| Helper::start("answers_jobs", &site.instance))
            .collect();
        for bundle in &mut bundles {
            assert_eq!(bundle.line(), "joined");
        }
        for generation in 2..6 {
            while !broker.line().starts_with("done") {}
            broker.kill();
            broker = Helper::start("serves", &site.instance);
            assert_eq!(broker.line(), format!("serves {generation}"));
            for bundle in &mut bundles {
                assert_eq!(bundle.line(), "rejoined");
            }
        }
        while !broker.line().starts_with("done") {}
        broker.kill();
        // The last broker runs in this process and cleans up after all the others.
        let mut host = site.host();
        assert_eq!(host.generation(), 6);
        let mut there = 0;
        let mut gone = 0;
        while gone < 3 {
            match host.next().await {
                HostEvent::Hello { peer, .. } => {
                    let welcome = welcome(&host);
                    host.accept(peer, &welcome);
                    there += 1;
                    host.send(peer, &ToPeer::Drain);
                }
                HostEvent::Gone { .. } => gone += 1,
                _ => {}
            }
        }
        assert_eq!(there, 3);
        for bundle in bundles {
            assert!(bundle.end().success());
        }
        drop(host);
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
        assert_eq!(shared_memory_named(&identity), Vec::<String>::new());
    });
}

#[test]
fn new_session_discards_the_old_one() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "survivor").await;
        host.send(id, &numbered_job(1, 10));
        drop(host);
        let mut host = Host::start(&site.instance, HostOptions::default()).unwrap();
        let event = watched(async {
            loop {
                tokio::select! {
                    event = host.next() => if let HostEvent::Hello { peer, .. } = event {
                        let welcome = welcome(&host);
                        host.accept(peer, &welcome);
                    },
                    event = peer.next() => break event,
                }
            }
        })
        .await;
        assert!(matches!(event, PeerEvent::Rejoined), "{event:?}");
        let event = peer.next().await;
        assert!(matches!(event, PeerEvent::Message(ToPeer::Welcome { .. })));
    });
}

#[test]
fn peer_without_a_new_broker_gives_up() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let options = PeerOptions {
            // Joining may take long on a busy machine.
            patience: WATCHDOG,
            grace: Duration::from_millis(100),
            ..PeerOptions::default()
        };
        let (_, mut peer) = join_with(&mut host, &site, "leftover", options).await;
        drop(host);
        let event = peer.next().await;
        let PeerEvent::Closed { reason } = event else {
            panic!("{event:?}")
        };
        assert_eq!(reason, "the broker has been unavailable for 0.1 s");
        assert!(matches!(peer.next().await, PeerEvent::Closed { .. }));
        peer.leave().await;
    });
}

#[test]
fn only_memory_of_the_killed_broker_is_removed() {
    run(async {
        let (site, neighbour) = (Site::new(), Site::new());
        let mut other = neighbour.host();
        let (other_id, mut other_peer) = join(&mut other, &neighbour, "neighbour").await;
        let mut broker = Helper::start("serves", &site.instance);
        assert_eq!(broker.line(), "serves 1");
        broker.kill();
        assert!(!shared_memory_of(&site.instance).is_empty());
        let identity = identity_of(&site.instance);
        let host = site.host();
        assert_eq!(host.generation(), 2);
        drop(host);
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
        assert_eq!(shared_memory_named(&identity), Vec::<String>::new());
        other.send(other_id, &job_with(1, qcbus_messages::DocId(1)));
        tokio::select! {
            event = other.next() => panic!("{event:?}"),
            event = other_peer.next() => {
                assert!(matches!(event, PeerEvent::Message(ToPeer::Job(_))));
            }
        }
    });
}
