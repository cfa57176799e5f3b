//! How entries become rows.

use std::path::Path;

use qcbus_messages::path_text::to_text as text;
use rusqlite::{Transaction, params};

use super::rows::{inputs_to_text, jury_to_text, millis, signed};
use super::{Entry, History};
use crate::core::{Judged, Member, Reported};
use qcbus_disk::FileMark;

pub(super) fn put(transaction: &Transaction<'_>, entry: &Entry) -> rusqlite::Result<()> {
    match entry {
        Entry::Judged {
            path,
            judged,
            history,
            written,
        } => {
            put_file(transaction, path, judged, written.as_ref())?;
            if let Some(history) = history {
                put_history(transaction, path, judged, history)?;
            }
        }
        Entry::Withdrawn { path, reporters } => withdraw(transaction, &text(path), reporters)?,
        Entry::Left {
            path,
            xqar,
            reporters,
        } => {
            for reporter in reporters {
                put_gone(transaction, &text(path), &text(xqar), reporter)?;
            }
        }
        Entry::Voided { path, reporter } => voided(transaction, &text(path), reporter)?,
        Entry::Enrolled(member) => put_member(transaction, member)?,
        Entry::Struck { name } => {
            transaction.execute("DELETE FROM members WHERE name = ?1", params![name])?;
        }
        Entry::Delivered {
            path,
            reporter,
            job,
        } => {
            deliver(transaction, &text(path), reporter, Reported::Of(*job))?;
        }
    }
    Ok(())
}

/// The file has gone, and with it all but where its result lay, for those who reported about it.
fn withdraw(
    transaction: &Transaction<'_>,
    path: &str,
    reporters: &[String],
) -> rusqlite::Result<()> {
    if !reporters.is_empty() {
        transaction.execute(
            "INSERT OR REPLACE INTO gone (path, xqar) \
             SELECT path, xqar FROM files WHERE path = ?1",
            params![path],
        )?;
    }
    transaction.execute("DELETE FROM files WHERE path = ?1", params![path])?;
    transaction.execute("DELETE FROM deliveries WHERE path = ?1", params![path])?;
    for reporter in reporters {
        deliver(transaction, path, reporter, Reported::OfGone)?;
    }
    Ok(())
}

fn put_gone(
    transaction: &Transaction<'_>,
    path: &str,
    xqar: &str,
    reporter: &str,
) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT OR REPLACE INTO gone (path, xqar) VALUES (?1, ?2)",
        params![path, xqar],
    )?;
    deliver(transaction, path, reporter, Reported::OfGone)
}

/// A reporter has taken back what it said. Once all have, nobody asks where the result lay.
fn voided(transaction: &Transaction<'_>, path: &str, reporter: &str) -> rusqlite::Result<()> {
    transaction.execute(
        "DELETE FROM deliveries WHERE path = ?1 AND reporter = ?2 AND job IS NULL",
        params![path, reporter],
    )?;
    transaction.execute(
        "DELETE FROM gone WHERE path = ?1 AND path NOT IN \
         (SELECT path FROM deliveries WHERE path = ?1 AND job IS NULL)",
        params![path],
    )?;
    Ok(())
}

fn deliver(
    transaction: &Transaction<'_>,
    path: &str,
    reporter: &str,
    reported: Reported,
) -> rusqlite::Result<()> {
    let mut statement = transaction.prepare_cached(
        "INSERT OR REPLACE INTO deliveries (path, reporter, job) VALUES (?1, ?2, ?3)",
    )?;
    let job = match reported {
        Reported::Of(job) => Some(signed(job.0)),
        Reported::OfGone => None,
    };
    statement.execute(params![path, reporter, job]).map(|_| ())
}

fn put_file(
    transaction: &Transaction<'_>,
    path: &Path,
    judged: &Judged,
    written: Option<&FileMark>,
) -> rusqlite::Result<()> {
    // Whoever writes no verdict file leaves the mark of the one that is there.
    let mut statement = transaction.prepare_cached(
        "INSERT OR REPLACE INTO files (path, job, verdict, digest, basis, config, jury, errors, \
         warnings, information, why, xqar, inputs, racy, at, epoch, written) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, \
         coalesce(?17, (SELECT written FROM files WHERE path = ?1), ''))",
    )?;
    statement.execute(params![
        text(path),
        signed(judged.job.0),
        judged.verdict.as_str(),
        judged.digest.to_string(),
        judged.basis.to_string(),
        judged.config.to_string(),
        jury_to_text(&judged.jury),
        signed(judged.counts[0]),
        signed(judged.counts[1]),
        signed(judged.counts[2]),
        serde_json::to_string(&judged.why).unwrap_or_default(),
        judged.xqar.as_deref().map(text).unwrap_or_default(),
        inputs_to_text(&judged.inputs),
        judged.racy,
        millis(),
        signed(judged.epoch.0),
        written.map(|it| &it.0),
    ])?;
    Ok(())
}

fn put_member(transaction: &Transaction<'_>, member: &Member) -> rusqlite::Result<()> {
    let catalogue = serde_json::to_string(&member.catalogue.as_deref()).unwrap_or_default();
    transaction.execute(
        "INSERT OR REPLACE INTO members (name, version, origin, catalogue, at) \
         VALUES (?1, ?2, ?3, ?4, ?5)",
        params![
            member.name,
            member.version,
            member.origin.as_str(),
            catalogue,
            millis()
        ],
    )?;
    Ok(())
}

fn put_history(
    transaction: &Transaction<'_>,
    path: &Path,
    judged: &Judged,
    history: &History,
) -> rusqlite::Result<()> {
    let job = signed(judged.job.0);
    let mut statement = transaction.prepare_cached(
        "INSERT OR REPLACE INTO jobs (job, path, digest, config, verdict, errors, warnings, \
         information, bytes, micros, at) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)",
    )?;
    statement.execute(params![
        job,
        text(path),
        judged.digest.to_string(),
        judged.config.to_string(),
        judged.verdict.as_str(),
        signed(judged.counts[0]),
        signed(judged.counts[1]),
        signed(judged.counts[2]),
        signed(history.bytes),
        signed(history.micros),
        millis(),
    ])?;
    let mut bundles = transaction
        .prepare_cached("INSERT OR REPLACE INTO job_bundles VALUES (?1, ?2, ?3, ?4, ?5)")?;
    for (bundle, version, micros, failure) in &history.bundles {
        bundles.execute(params![job, bundle, version, signed(*micros), failure])?;
    }
    let mut checkers = transaction
        .prepare_cached("INSERT OR REPLACE INTO job_checkers VALUES (?1, ?2, ?3, ?4, ?5)")?;
    for (bundle, checker, status, issues) in &history.checkers {
        checkers.execute(params![job, bundle, checker, status, signed(*issues)])?;
    }
    Ok(())
}
