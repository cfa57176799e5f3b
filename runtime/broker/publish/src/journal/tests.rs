//! The journal remembers written entries, including those of earlier schemas.

mod history;

use std::sync::Arc;

use qcbus_messages::{Catalogue, Digest, Verdict};
use qcbus_types::{Epoch, Input, Reading, RequiredBundle, RequiredSet, Stamp, VersionDigest};

use super::*;

fn judged(job: u64) -> Judged {
    Judged {
        job: JobId(job),
        verdict: Verdict::Undetermined,
        own: Verdict::Undetermined,
        own_errors: 0,
        rests_on: Some(Vec::new()),
        digest: Digest([1; 32]),
        basis: Digest([2; 32]),
        config: Digest([3; 32]),
        required_set: Arc::new(RequiredSet(vec![
            RequiredBundle {
                name: "mine".to_owned(),
                version_digest: None,
            },
            RequiredBundle {
                name: "xodrBundle".to_owned(),
                version_digest: Some(VersionDigest(u64::MAX)),
            },
        ])),
        epoch: Epoch(1 << 40),
        inputs: vec![
            Input {
                path: Path::new("/a.xosc").into(),
                content: Reading::Read(
                    Stamp {
                        size: 1,
                        mtime_ns: -(1 << 70),
                        ctime_ns: 1 << 71,
                        inode: 3,
                    },
                    Digest([1; 32]),
                ),
            },
            Input {
                path: Path::new("/a.xodr").into(),
                content: Reading::Absent,
            },
        ],
        racy: true,
        counts: [1, 2, 3],
        why: vec!["xodrBundle: it died".to_owned()],
        xqar: Some(PathBuf::from("/out/a.xosc.xqar")),
    }
}

#[test]
fn written_entries_are_remembered() {
    let dir = tempfile::tempdir().unwrap();
    let path: Arc<Path> = Path::new("/a.xosc").into();
    let expected = Arc::new(judged(5));
    {
        let mut journal = Journal::open(dir.path(), "test").unwrap();
        let history = Some(Box::new(History::default()));
        journal
            .write(&[
                Entry::Judged {
                    path: path.clone(),
                    judged: expected.clone(),
                    history,
                    written: Some(FileFingerprint::parse("7 8 9").unwrap()),
                },
                // The second entry only brings fresh stamps.
                Entry::Judged {
                    path: path.clone(),
                    judged: expected.clone(),
                    history: None,
                    written: None,
                },
                Entry::Delivered {
                    path: path.clone(),
                    reporter: "json".into(),
                    job: JobId(5),
                },
            ])
            .unwrap();
    }
    let mut journal = Journal::open(dir.path(), "test").unwrap();
    let all = journal.remembered().unwrap();
    assert_eq!(all.len(), 1);
    assert_eq!(all[0].judged, *expected);
    assert_eq!(all[0].written, FileFingerprint::parse("7 8 9"));
    let json = ("json".to_owned(), Reported::Of(JobId(5)));
    assert_eq!(all[0].delivered, [json]);
    let reporters = vec!["json".to_owned(), "text".to_owned()];
    let gone = path.clone();
    journal
        .write(&[Entry::Withdrawn {
            path: gone,
            reporters,
        }])
        .unwrap();
    assert!(journal.remembered().unwrap().is_empty());
    let void = |reporter: &str| Void {
        path: path.clone(),
        reporter: reporter.to_owned(),
        xqar: Some("/out/a.xosc.xqar".into()),
    };
    let (json, text) = (void("json"), void("text"));
    assert_eq!(journal.voids().unwrap(), [json, text.clone()]);
    let reporter = "json".to_owned();
    let path = path.clone();
    journal.write(&[Entry::Voided { path, reporter }]).unwrap();
    assert_eq!(journal.voids().unwrap(), [text]);
    assert_eq!(Journal::examine(dir.path()), None);
}

