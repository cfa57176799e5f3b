//! The history of jobs, and concurrent writes of several threads.

use super::*;

fn with_history(job: u64, history: History) -> Entry {
    Entry::Judged {
        path: Path::new("/a.xosc").into(),
        judged: Arc::new(judged(job)),
        history: Some(Box::new(history)),
        written: None,
    }
}

fn history_of(skipped: &[&str]) -> History {
    let finding = |checker: &str, status: &str, issues| {
        let bundle = "xodrBundle".to_owned();
        (bundle, checker.to_owned(), status.to_owned(), issues)
    };
    let skipped = skipped.iter().map(|id| Text::from(*id)).collect();
    History {
        checkers: vec![
            finding("broke", "error", 0),
            finding("found", "completed", 3),
        ],
        skipped: vec![("xodrBundle".to_owned(), skipped)],
        ..History::default()
    }
}

fn checkers_of(journal: &Journal, job: i64) -> Vec<(String, String, i64)> {
    let all = "SELECT checker, status, issues FROM job_checkers WHERE job = ?1 ORDER BY checker";
    let mut query = journal.connection.prepare(all).unwrap();
    let rows = query.query_map([job], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)));
    rows.unwrap().map(Result::unwrap).collect()
}

fn lists(journal: &Journal) -> i64 {
    let count = "SELECT count(*) FROM checker_lists";
    let count = journal.connection.query_row(count, [], |row| row.get(0));
    count.unwrap()
}

#[test]
fn list_of_skipped_checkers_is_stored_once() {
    let mut journal = Journal::in_memory().unwrap();
    for (job, skipped) in [
        (1, ["new", "old"]),
        (2, ["new", "old"]),
        (3, ["old", "other"]),
    ] {
        let entry = with_history(job, history_of(&skipped));
        journal.write(&[entry]).unwrap();
    }
    assert_eq!(lists(&journal), 2);
    for job in [1, 2] {
        let expected = [("broke", "error", 0), ("found", "completed", 3)];
        let expected = [
            &expected[..],
            &[("new", "skipped", 0), ("old", "skipped", 0)],
        ]
        .concat();
        let expected = expected
            .into_iter()
            .map(|(a, b, c)| (a.to_owned(), b.to_owned(), c));
        assert_eq!(checkers_of(&journal, job), expected.collect::<Vec<_>>());
    }
    // A checker list that no job uses any more is removed with its last job. The next job writes it again.
    let old = "UPDATE jobs SET at = 0 WHERE job < 3";
    journal.connection.execute(old, []).unwrap();
    assert_eq!(journal.prune(Duration::from_secs(60)).unwrap(), 2);
    assert_eq!(lists(&journal), 1);
    assert_eq!(checkers_of(&journal, 1), []);
    let entry = with_history(4, history_of(&["new", "old"]));
    journal.write(&[entry]).unwrap();
    assert_eq!(checkers_of(&journal, 4).len(), 4);
}

#[test]
fn checker_list_counts_as_written_only_with_its_job() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), "test").unwrap();
    let refuse = |journal: &Journal, sql: &str| journal.connection.execute_batch(sql).unwrap();
    // Another connection, for example, may cause such a failure.
    refuse(
        &journal,
        "CREATE TRIGGER no BEFORE INSERT ON job_skipped BEGIN SELECT RAISE(ABORT, 'no'); END",
    );
    let entry = with_history(1, history_of(&["old"]));
    journal.write(std::slice::from_ref(&entry)).unwrap_err();
    assert!(
        journal.remembered().unwrap().is_empty(),
        "either everything is written or nothing"
    );
    refuse(&journal, "DROP TRIGGER no");
    journal.write(&[entry]).unwrap();
    assert_eq!(checkers_of(&journal, 1).len(), 3);
}

