//! Documents are published once and read in place.

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;

use qcbus_bus::{Documents, Host, HostEvent, HostOptions, LoanError, MappedImage, Peer};
use qcbus_document::FileKind;
use qcbus_messages::{Digest, DocId, FromPeer};

use crate::helper::{Helper, job_with};
use crate::support::{Site, has_room, is_uniform, join, run, welcome};

fn publish(documents: &Documents, doc: u64, len: usize) -> MappedImage {
    let mut loan = documents.loan(len + 10).unwrap();
    assert_eq!(loan.len(), len + 10);
    assert_eq!(loan.as_ptr().addr() % 64, 0);
    loan.fill(pattern(doc));
    let mapped_image = loan
        .publish(DocId(doc), len, digest(doc), FileKind::Xosc)
        .unwrap();
    check(&mapped_image, doc, len);
    mapped_image
}

fn pattern(doc: u64) -> u8 {
    (doc % 251) as u8 + 1
}

fn digest(doc: u64) -> Digest {
    Digest([pattern(doc); 32])
}

fn check(mapped_image: &MappedImage, doc: u64, len: usize) {
    assert_eq!(mapped_image.doc(), DocId(doc));
    assert_eq!(mapped_image.digest(), digest(doc));
    assert_eq!(mapped_image.kind(), FileKind::Xosc);
    assert_eq!(mapped_image.len(), len);
    assert_eq!(mapped_image.as_ptr().addr() % 64, 0);
    assert!(is_uniform(mapped_image, pattern(doc)));
}

/// Waits for a document and returns it.
async fn arrival(host: &mut Host, peer: &mut Peer, doc: u64) -> MappedImage {
    loop {
        if let Some(mapped_image) = peer.document(DocId(doc)) {
            return mapped_image;
        }
        tokio::select! {
            event = host.next() => panic!("{event:?}"),
            _ = peer.next() => {}
        }
    }
}

#[test]
fn documents_of_every_size_arrive_aligned() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "reader").await;
        let documents = host.documents();
        let sizes = [0, 1, 63, 64, 65, 500_000, 524_288, 600_000, 9_000_000];
        for (doc, len) in (1..).zip(sizes) {
            let mapped_image = publish(&documents, doc, len);
            check(&arrival(&mut host, &mut peer, doc).await, doc, len);
            drop(mapped_image);
        }
    });
}

#[test]
fn large_document_reaches_four_readers_in_place() {
    if !has_room(400_000_000) {
        return;
    }
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let mut readers = Vec::new();
        for name in ["a", "b", "c", "d"] {
            readers.push(join(&mut host, &site, name).await.1);
        }
        let documents = host.documents();
        let len = 100_000_000;
        let worker = std::thread::spawn(move || publish(&documents, 5, len));
        while !worker.is_finished() {
            tokio::select! {
                event = host.next() => panic!("{event:?}"),
                () = tokio::task::yield_now() => {}
            }
        }
        let ours = worker.join().unwrap();
        for reader in &mut readers {
            let mapped_image = arrival(&mut host, reader, 5).await;
            assert_eq!(mapped_image.len(), len);
            assert_eq!(mapped_image[..], ours[..]);
        }
    });
}

#[test]
fn readers_share_a_document_without_a_copy() {
    if !has_room(400_000_000) {
        return;
    }
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let _readers: Vec<Helper> = (0..4)
            .map(|_| Helper::start("reads_and_weighs_itself", &site.instance))
            .collect();
        let len = 100_000_000;
        let mapped_image = publish(&host.documents(), 1, len);
        let mut weighed = 0;
        while weighed < 4 {
            match host.next().await {
                HostEvent::Hello { peer, .. } => {
                    let welcome = welcome(&host);
                    host.accept(peer, &welcome);
                }
                HostEvent::Message { message, .. } => {
                    let FromPeer::JobDone { micros: kib, .. } = message else {
                        panic!("{message:?}")
                    };
                    assert!(kib < 30_000, "{kib} KiB are private");
                    weighed += 1;
                }
                other => panic!("{other:?}"),
            }
        }
        check(&mapped_image, 1, len);
    });
}

