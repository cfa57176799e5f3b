//! What is written when, and what is not.

use std::path::Path;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_formats::xqar::Dialect;
use qcbus_messages::{Digest, JobId};

use crate::core::{Epoch, FinishedJob, Input, Jury, PreparedJob, Reading, StoreOutcome};
use crate::journal::Journal;
use crate::result_paths::ResultPaths;
use crate::stamp::stamp_through_links;
use crate::store::{Store, digest_of};

const NOW: u64 = (3 << 32) + 5;

fn store_in(dir: &Path) -> Store {
    Store {
        scouts: crate::scouts::Scouts::default(),
        places: ResultPaths::of_watched(dir.join("out"), vec![dir.join("farm")]),
        dialect: Dialect::default(),
        durable: false,
        verdict_files: true,
        retries: true,
        gate: None,
        journal: Mutex::new(Journal::open(&dir.join("state"), "test").unwrap()),
        epoch: AtomicU64::new(NOW),
    }
}

/// A file that has been checked by a jury of this epoch.
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
        rejected_maps: Vec::new(),
        jury: Arc::new(Jury::default()),
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
fn what_has_changed_since_it_was_read_is_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let store = store_in(dir.path());
    let mut job = finished(dir.path(), NOW);
    std::fs::write(&job.path, b"<OpenDRIVE> </OpenDRIVE>").unwrap();
    let outcome = store.store(&mut job, None, None);
    assert_eq!(outcome, StoreOutcome::Stale);
    assert!(walk(&dir.path().join("out")).is_empty());
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
