//! The end of a broker leaves no shared memory behind, regardless of the actions of others.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use qcbus_bus::{Documents, HostEvent, Peer, PeerOptions};

use crate::support::{Site, files_of, hello, identity_of, run, run_forever, shared_memory_named};

/// Number of ends. Each end meets the other threads at another point of their work.
const ENDS: u64 = 40;
/// Number of joining threads. With three of them, one is always about to join.
const JOINERS: usize = 3;

fn join_again_and_again(site: &Site, over: &AtomicBool) {
    let options = PeerOptions {
        patience: Duration::ZERO,
        grace: Duration::from_millis(20),
        ..PeerOptions::default()
    };
    run_forever(async {
        while !over.load(Ordering::Relaxed) {
            // Most attempts find no broker, or one that ends before it answers.
            let _ = Peer::join(&site.instance, hello("late"), options).await;
        }
    });
}

/// Borrows images of growing size, because each new size class creates a file.
fn lend_more_and_more(documents: &Documents, over: &AtomicBool) {
    for power in (10..23).cycle() {
        if over.load(Ordering::Relaxed) {
            return;
        }
        let _ = documents.loan(1 << power);
    }
}

#[test]
fn resources_created_while_a_broker_ends_are_removed() {
    let site = Site::new();
    let mut identities = Vec::new();
    for end in 0..ENDS {
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            for _ in 0..JOINERS {
                scope.spawn(|| join_again_and_again(&site, &over));
            }
            run(async {
                let mut host = site.host();
                identities.push(identity_of(&site.instance));
                let (documents, over) = (host.documents(), &over);
                scope.spawn(move || lend_more_and_more(&documents, over));
                let serves = tokio::time::sleep(Duration::from_micros(end * 457));
                tokio::pin!(serves);
                loop {
                    tokio::select! {
                        () = &mut serves => break,
                        event = host.next() => if let HostEvent::Hello { peer, .. } = event {
                            host.refuse(peer, "no");
                        }
                    }
                }
                drop(host);
            });
            std::thread::sleep(Duration::from_millis(5));
            over.store(true, Ordering::Relaxed);
        });
        let left: Vec<_> = identities
            .iter()
            .flat_map(|it| shared_memory_named(it))
            .collect();
        assert_eq!(left, Vec::<String>::new(), "after end {end}");
        assert_eq!(files_of(&site.instance), Vec::<String>::new());
    }
}
