//! Tests of a reporter on a real bus, with a simulated broker.

use std::collections::BTreeMap;
use std::future::Future;
use std::path::Path;
use std::time::Duration;

use qcbus_bus::{Host, HostEvent, HostOptions, Instance, PeerId};
use qcbus_document::FileKind;
use qcbus_formats::xqar::Results;
use qcbus_messages::{
    Digest, DocId, FromPeer, Hello, JobId, PeerReport, ResultMessage, Role, ToPeer, Verdict,
    Withdrawn,
};
use qcbus_reporter_sdk::{Identity, ReportError, Reporter, Sources, run};

/// Timeout that only a hanging test reaches, even on the slowest machine.
const WATCHDOG: Duration = Duration::from_secs(60);

/// A reporter that records line 2 of each result's file, by display path.
#[derive(Default)]
struct SecondLines {
    seen: Vec<(String, Option<String>)>,
    finished: bool,
}

impl Reporter for SecondLines {
    fn report(&mut self, result: &ResultMessage, sources: &dyn Sources) -> Result<(), ReportError> {
        if result.display_path == "full.xodr" {
            return Err(ReportError::Form("there is no room".into()));
        }
        let line = sources.line(&result.input, 2, 1).map(|line| line.text);
        self.seen.push((result.display_path.clone(), line));
        Ok(())
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
        self.seen.retain(|(path, _)| *path != gone.display_path);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        self.finished = true;
        Ok(())
    }
}

fn result(job: u64, input: &Path, document: Option<DocId>, digest: Digest) -> ResultMessage {
    let name = input.file_name().unwrap().to_string_lossy();
    ResultMessage {
        job: JobId(job),
        input: input.to_string_lossy().into_owned(),
        display_path: name.clone().into_owned(),
        xqar: format!("{}.xqar", input.display()),
        verdict: Verdict::Accepted,
        digest,
        config: Digest::default(),
        document,
        results: Results::default(),
        rules: BTreeMap::new(),
        params: Vec::new(),
    }
}

fn identity() -> Identity {
    Identity {
        name: "qc-report-test".into(),
        version: "0.1.0".into(),
        launch: Some(3),
    }
}

fn block_on(test: impl Future<Output = ()>) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    runtime
        .block_on(async { tokio::time::timeout(WATCHDOG, test).await })
        .expect("watchdog timeout: this did not happen");
}

/// The simulated broker.
struct Broker {
    host: Host,
    reporter: Option<PeerId>,
}

impl Broker {
    fn start(instance: &Instance) -> Broker {
        let host = Host::start(instance, HostOptions::default()).unwrap();
        Broker {
            host,
            reporter: None,
        }
    }

    async fn welcome(&mut self) -> Hello {
        loop {
            if let HostEvent::Hello { peer, hello, .. } = self.host.next().await {
                let welcome = ToPeer::Welcome {
                    generation: self.host.generation(),
                    config: Digest::default(),
                };
                self.host.accept(peer, &welcome);
                self.reporter = Some(peer);
                return hello;
            }
        }
    }

    fn send(&mut self, message: &ToPeer) {
        self.host.send(self.reporter.unwrap(), message);
    }

    /// Returns the next answer that is not a heartbeat.
    async fn answer(&mut self) -> FromPeer {
        loop {
            match self.host.next().await {
                HostEvent::Message {
                    message: FromPeer::Heartbeat { .. },
                    ..
                } => {}
                HostEvent::Message { message, .. } => return message,
                HostEvent::Garbage { what, .. } => panic!("invalid message: {what}"),
                HostEvent::Hello { .. } | HostEvent::Gone { .. } | HostEvent::TurnedAway { .. } => {
                }
            }
        }
    }

    async fn report(&mut self, result: ResultMessage) -> PeerReport {
        let job = result.job;
        self.send(&ToPeer::Result(Box::new(result)));
        match self.answer().await {
            FromPeer::ResultDone { job: done, report } if done == job => report,
            other => panic!("unexpected answer {other:?}"),
        }
    }

