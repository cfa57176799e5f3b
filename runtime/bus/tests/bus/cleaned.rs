//! Files removed by a cleaner of temporary files are created again, and the sessions of joined
//! peers do not notice.

use std::time::Duration;

use qcbus_bus::{Host, HostEvent, HostOptions, Peer, PeerEvent, PeerId, StartError};
use qcbus_messages::Digest;

use crate::support::{Site, files_of, identity_of, join, numbered, numbered_job, run};

/// Sends a message in each direction within the existing session.
async fn talk(host: &mut Host, (id, peer): &mut (PeerId, Peer), number: u64) {
    peer.send(&numbered(number, 10));
    host.send(*id, &numbered_job(number, 10));
    let (mut there, mut back) = (false, false);
    while !(there && back) {
        tokio::select! {
            event = host.next() => {
                let HostEvent::Message { peer, message } = event else { panic!("{event:?}") };
                assert_eq!((peer, message), (*id, numbered(number, 10)));
                there = true;
            }
            event = peer.next() => {
                let PeerEvent::Message(message) = event else { panic!("{event:?}") };
                assert_eq!(message, numbered_job(number, 10));
                back = true;
            }
        }
    }
}

/// Serves until `done`. No event may occur meanwhile.
async fn until(host: &mut Host, peer: &mut Peer, mut done: impl FnMut() -> bool) {
    while !done() {
        tokio::select! {
            event = host.next() => panic!("{event:?}"),
            event = peer.next() => panic!("{event:?}"),
            () = tokio::time::sleep(Duration::from_millis(5)) => {}
        }
    }
}

#[test]
fn session_survives_removal_of_the_current_file() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let mut there = join(&mut host, &site, "there").await;
        let current = site.instance.dir().join("current");
        let text = std::fs::read(&current).unwrap();
        std::fs::remove_file(&current).unwrap();
        until(&mut host, &mut there.1, || current.exists()).await;
        assert_eq!(std::fs::read(&current).unwrap(), text);
        talk(&mut host, &mut there, 1).await;
        let mut late = join(&mut host, &site, "late").await;
        talk(&mut host, &mut late, 2).await;
    });
}

#[test]
fn removed_runtime_directory_is_created_again() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let mut there = join(&mut host, &site, "there").await;
        let sorted = || {
            let mut files = files_of(&site.instance);
            files.sort();
            files
        };
        let (before, identity) = (sorted(), identity_of(&site.instance));
        std::fs::remove_dir_all(site.instance.dir()).unwrap();
        until(&mut host, &mut there.1, || {
            site.instance.dir().is_dir() && sorted() == before
        })
        .await;
        assert_eq!(identity_of(&site.instance), identity);
        talk(&mut host, &mut there, 1).await;
        let mut late = join(&mut host, &site, "late").await;
        talk(&mut host, &mut late, 2).await;
        // The lock keeps a second broker out, as before.
        let second = Host::start(&site.instance, HostOptions::default());
        let Err(StartError::AlreadyRunning { pid, .. }) = second else {
            panic!("a second broker must be refused");
        };
        assert_eq!(pid, Some(std::process::id()));
        host.set_config(Digest([1; 32]), b"x");
        drop(host);
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
    });
}