#[test]
fn journal_of_schema_1_opens_with_stale_stamps() {
    let dir = tempfile::tempdir().unwrap();
    let path: Arc<Path> = Path::new("/a.xosc").into();
    let written = judged(5);
    let mut journal = Journal::open(dir.path(), "default").unwrap();
    journal
        .write(&[Entry::Judged {
            path,
            judged: Arc::new(written.clone()),
            history: None,
            written: None,
        }])
        .unwrap();
    let digest = Digest([1; 32]);
    let inputs = format!("[[\"/a.xosc\",[1,7,3,\"{digest}\"]],[\"/a.xodr\",null]]");
    journal
        .connection
        .execute("UPDATE files SET inputs = ?1", params![inputs])
        .unwrap();
    journal
        .connection
        .execute_batch(
            "DROP VIEW job_checkers; DROP TABLE job_skipped; DROP TABLE checker_lists; \
             ALTER TABLE job_findings RENAME TO job_checkers; \
             ALTER TABLE files RENAME COLUMN required_set TO bundles; \
             ALTER TABLE files DROP COLUMN epoch; ALTER TABLE files DROP COLUMN written; \
             ALTER TABLE files DROP COLUMN own; ALTER TABLE files DROP COLUMN own_errors; \
             ALTER TABLE files DROP COLUMN rests_on; \
             UPDATE files SET bundles = 'ffffffffffffffff'; \
             INSERT INTO deliveries VALUES ('/a.xosc', 'json', 5), ('/a.xosc', 'text', 0); \
             PRAGMA user_version = 1",
        )
        .unwrap();
    drop(journal);
    let all = Journal::open(dir.path(), "default")
        .unwrap()
        .remembered()
        .unwrap();
    assert_eq!(all.len(), 1);
    let (stamp, known) = all[0].judged.inputs[0].content.read().unwrap();
    assert_eq!((stamp.size, stamp.mtime_ns, stamp.inode), (1, 7, 3));
    assert_eq!(stamp.ctime_ns, 0);
    assert_eq!(known, digest);
    assert_eq!(all[0].judged.inputs[1], written.inputs[1]);
    assert_eq!(all[0].judged.basis, written.basis);
    assert_eq!(*all[0].judged.required_set, RequiredSet::unknown());
    assert_eq!(all[0].written, None);
    let json = ("json".to_owned(), Reported::Of(JobId(5)));
    let text = ("text".to_owned(), Reported::OfGone);
    assert_eq!(all[0].delivered, [json, text]);
}

#[test]
fn unread_inputs_and_missing_results_are_remembered() {
    let path: Arc<Path> = Path::new("/a.xosc").into();
    let mut expected = judged(5);
    expected.xqar = None;
    let stamp = expected.inputs[0].content.stamp().unwrap();
    expected.inputs[1].content = Reading::Unread(stamp);
    let entry = |judged: Judged| Entry::Judged {
        path: path.clone(),
        judged: Arc::new(judged),
        history: None,
        written: None,
    };
    let mut journal = Journal::in_memory().unwrap();
    journal.write(&[entry(expected.clone())]).unwrap();
    assert_eq!(journal.remembered().unwrap()[0].judged, expected);
    // The file disappears and is back before its report was withdrawn.
    let gone = Entry::Withdrawn {
        path: path.clone(),
        reporters: vec!["text".to_owned()],
    };
    journal.write(&[gone]).unwrap();
    assert_eq!(journal.voids().unwrap()[0].xqar, None);
    journal.write(&[entry(expected)]).unwrap();
    let text = ("text".to_owned(), Reported::OfGone);
    assert_eq!(journal.remembered().unwrap()[0].delivered, [text]);
    // Earlier schemas wrote inputs in this form.
    let zeros = Digest([0; 32]);
    let inputs = format!("[[\"/a.xosc\",[1,7,3,\"{zeros}\",9]]]");
    let update = "UPDATE files SET inputs = ?1";
    journal.connection.execute(update, params![inputs]).unwrap();
    let read = journal.remembered().unwrap()[0].judged.inputs[0].content;
    assert!(matches!(read, Reading::Unread(_)), "{read:?}");
}

#[test]
fn required_bundle_is_remembered_until_removed() {
    let dir = tempfile::tempdir().unwrap();
    let catalogue = Catalogue {
        alias: "mine".to_owned(),
        kinds: vec![qcbus_document::FileKind::Xodr],
        ..Catalogue::default()
    };
    let member = |version: &str| Member {
        name: "mine".to_owned(),
        version: version.to_owned(),
        catalogue: Some(Arc::new(catalogue.clone())),
        origin: Origin::Joined,
    };
    let mut journal = Journal::open(dir.path(), "test").unwrap();
    journal.write(&[Entry::Enrolled(member("1"))]).unwrap();
    journal.write(&[Entry::Enrolled(member("2"))]).unwrap();
    drop(journal);
    let mut journal = Journal::open(dir.path(), "test").unwrap();
    assert_eq!(journal.members().unwrap(), [member("2")]);
    // Another version of qcbus may have written this catalogue. The bundle stays required anyway.
    let spoilt = "UPDATE members SET catalogue = '{\"kinds\": 7}'";
    journal.connection.execute_batch(spoilt).unwrap();
    assert_eq!(journal.members().unwrap()[0].catalogue, None);
    let name = "mine".to_owned();
    journal.write(&[Entry::Struck { name }]).unwrap();
    assert_eq!(journal.members().unwrap(), []);
}

#[test]
fn broken_journal_is_reported_with_remedy() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("journal.sqlite"),
        "this is no database at all, is it?",
    )
    .unwrap();
    let error = Journal::open(dir.path(), "test").unwrap_err().to_string();
    assert!(error.contains("Move it away"), "{error}");
    assert!(Journal::examine(dir.path()).is_some());
}

#[test]
fn journal_of_newer_schema_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    drop(Journal::open(dir.path(), "test").unwrap());
    let connection = Connection::open(dir.path().join("journal.sqlite")).unwrap();
    connection
        .execute_batch("PRAGMA user_version = 99")
        .unwrap();
    drop(connection);
    assert!(matches!(
        Journal::open(dir.path(), "test"),
        Err(JournalError::Newer { found: 99, .. })
    ));
}
