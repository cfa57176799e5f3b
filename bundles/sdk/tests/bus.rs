//! A bundle as a daemon, against the bus's own host: join, job, missing document, drain.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "tests fail by panicking, their helpers too"
)]

mod common;

use std::path::Path;
use std::time::Duration;

use qcbus_bus::{Host, HostEvent, HostOptions, Instance};
use qcbus_document::{Document, FileKind};
use qcbus_formats::config::Config;
use qcbus_formats::xqar::Status;
use qcbus_messages::{
    Digest, DocId, DocumentRole, FromPeer, Job, JobDocument, JobId, ToPeer, codec,
};
use qcbus_sdk::run::BusOptions;
use qcbus_sdk::{Bundle, Exit, Mode, Rule, Sink};

static ROADS: Rule<Document> = Rule {
    id: "roads",
    uids: &["x:xodr:1.0.0:a.b"],
    run: every_road,
    ..Rule::DEFAULTS
};

static BUNDLE: Bundle = Bundle {
    rules: &[&ROADS],
    ..common::BUNDLE
};

fn every_road(document: &Document<'_>, found: &mut Sink<'_>) {
    for road in document.elements("road") {
        found.issue(road, "a road");
    }
}

const CONFIG: Digest = Digest([7; 32]);
const DOC: DocId = DocId(1);
const JOB: JobId = JobId(5);

#[test]
fn a_job_is_checked_and_the_bundle_leaves_when_drained() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("instance");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    let daemon = runtime.block_on(async {
        let mut host = Host::start(&Instance::at(dir.clone()), HostOptions::default()).unwrap();
        host.set_config(CONFIG, &codec::encode(&None::<Config>).unwrap());
        let options = BusOptions {
            instance_dir: Some(dir),
            ..BusOptions::default()
        };
        let daemon = std::thread::spawn(move || qcbus_sdk::run(&BUNDLE, Mode::Bus(options)));
        let talk = tokio::time::timeout(Duration::from_secs(60), talk(&mut host)).await;
        let (issues, done) = talk.expect("the bundle answers");
        assert_eq!((issues, done), (2, Status::Completed));
        // The host acknowledges what the leaving bundle still waits for.
        while !daemon.is_finished() {
            let _ = tokio::time::timeout(Duration::from_millis(20), host.next()).await;
        }
        daemon
    });
    assert_eq!(daemon.join().unwrap(), Exit::Accepted);
}

/// Plays the broker until the bundle leaves. The document is published when it is asked for.
async fn talk(host: &mut Host) -> (usize, Status) {
    let (mut issues, mut status) = (0, Status::Error);
    loop {
        match host.next().await {
            HostEvent::Hello { peer, hello, .. } => {
                assert_eq!(hello.name, "testBundle");
                let generation = host.generation();
                host.accept(
                    peer,
                    &ToPeer::Welcome {
                        generation,
                        config: CONFIG,
                    },
                );
            }
            HostEvent::Message { peer, message } => match message {
                FromPeer::Catalogue(catalogue) => {
                    assert_eq!(catalogue.checkers[0].id, "roads");
                    host.send(peer, &ToPeer::Job(job()));
                }
                FromPeer::NeedDocument { doc } => publish(host, doc),
                FromPeer::Issues {
                    job, issues: batch, ..
                } => {
                    assert_eq!(job, JOB);
                    issues += batch.len();
                }
                FromPeer::CheckersDone { ended, .. } => status = ended[0].ending.status(),
                FromPeer::JobDone { .. } => host.send(peer, &ToPeer::Drain),
                FromPeer::Leaving => return (issues, status),
                FromPeer::Heartbeat { .. }
                | FromPeer::ResultDone { .. }
                | FromPeer::WithdrawalDone { .. } => {}
            },
            HostEvent::Garbage { what, .. } | HostEvent::TurnedAway { why: what } => {
                panic!("{what}")
            }
            HostEvent::Gone { .. } => panic!("the bundle went away"),
        }
    }
}

fn publish(host: &Host, doc: DocId) {
    assert_eq!(doc, DOC);
    let map = b"<OpenDRIVE><header/><road id='1'/><road id='2'/></OpenDRIVE>".to_vec();
    let image =
        qcbus_ingest::prepare_bytes(Path::new("/a.xodr"), map, &qcbus_ingest::Limits::default())
            .build();
    let mut loan = host.documents().loan(image.len()).unwrap();
    loan[..image.len()].copy_from_slice(&image);
    // Held by the bus's history; the broker would keep it for as long as the job lasts.
    drop(
        loan.publish(doc, image.len(), Digest([1; 32]), FileKind::Xodr)
            .unwrap(),
    );
}

fn job() -> Job {
    let root = JobDocument {
        doc: DOC,
        role: DocumentRole::Root,
        path: "/a.xodr".to_owned(),
        digest: Digest([1; 32]),
        referred_at: 0,
        links: Vec::new(),
    };
    Job {
        job: JOB,
        config: CONFIG,
        kind: FileKind::Xodr,
        documents: vec![root],
        missing: Vec::new(),
    }
}