    /// Publishes the file as document `doc`. Returns the digest of its bytes.
    fn publish(&self, path: &Path, doc: DocId) -> Digest {
        let (image, digest) = image(path);
        let mut loan = self.host.documents().loan(image.len()).unwrap();
        loan[..image.len()].copy_from_slice(&image);
        loan.publish(doc, image.len(), digest, FileKind::Xodr)
            .unwrap();
        digest
    }
}

fn image(path: &Path) -> (Vec<u8>, Digest) {
    let limits = qcbus_ingest::Limits::default();
    let prepared = qcbus_ingest::prepare(path, path.parent().unwrap(), &limits).unwrap();
    (prepared.build(), Digest(prepared.digest()))
}

#[test]
fn results_are_written_acknowledged_and_drained() {
    let dir = tempfile::tempdir().unwrap();
    let instance = Instance::at(dir.path().join("i"));
    let file = dir.path().join("a.xodr");
    std::fs::write(&file, "<OpenDRIVE>\n  <header/>\n</OpenDRIVE>\n").unwrap();
    let mut reporter = SecondLines::default();
    block_on(async {
        let mut broker = Broker::start(&instance);
        let identity = identity();
        let running = run(&instance, &identity, &mut reporter);
        let broking = async {
            let hello = broker.welcome().await;
            assert_eq!((hello.role, hello.launch), (Role::Reporter, Some(3)));
            let digest = broker.publish(&file, DocId(5));
            // From now on, the file on disk differs from the checked document.
            std::fs::write(&file, "<OpenDRIVE>\n  <changed/>\n</OpenDRIVE>\n").unwrap();
            let known = result(1, &file, Some(DocId(5)), digest);
            assert_eq!(broker.report(known.clone()).await, PeerReport::Written);
            // The same result is acknowledged again, but not written twice.
            assert_eq!(broker.report(known).await, PeerReport::Written);

            let changed = result(2, &file, None, digest);
            assert_eq!(broker.report(changed).await, PeerReport::Written);

            let full = result(3, &dir.path().join("full.xodr"), None, digest);
            let PeerReport::Failed(why) = broker.report(full).await else {
                panic!("the write must fail");
            };
            assert!(why.ends_with("there is no room"), "{why}");
            broker.send(&ToPeer::Drain);
            assert_eq!(broker.answer().await, FromPeer::Leaving);
            // The reporter leaves after the last acknowledgement.
            loop {
                broker.host.next().await;
            }
        };
        tokio::select! {
            ended = running => ended.unwrap(),
            () = broking => {}
        }
    });
    assert!(reporter.finished);
    // The document on the bus is the checked one. A file that has changed since then is not shown.
    let expected = [
        ("a.xodr".to_owned(), Some("  <header/>".to_owned())),
        ("a.xodr".to_owned(), None),
    ];
    assert_eq!(reporter.seen, expected);
}

#[test]
fn reporter_rejoins_new_broker() {
    let dir = tempfile::tempdir().unwrap();
    let instance = Instance::at(dir.path().join("i"));
    let file = dir.path().join("a.xodr");
    std::fs::write(&file, "<OpenDRIVE>\n  <header/>\n</OpenDRIVE>\n").unwrap();
    let digest = image(&file).1;
    let mut reporter = SecondLines::default();
    block_on(async {
        let identity = identity();
        let running = run(&instance, &identity, &mut reporter);
        let first = Broker::start(&instance);
        let broking = async {
            let mut first = first;
            first.welcome().await;
            let report = first.report(result(1, &file, None, digest)).await;
            assert_eq!(report, PeerReport::Written);
            drop(first);
            // Job numbers start again and refer to other jobs.
            let mut second = Broker::start(&instance);
            second.welcome().await;
            let report = second.report(result(1, &file, None, digest)).await;
            assert_eq!(report, PeerReport::Written);
        };
        tokio::select! {
            ended = running => ended.unwrap(),
            () = broking => {}
        }
    });
    assert_eq!(reporter.seen.len(), 2);
}

#[test]
fn reporter_without_broker_fails_with_explanation() {
    let dir = tempfile::tempdir().unwrap();
    let instance = Instance::at(dir.path().join("nobody"));
    block_on(async {
        let mut reporter = SecondLines::default();
        let error = run(&instance, &identity(), &mut reporter)
            .await
            .unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("join the bus: no broker"), "{text}");
    });
}