#[test]
fn history_of_schema_3_is_kept() {
    let dir = tempfile::tempdir().unwrap();
    let journal = Journal::open(dir.path(), "test").unwrap();
    journal
        .connection
        .execute_batch(
            "DROP VIEW job_checkers; DROP TABLE job_skipped; DROP TABLE checker_lists; \
             ALTER TABLE job_findings RENAME TO job_checkers; \
             ALTER TABLE files DROP COLUMN own; ALTER TABLE files DROP COLUMN own_errors; \
             ALTER TABLE files DROP COLUMN rests_on; \
             ALTER TABLE files RENAME COLUMN required_set TO jury; \
             INSERT INTO jobs VALUES (7, '/a', '', '', 'accepted', 0, 0, 0, 1, 1, 1); \
             INSERT INTO job_checkers VALUES (7, 'xodrBundle', 'old', 'skipped', 0); \
             PRAGMA user_version = 3",
        )
        .unwrap();
    drop(journal);
    let mut journal = Journal::open(dir.path(), "test").unwrap();
    let skipped = ("old".to_owned(), "skipped".to_owned(), 0);
    assert_eq!(checkers_of(&journal, 7), [skipped]);
    assert_eq!(journal.prune(Duration::from_secs(60)).unwrap(), 1);
    assert_eq!(
        checkers_of(&journal, 7),
        [],
        "removed together with its job"
    );
}

#[test]
fn verdicts_of_schema_5_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), "test").unwrap();
    let entry = with_history(7, history_of(&["old"]));
    journal.write(&[entry]).unwrap();
    let before = journal.remembered().unwrap();
    journal
        .connection
        .execute_batch(
            "ALTER TABLE files RENAME COLUMN required_set TO jury; PRAGMA user_version = 5",
        )
        .unwrap();
    drop(journal);
    let journal = Journal::open(dir.path(), "test").unwrap();
    assert_eq!(journal.remembered().unwrap(), before);
}

#[test]
fn waiting_entries_are_written_together_and_fail_alone() {
    let journal = Journal::in_memory().unwrap();
    journal
        .connection
        .execute_batch(
            "CREATE TRIGGER no BEFORE INSERT ON members BEGIN SELECT RAISE(ABORT, 'no'); END",
        )
        .unwrap();
    let shared = SharedJournal::from(journal);
    let delivered = |reporter: &str| Entry::Delivered {
        path: Path::new("/a.xosc").into(),
        reporter: reporter.to_owned(),
        job: JobId(5),
    };
    let spoilt = Entry::Enrolled(Member {
        name: "mine".to_owned(),
        version: String::new(),
        catalogue: None,
        origin: Origin::Joined,
    });
    let known = || -> i64 {
        let count = "SELECT count(*) FROM deliveries";
        let journal = shared.get();
        let count = journal.connection.query_row(count, [], |row| row.get(0));
        count.unwrap()
    };
    let first = shared.note(&[delivered("json")]);
    let bad = shared.note(&[delivered("half"), spoilt]);
    let last = shared.note(&[delivered("text")]);
    assert_eq!(known(), 0, "nothing is written before `settle`");
    shared.settle(&last).unwrap();
    assert_eq!(
        known(),
        2,
        "everything pending is written, except the invalid delivery"
    );
    assert!(shared.settle(&bad).is_err());
    assert_eq!(known(), 2);
    shared.settle(&first).unwrap();
}

#[test]
fn concurrent_entries_are_written_before_confirmation() {
    let dir = tempfile::tempdir().unwrap();
    let shared = SharedJournal::from(Journal::open(dir.path(), "test").unwrap());
    let names = Connection::open(dir.path().join("journal.sqlite")).unwrap();
    let names = std::sync::Mutex::new(names);
    let (shared, names) = (&shared, &names);
    std::thread::scope(|scope| {
        for thread in 0..8 {
            scope.spawn(move || {
                for number in 0..20 {
                    let reporter = format!("{thread} {number}");
                    let entry = Entry::Delivered {
                        path: Path::new("/a.xosc").into(),
                        reporter: reporter.clone(),
                        job: JobId(number),
                    };
                    let noted = shared.note(&[entry]);
                    shared.settle(&noted).unwrap();
                    let there = "SELECT job FROM deliveries WHERE reporter = ?1";
                    let names = names.lock().unwrap();
                    let job = names.query_row(there, [reporter], |row| row.get(0));
                    assert_eq!(job, Ok(i64::try_from(number).unwrap()));
                }
            });
        }
    });
}
