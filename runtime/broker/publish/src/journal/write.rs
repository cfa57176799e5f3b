//! Conversion of entries to rows. As much as possible is prepared without the journal, because
//! every writer waits for its lock.

use std::path::Path;

use qcbus_disk::FileFingerprint;
use qcbus_messages::path_text::to_text as text;
use qcbus_types::{Judged, Member, Reported, digest_of};
use rusqlite::types::Value;
use rusqlite::{Transaction, params_from_iter};

use super::rows::{inputs_to_text, millis, required_set_to_text, rests_on_to_text, signed};
use super::{Entry, History};

/// A statement with its values.
#[derive(Debug)]
pub(super) struct Change {
    sql: &'static str,
    values: Vec<Value>,
    /// Number of the list that the statement inserts. Usually the list already exists.
    pub list: Option<i64>,
}

impl Change {
    fn new(sql: &'static str, values: impl Into<Vec<Value>>) -> Change {
        Change {
            sql,
            values: values.into(),
            list: None,
        }
    }

    pub fn make(&self, transaction: &Transaction<'_>) -> rusqlite::Result<()> {
        let mut statement = transaction.prepare_cached(self.sql)?;
        statement
            .execute(params_from_iter(&self.values))
            .map(|_| ())
    }
}

/// Returns the statements for an entry, in order.
pub(super) fn changes(entry: &Entry) -> Vec<Change> {
    let mut changes = Vec::new();
    match entry {
        Entry::Judged {
            path,
            judged,
            history,
            written,
        } => {
            changes.push(file(path, judged, written.as_ref()));
            if let Some(history) = history {
                put_history(&mut changes, path, judged, history);
            }
        }
        Entry::Withdrawn { path, reporters } => withdraw(&mut changes, &text(path), reporters),
        Entry::Left {
            path,
            xqar,
            reporters,
        } => {
            let (path, xqar) = (text(path), text(xqar));
            for reporter in reporters {
                let gone = "INSERT OR REPLACE INTO gone (path, xqar) VALUES (?1, ?2)";
                changes.push(Change::new(gone, [word(&path), word(&xqar)]));
                changes.push(delivery(&path, reporter, Reported::OfGone));
            }
        }
        Entry::Voided { path, reporter } => voided(&mut changes, &text(path), reporter),
        Entry::Enrolled(it) => changes.push(member(it)),
        Entry::Struck { name } => {
            let struck = "DELETE FROM members WHERE name = ?1";
            changes.push(Change::new(struck, [word(name)]));
        }
        Entry::Delivered {
            path,
            reporter,
            job,
        } => changes.push(delivery(&text(path), reporter, Reported::Of(*job))),
    }
    changes
}

fn word(text: &str) -> Value {
    Value::Text(text.to_owned())
}

fn count(number: u64) -> Value {
    Value::Integer(signed(number))
}

/// Removes a file from the journal. The path of its result stays for the reporters that reported about it.
fn withdraw(changes: &mut Vec<Change>, path: &str, reporters: &[String]) {
    let mut of_path = |sql| changes.push(Change::new(sql, [word(path)]));
    if !reporters.is_empty() {
        of_path(
            "INSERT OR REPLACE INTO gone (path, xqar) \
             SELECT path, xqar FROM files WHERE path = ?1",
        );
    }
    of_path("DELETE FROM files WHERE path = ?1");
    of_path("DELETE FROM deliveries WHERE path = ?1");
    for reporter in reporters {
        changes.push(delivery(path, reporter, Reported::OfGone));
    }
}

/// Records that a reporter has withdrawn its report. After the last one, the path of the result is deleted.
fn voided(changes: &mut Vec<Change>, path: &str, reporter: &str) {
    changes.push(Change::new(
        "DELETE FROM deliveries WHERE path = ?1 AND reporter = ?2 AND job IS NULL",
        [word(path), word(reporter)],
    ));
    changes.push(Change::new(
        "DELETE FROM gone WHERE path = ?1 AND path NOT IN \
         (SELECT path FROM deliveries WHERE path = ?1 AND job IS NULL)",
        [word(path)],
    ));
}

fn delivery(path: &str, reporter: &str, reported: Reported) -> Change {
    let job = match reported {
        Reported::Of(job) => count(job.0),
        Reported::OfGone => Value::Null,
    };
    Change::new(
        "INSERT OR REPLACE INTO deliveries (path, reporter, job) VALUES (?1, ?2, ?3)",
        [word(path), word(reporter), job],
    )
}

