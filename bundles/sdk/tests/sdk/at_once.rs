//! Tests of several parallel jobs in one bundle, against the bus's own host.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::common;
use crate::on_bus::{self, CONFIG};
use qcbus_bus::{Host, HostEvent, PeerId};
use qcbus_document::Document;
use qcbus_messages::{DocId, FromPeer, JobId, ToPeer};
use qcbus_sdk::run::BusOptions;
use qcbus_sdk::{Bundle, Exit, Mode, Rule, Sink};

/// Number of jobs in the rule now, and the maximum so far.
static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);
const THREADS: usize = 2;
/// Timeout for machines that give other threads almost no time. Elsewhere the test ends much
/// earlier.
const WATCHDOG: Duration = Duration::from_secs(20);

static MEETS: Rule<Document> = Rule {
    id: "meets",
    uids: &["x:xodr:1.0.0:a.b"],
    run: meets,
    ..Rule::DEFAULTS
};

static BUNDLE: Bundle = Bundle {
    rules: &[&MEETS],
    ..common::BUNDLE
};

/// Waits until another job is in the rule, too. The job with the road `slow` waits for the end of
/// all others.
fn meets(document: &Document<'_>, found: &mut Sink<'_>) {
    let now = NOW.fetch_add(1, Ordering::SeqCst) + 1;
    MOST.fetch_max(now, Ordering::SeqCst);
    let begin = Instant::now();
    let is_slow = document
        .elements("road")
        .any(|it| it.attr("id") == Some("slow"));
    while MOST.load(Ordering::SeqCst) < THREADS && begin.elapsed() < WATCHDOG {
        std::thread::yield_now();
    }
    while is_slow && OVER.load(Ordering::SeqCst) < JOBS - 1 && begin.elapsed() < WATCHDOG {
        std::thread::yield_now();
    }
    for road in document.elements("road") {
        found.issue(road, road.attr("id").unwrap_or_default());
    }
    NOW.fetch_sub(1, Ordering::SeqCst);
}

/// Number of jobs with an end that the host has received.
static OVER: AtomicUsize = AtomicUsize::new(0);
const JOBS: usize = 12;

#[test]
fn jobs_run_in_parallel_and_slow_job_blocks_none() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("instance");
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(async {
        let mut host = on_bus::host(&dir);
        let options = BusOptions {
            instance_dir: Some(dir),
            threads: THREADS,
            ..BusOptions::default()
        };
        let daemon = std::thread::spawn(move || qcbus_sdk::run(&BUNDLE, Mode::Bus(options)));
        let talk = tokio::time::timeout(Duration::from_secs(60), talk(&mut host)).await;
        let (found, order) = talk.expect("the bundle answers");
        for (job, texts) in &found {
            assert_eq!(texts, &[road(job.0)], "{job:?}");
        }
        assert_eq!(found.len(), JOBS);
        assert_eq!(
            MOST.load(Ordering::SeqCst),
            THREADS,
            "as many jobs at once as configured"
        );
        assert_eq!(
            order.last(),
            Some(&JobId(0)),
            "the slow job starts first and ends last"
        );
        while !daemon.is_finished() {
            let _ = tokio::time::timeout(Duration::from_millis(20), host.next()).await;
        }
        assert_eq!(daemon.join().unwrap(), Exit::Accepted);
    });
}

fn road(job: u64) -> String {
    match job {
        0 => "slow".to_owned(),
        job => format!("of-{job}"),
    }
}

type Found = BTreeMap<JobId, Vec<String>>;

/// Acts as the broker until the bundle leaves. Returns the findings and the order in which jobs
/// ended.
async fn talk(host: &mut Host) -> (Found, Vec<JobId>) {
    let (mut found, mut order) = (Found::new(), Vec::new());
    loop {
        match host.next().await {
            HostEvent::Hello { peer, hello, .. } => {
                assert_eq!(usize::from(hello.threads), THREADS);
                let generation = host.generation();
                let config = CONFIG;
                host.accept(peer, &ToPeer::Welcome { generation, config });
            }
            HostEvent::Message { peer, message } => {
                if said(host, peer, message, &mut found, &mut order) {
                    return (found, order);
                }
            }
            HostEvent::Garbage { what, .. } | HostEvent::TurnedAway { why: what } => {
                panic!("{what}")
            }
            HostEvent::Gone { .. } => panic!("the bundle must stay connected"),
        }
    }
}

/// Handles a message. Returns `true` if the bundle leaves.
fn said(
    host: &mut Host,
    peer: PeerId,
    message: FromPeer,
    found: &mut Found,
    order: &mut Vec<JobId>,
) -> bool {
    match message {
        FromPeer::Catalogue(_) => {
            for number in 0..JOBS as u64 {
                publish(host, number);
                host.send(
                    peer,
                    &ToPeer::Job(on_bus::job(JobId(number), DocId(number))),
                );
            }
        }
        FromPeer::NeedDocument { doc } => publish(host, doc.0),
        FromPeer::Issues { job, issues, .. } => {
            let texts = issues.into_iter().map(|issue| issue.description);
            found.entry(job).or_default().extend(texts);
        }
        FromPeer::JobDone { job, .. } => {
            order.push(job);
            OVER.fetch_add(1, Ordering::SeqCst);
            let all: BTreeSet<&JobId> = order.iter().collect();
            assert_eq!(all.len(), order.len(), "each job ends only once");
            if order.len() == JOBS {
                host.send(peer, &ToPeer::Drain);
            }
        }
        FromPeer::Leaving => return true,
        FromPeer::CheckersDone { .. }
        | FromPeer::Heartbeat { .. }
        | FromPeer::ResultDone { .. }
        | FromPeer::WithdrawalDone { .. } => {}
    }
    false
}

fn publish(host: &Host, number: u64) {
    let map = format!(
        "<OpenDRIVE><header/><road id='{}'/></OpenDRIVE>",
        road(number)
    );
    on_bus::publish(host, DocId(number), &map);
}