#[test]
fn slots_are_recycled() {
    if !has_room(1_000_000_000) {
        return;
    }
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "reader").await;
        let documents = host.documents();
        let before = free_shared_memory();
        let len = 20_000_000;
        for doc in 1..=60 {
            let mapped_image = publish(&documents, doc, len);
            check(&arrival(&mut host, &mut peer, doc).await, doc, len);
            peer.forget(DocId(doc));
            drop(mapped_image);
        }
        let taken = before.saturating_sub(free_shared_memory());
        assert!(taken < 30 * len as u64, "{taken} bytes for 60 documents");
    });
}

fn free_shared_memory() -> u64 {
    let stat = rustix::fs::statvfs("/dev/shm").unwrap();
    stat.f_bavail * stat.f_frsize
}

#[test]
fn late_reader_gets_the_published_documents() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let documents = host.documents();
        let images: Vec<MappedImage> = (1..=20)
            .map(|doc| publish(&documents, doc, 10_000 * doc as usize))
            .collect();
        let large = publish(&documents, 21, 3_000_000);
        let (_, mut peer) = join(&mut host, &site, "late").await;
        for ours in images.iter().chain([&large]) {
            let doc = ours.doc().0;
            check(&arrival(&mut host, &mut peer, doc).await, doc, ours.len());
        }
    });
}

#[test]
fn lost_document_is_published_again() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "slow").await;
        let documents = host.documents();
        let first = publish(&documents, 1, 1_000);
        // These are more documents than the buffer of the slow reader takes while it does not read.
        for doc in 2..=100 {
            drop(publish(&documents, doc, 1_000));
        }
        arrival(&mut host, &mut peer, 100).await;
        assert!(peer.document(DocId(1)).is_none());
        documents.publish_again(&first).unwrap();
        check(&arrival(&mut host, &mut peer, 1).await, 1, 1_000);
    });
}

#[test]
fn reader_never_runs_out_of_permits() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "hoarder").await;
        let documents = host.documents();
        // The peer reads every document, forgets none and keeps a few. The newest one is always
        // available.
        let mut kept = BTreeMap::new();
        for doc in 1..=400 {
            drop(publish(&documents, doc, 100));
            let mapped_image = arrival(&mut host, &mut peer, doc).await;
            if doc % 20 == 0 {
                kept.insert(doc, mapped_image);
            }
        }
        for (doc, mapped_image) in kept {
            check(&mapped_image, doc, 100);
        }
    });
}

#[test]
fn document_of_a_job_stays_until_forgotten() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (id, mut peer) = join(&mut host, &site, "busy").await;
        let documents = host.documents();
        drop(publish(&documents, 1, 100));
        arrival(&mut host, &mut peer, 1).await;
        host.send(id, &job_with(1, DocId(1)));
        // No job of this peer needs these documents; they may be of another kind. No peer has
        // finished with any of them.
        for doc in 2..=400 {
            drop(publish(&documents, doc, 100));
            arrival(&mut host, &mut peer, doc).await;
        }
        assert!(peer.document(DocId(1)).is_some());
        peer.forget(DocId(1));
        for doc in 401..=800 {
            drop(publish(&documents, doc, 100));
            arrival(&mut host, &mut peer, doc).await;
        }
        assert!(peer.document(DocId(1)).is_none());
    });
}

#[test]
fn held_documents_are_bounded_by_the_slowest_reader() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "slow").await;
        let documents = host.documents();
        // The documents are large, because the bus carries the fewest of these at once.
        let len = 600_000;
        let mut images = Vec::new();
        while let Ok(loan) = documents.loan(len) {
            drop(loan);
            images.push(publish(&documents, images.len() as u64 + 1, len));
        }
        assert_eq!(documents.loan(len).err(), Some(LoanError::Busy));
        assert!(images.len() > 1);
        for doc in &images {
            arrival(&mut host, &mut peer, doc.doc().0).await;
        }
        // A place is left for publishing a document again, in case the reader has lost one.
        documents.publish_again(&images[0]).unwrap();
    });
}

