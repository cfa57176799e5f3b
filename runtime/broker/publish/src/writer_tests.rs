//! Conditions under which results are written or not written.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::{Duration, Instant};

use qcbus_document::FileKind;
use qcbus_formats::xqar::Dialect;
use qcbus_messages::{Digest, JobId, Verdict};
use qcbus_types::{
    Epoch, FinishedJob, Input, Judged, PreparedJob, Reading, RequiredSet, StoreOutcome, digest_of,
};
use qcbus_watch::probes::Probes;
use qcbus_watch::stamp::stamp_through_links;
use tokio::sync::mpsc::unbounded_channel;

use crate::directory_lock::DirectoryLock;
use crate::gate::{Gate, GateOptions, Outside};
use crate::journal::{Entry, Journal};
use crate::outputs::Outputs;
use crate::result_paths::ResultPaths;
use crate::store::Store;
use crate::writers::{Order, Writers};

const NOW: u64 = (3 << 32) + 5;

fn store_in(dir: &Path) -> Store {
    Store {
        outputs: Outputs::default(),
        lock: DirectoryLock::share(&dir.join("out")).unwrap(),
        probes: Probes::default(),
        places: ResultPaths::of_watched(dir.join("out"), vec![dir.join("farm")]),
        choice: Default::default(),
        strict: false,
        all: false,
        dialect: Dialect::default(),
        durable: false,
        verdict_files: true,
        own_verdicts: false,
        retries: true,
        gate: None,
        trials: None,
        journal: Some(Journal::open(&dir.join("state"), "test").unwrap().into()),
        epoch: AtomicU64::new(NOW),
    }
}

/// Creates a file that was checked by the required set of this epoch.
fn finished(dir: &Path, epoch: u64) -> FinishedJob {
    let path: Arc<Path> = dir.join("farm/a.xodr").into();
    let bytes = b"<OpenDRIVE/>";
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(&path, bytes).unwrap();
    let input = Input {
        path: path.clone(),
        content: Reading::Read(stamp_through_links(&path).unwrap(), digest_of(bytes)),
    };
    let prepared = PreparedJob {
        inputs: vec![input],
        basis: Digest([1; 32]),
        racy: false,
        documents: Vec::new(),
        missing: Vec::new(),
        rests_on: Vec::new(),
        unwatched: Vec::new(),
        bytes: bytes.len() as u64,
    };
    FinishedJob {
        job: JobId(1),
        path,
        kind: FileKind::Xodr,
        config: Digest::default(),
        prepared: Some(Arc::new(prepared)),
        unreadable: None,
        bundles: Vec::new(),
        rests_on: Vec::new(),
        required_set: Arc::new(RequiredSet::default()),
        epoch: Epoch(epoch),
        elapsed: Duration::ZERO,
    }
}

#[test]
fn only_what_was_judged_in_the_present_epoch_is_written() {
    for (epoch, written) in [(NOW - 1, false), (NOW + 1, false), (NOW, true)] {
        let dir = tempfile::tempdir().unwrap();
        let store = store_in(dir.path());
        let outcome = store.store(&mut finished(dir.path(), epoch), None, None);
        if written {
            assert!(matches!(outcome, StoreOutcome::Stored(_)), "{outcome:?}");
        } else {
            assert_eq!(outcome, StoreOutcome::Outdated);
        }
        let files = walk(&dir.path().join("out"));
        assert_eq!(!files.is_empty(), written, "{files:?}");
        assert_eq!(!store.remembered().unwrap().is_empty(), written);
    }
}

#[test]
fn result_of_a_changed_file_is_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let store = store_in(dir.path());
    let mut job = finished(dir.path(), NOW);
    std::fs::write(&job.path, b"<OpenDRIVE> </OpenDRIVE>").unwrap();
    let outcome = store.store(&mut job, None, None);
    let unwritten = StoreOutcome::Stale {
        half_written: false,
    };
    assert_eq!(outcome, unwritten);
    assert!(walk(&dir.path().join("out")).is_empty());
}

/// Another connection locks the journal, so that no entry can be recorded.
#[test]
fn withdrawal_from_the_gate_needs_no_journal() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = store_in(dir.path());
    let gate = GateOptions {
        outputs: Outputs::default(),
        directory: dir.path().join("gate"),
        paths: store.places.clone(),
        durable: false,
        outside: Outside::default(),
        max_file: u64::MAX,
        probes: Probes::default(),
        is_judged: Box::new(|_| true),
        say: Box::new(|_| {}),
    };
    let gate = store.gate.insert(Gate::open(gate, "test").unwrap());
    let job = finished(dir.path(), NOW);
    let path = job.path.clone();
    gate.accept(&path, &accepted(&job)).unwrap();
    let published = walk(&dir.path().join("gate"));
    let published = published.iter().find(|it| it.ends_with("a.xodr")).unwrap();

    let journal = rusqlite::Connection::open(dir.path().join("state/journal.sqlite")).unwrap();
    journal.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let ((events, _events), (notices, mut told)) = (unbounded_channel(), unbounded_channel());
    let writers = Writers::start(1, &Arc::new(store), &events, &notices).unwrap();
    let name = "Nobody".to_owned();
    writers.order(&path, Order::Record(Entry::Struck { name }));
    writers.order(&path, Order::CloseGate { path: path.clone() });
    until(|| !published.exists());
    assert_eq!(writers.troubles().len(), 1);
    let said = format!("{:?}", told.try_recv());
    assert!(said.contains("it is retried"), "{said}");
    journal.execute_batch("ROLLBACK").unwrap();
    until(|| writers.troubles().is_empty());
    assert!(writers.finish(Duration::from_secs(60)).is_empty());
}

fn until(is_so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "watchdog timeout"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn accepted(job: &FinishedJob) -> Judged {
    let inputs = job.prepared.as_ref().unwrap().inputs.clone();
    Judged {
        job: job.job,
        verdict: Verdict::Accepted,
        own: Verdict::Accepted,
        own_errors: 0,
        rests_on: Some(Vec::new()),
        digest: inputs[0].digest().unwrap(),
        basis: Digest::default(),
        config: Digest::default(),
        required_set: Arc::default(),
        epoch: job.epoch,
        inputs,
        racy: false,
        counts: [0; 3],
        why: Vec::new(),
        xqar: None,
    }
}

fn walk(dir: &Path) -> Vec<std::path::PathBuf> {
    let Ok(entries) = std::fs::read_dir(dir) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .flat_map(|path| {
            if path.is_dir() {
                walk(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}