fn file(path: &Path, judged: &Judged, written: Option<&FileFingerprint>) -> Change {
    // If no verdict file is written, the fingerprint of the existing one stays.
    let sql = "INSERT OR REPLACE INTO files (path, job, verdict, digest, basis, config, required_set, errors, \
         warnings, information, why, xqar, inputs, racy, at, epoch, own, own_errors, rests_on, written) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, \
         coalesce(?20, (SELECT written FROM files WHERE path = ?1), ''))";
    let values = [
        Value::Text(text(path)),
        count(judged.job.0),
        word(judged.verdict.as_str()),
        Value::Text(judged.digest.to_string()),
        Value::Text(judged.basis.to_string()),
        Value::Text(judged.config.to_string()),
        Value::Text(required_set_to_text(&judged.required_set)),
        count(judged.counts[0]),
        count(judged.counts[1]),
        count(judged.counts[2]),
        Value::Text(serde_json::to_string(&judged.why).unwrap_or_default()),
        Value::Text(judged.xqar.as_deref().map(text).unwrap_or_default()),
        Value::Text(inputs_to_text(&judged.inputs)),
        Value::Integer(judged.racy.into()),
        Value::Integer(millis()),
        count(judged.epoch.0),
        word(judged.own.as_str()),
        count(judged.own_errors),
        Value::Text(rests_on_to_text(judged.rests_on.as_deref())),
        written.map_or(Value::Null, |it| word(&it.to_string())),
    ];
    Change::new(sql, values)
}

fn member(member: &Member) -> Change {
    let catalogue = serde_json::to_string(&member.catalogue.as_deref()).unwrap_or_default();
    Change::new(
        "INSERT OR REPLACE INTO members (name, version, origin, catalogue, at) \
         VALUES (?1, ?2, ?3, ?4, ?5)",
        [
            word(&member.name),
            word(&member.version),
            word(member.origin.as_str()),
            Value::Text(catalogue),
            Value::Integer(millis()),
        ],
    )
}

fn put_history(changes: &mut Vec<Change>, path: &Path, judged: &Judged, history: &History) {
    let job = || count(judged.job.0);
    let sql = "INSERT OR REPLACE INTO jobs (job, path, digest, config, verdict, errors, warnings, \
               information, bytes, micros, at) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)";
    let values = [
        job(),
        Value::Text(text(path)),
        Value::Text(judged.digest.to_string()),
        Value::Text(judged.config.to_string()),
        word(judged.verdict.as_str()),
        count(judged.counts[0]),
        count(judged.counts[1]),
        count(judged.counts[2]),
        count(history.bytes),
        count(history.micros),
        Value::Integer(millis()),
    ];
    changes.push(Change::new(sql, values));
    for (bundle, version, micros, failure) in &history.bundles {
        let sql = "INSERT OR REPLACE INTO job_bundles VALUES (?1, ?2, ?3, ?4, ?5)";
        let values = [
            job(),
            word(bundle),
            word(version),
            count(*micros),
            word(failure),
        ];
        changes.push(Change::new(sql, values));
    }
    for (bundle, checker, status, issues) in &history.checkers {
        let sql = "INSERT OR REPLACE INTO job_findings VALUES (?1, ?2, ?3, ?4, ?5)";
        let values = [
            job(),
            word(bundle),
            word(checker),
            word(status),
            count(*issues),
        ];
        changes.push(Change::new(sql, values));
    }
    for (bundle, checkers) in &history.skipped {
        let list = serde_json::to_string(checkers).unwrap_or_default();
        let number = number_of(&list);
        changes.push(Change {
            list: Some(number),
            ..Change::new(
                "INSERT OR IGNORE INTO checker_lists VALUES (?1, ?2)",
                [Value::Integer(number), Value::Text(list)],
            )
        });
        let sql = "INSERT OR REPLACE INTO job_skipped VALUES (?1, ?2, ?3)";
        let values = [job(), word(bundle), Value::Integer(number)];
        changes.push(Change::new(sql, values));
    }
}

/// Returns the number of a list. It is derived from the contents, so no lookup is needed.
fn number_of(list: &str) -> i64 {
    let digest = digest_of(list.as_bytes());
    let first = digest.0.iter().take(8);
    first.fold(0, |number, byte| number << 8 | i64::from(*byte))
}