#[test]
fn loans_are_bounded_by_the_available_memory() {
    run(async {
        let site = Site::new();
        let host = site.host();
        let documents = host.documents();
        assert_eq!(
            documents.loan(usize::MAX).err(),
            Some(LoanError::TooLarge(usize::MAX))
        );
        let some: Vec<_> = (0..8).map(|_| documents.loan(100).unwrap()).collect();
        assert_eq!(documents.loan(100).err(), Some(LoanError::Busy));
        drop(some);
        assert!(documents.loan(100).is_ok());

        let site = Site::new();
        let stat = rustix::fs::statvfs("/dev/shm").unwrap();
        let options = HostOptions {
            shm_reserve_bytes: u64::MAX,
            ..HostOptions::default()
        };
        let host = Host::start(&site.instance, options).unwrap();
        // The reserve is capped at a quarter. A loan that would leave less is refused.
        let most = stat.f_bavail * stat.f_frsize - stat.f_blocks * stat.f_frsize / 4;
        let refused = host.documents().loan(most as usize + (64 << 20));
        if most < u64::from(u32::MAX) - (64 << 20) {
            assert!(matches!(refused.err(), Some(LoanError::NoSpace { .. })));
        }
    });
}

#[test]
fn reader_keeps_documents_after_the_broker_ends() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "reader").await;
        let documents = host.documents();
        drop(publish(&documents, 1, 2_000_000));
        let mapped_image = arrival(&mut host, &mut peer, 1).await;
        drop(host);
        assert!(matches!(documents.loan(1), Err(LoanError::Bus(_))));
        drop(documents);
        check(&mapped_image, 1, 2_000_000);
        drop(peer);
        check(&mapped_image, 1, 2_000_000);
    });
}

#[test]
fn killed_reader_gives_everything_back() {
    run(async {
        let site = Site::new();
        let options = HostOptions {
            active_documents: 2,
            max_peers: 1,
            ..HostOptions::default()
        };
        let mut host = Host::start(&site.instance, options).unwrap();
        let documents = host.documents();
        for doc in 1..=30 {
            let holder = Helper::start("holds_documents", &site.instance);
            drop(publish(&documents, doc, 1_000));
            let id = loop {
                if let HostEvent::Hello { peer, .. } = host.next().await {
                    let welcome = welcome(&host);
                    host.accept(peer, &welcome);
                    break peer;
                }
            };
            loop {
                if let HostEvent::Message { message, .. } = host.next().await {
                    // A late joiner also gets the last two documents, and this one at the end.
                    let FromPeer::JobDone { job, .. } = message else {
                        panic!("{message:?}")
                    };
                    if job.0 == doc {
                        break;
                    }
                }
            }
            holder.kill();
            loop {
                if let HostEvent::Gone { peer } = host.next().await {
                    assert_eq!(peer, id);
                    break;
                }
            }
        }
    });
}

#[test]
fn writing_into_a_document_kills_only_the_writer() {
    run(async {
        let site = Site::new();
        let mut host = site.host();
        let (_, mut peer) = join(&mut host, &site, "bystander").await;
        let ours = publish(&host.documents(), 1, 1_000);
        let mut writer = Helper::start("writes_into_a_document", &site.instance);
        let id = loop {
            if let HostEvent::Hello { peer, .. } = host.next().await {
                let welcome = welcome(&host);
                host.accept(peer, &welcome);
                break peer;
            }
        };
        loop {
            if let HostEvent::Gone { peer } = host.next().await {
                assert_eq!(peer, id);
                break;
            }
        }
        assert_eq!(writer.line(), "writes");
        assert_eq!(writer.end().signal(), Some(libc::SIGSEGV));
        check(&ours, 1, 1_000);
        check(&arrival(&mut host, &mut peer, 1).await, 1, 1_000);
    });
}

#[test]
fn small_shared_memory_is_released_and_reused() {
    let site = Site::new();
    let role = "lives_in_a_small_memory";
    let Some(mut helper) = Helper::start_in_small_memory(role, &site.instance) else {
        println!("skipped: mounting a small /dev/shm is not allowed here");
        return;
    };
    assert_eq!(helper.line(), "40 documents, 1 refusals");
    assert!(helper.end().success());
}
