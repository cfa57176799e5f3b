//! Tests of a bundle as a daemon, against the bus's own host: join, job, missing document, drain.

use std::time::Duration;

use crate::common;
use crate::on_bus::{self, CONFIG};
use qcbus_bus::{Host, HostEvent};
use qcbus_document::Document;
use qcbus_formats::xqar::Status;
use qcbus_messages::{DocId, FromPeer, JobId, ToPeer};
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

const DOC: DocId = DocId(1);
const JOB: JobId = JobId(5);

#[test]
fn bundle_checks_job_and_leaves_when_drained() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("instance");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    let daemon = runtime.block_on(async {
        let mut host = on_bus::host(&dir);
        let options = BusOptions {
            instance_dir: Some(dir),
            ..BusOptions::default()
        };
        let daemon = std::thread::spawn(move || qcbus_sdk::run(&BUNDLE, Mode::Bus(options)));
        let talk = tokio::time::timeout(Duration::from_secs(60), talk(&mut host)).await;
        let (issues, done) = talk.expect("the bundle answers");
        assert_eq!((issues, done), (2, Status::Completed));
        // The host must acknowledge the last messages before the bundle ends.
        while !daemon.is_finished() {
            let _ = tokio::time::timeout(Duration::from_millis(20), host.next()).await;
        }
        daemon
    });
    assert_eq!(daemon.join().unwrap(), Exit::Accepted);
}

/// Acts as the broker until the bundle leaves. Publishes the document on request.
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
                    assert_eq!(&*catalogue.checkers[0].id, "roads");
                    host.send(peer, &ToPeer::Job(on_bus::job(JOB, DOC)));
                }
                FromPeer::NeedDocument { doc } => {
                    assert_eq!(doc, DOC);
                    let map = "<OpenDRIVE><header/><road id='1'/><road id='2'/></OpenDRIVE>";
                    on_bus::publish(host, doc, map);
                }
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
            HostEvent::Gone { .. } => panic!("the bundle must stay connected"),
        }
    }
}
