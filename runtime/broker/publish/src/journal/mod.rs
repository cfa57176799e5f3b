//! The journal: the data that must survive the broker, in SQLite. The schema is in `journal.sql`.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_disk::{FileFingerprint, trust};
use qcbus_formats::Text;
use qcbus_messages::JobId;
use qcbus_messages::path_text::from_text;
use qcbus_types::{Judged, Member, Origin, Reported};
use rusqlite::{Connection, OpenFlags, params};

use crate::directory_lock::{DirectoryLock, Purpose};

mod error;
mod rows;
mod schema;
mod shared;
#[cfg(test)]
mod tests;
mod write;

pub use error::JournalError;
pub use shared::SharedJournal;

use error::classify;
use rows::{judged_of, millis, number};
use schema::prepare;
use write::{Change, changes};

/// Version of the schema, stored in SQLite's `user_version`.
pub const SCHEMA_VERSION: i64 = 6;

/// A file with its verdict, as stored in the journal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remembered {
    /// Absolute path.
    pub path: Arc<Path>,
    /// The verdict and the inputs that it depends on.
    pub judged: Judged,
    /// Fingerprint of the verdict file when it was written, if known.
    pub written: Option<FileFingerprint>,
    /// Reporters that have sent a report about the file.
    pub delivered: Vec<(String, Reported)>,
}

/// A removed file, with a reporter that must still withdraw its report about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Void {
    /// Absolute path of the file.
    pub path: Arc<Path>,
    /// The reporter.
    pub reporter: String,
    /// Path of the result, if known.
    pub xqar: Option<PathBuf>,
}

/// Statistics of one job for the history.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct History {
    /// Size of the sources in bytes.
    pub bytes: u64,
    /// Microseconds from queueing to the stored result.
    pub micros: u64,
    /// For each bundle: name, version, microseconds, failure.
    pub bundles: Vec<(String, String, u64, String)>,
    /// For each checker that failed or has findings: bundle, checker, status, number of issues.
    pub checkers: Vec<(String, String, String, u64)>,
    /// For each bundle: the skipped checkers.
    pub skipped: Vec<(String, Vec<Text>)>,
}

/// An entry of the journal.
#[derive(Debug)]
pub enum Entry {
    /// A verdict.
    Judged {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
        /// Statistics of the job. `None` if the verdict only got new stamps.
        history: Option<Box<History>>,
        /// Fingerprint of the verdict file. `None` if no verdict file was written now.
        written: Option<FileFingerprint>,
    },
    /// A file was removed.
    Withdrawn {
        /// The file.
        path: Arc<Path>,
        /// Reporters that must withdraw a report about it.
        reporters: Vec<String>,
    },
    /// A result without an entry in the journal was withdrawn.
    Left {
        /// The file.
        path: Arc<Path>,
        /// Path of the result.
        xqar: PathBuf,
        /// Reporters that must withdraw a report about it.
        reporters: Vec<String>,
    },
    /// A reporter has withdrawn its report about a removed file.
    Voided {
        /// The file.
        path: Arc<Path>,
        /// The reporter.
        reporter: String,
    },
    /// A bundle is required from now on.
    Enrolled(Member),
    /// A bundle is no longer required.
    Struck {
        /// Name of the bundle.
        name: String,
    },
    /// A reporter has received a result.
    Delivered {
        /// The file.
        path: Arc<Path>,
        /// The reporter.
        reporter: String,
        /// The job.
        job: JobId,
    },
}

/// The open journal.
#[derive(Debug)]
pub struct Journal {
    connection: Connection,
    path: PathBuf,
    /// Lists of checkers that are certainly stored.
    lists: HashSet<i64>,
    /// Lock of the state directory, held while the journal is open.
    lock: Option<Arc<DirectoryLock>>,
}

impl Journal {
    /// Opens or creates the journal in a state directory. The directory belongs to this instance
    /// alone while the journal is open.
    ///
    /// # Errors
    /// See [`JournalError`]. Each error names a fix.
    pub fn open(state: &Path, instance: &str) -> Result<Journal, JournalError> {
        trust::make_directory(state)?;
        let path = state.join("journal.sqlite");
        // Another user may have created these files while the directory was still writable for others.
        for name in [
            "lock",
            "journal.sqlite",
            "journal.sqlite-wal",
            "journal.sqlite-shm",
        ] {
            match trust::look_at_file(&state.join(name)) {
                Err(error) if !error.is_absent() => return Err(error.into()),
                _ => {}
            }
        }
        let lock = DirectoryLock::take(state, Purpose::State, instance)?;
        let fail = |source| classify(&path, source);
        let connection = Connection::open(&path).map_err(fail)?;
        connection
            .busy_timeout(Duration::from_secs(5))
            .map_err(fail)?;
        prepare(&connection, &path)?;
        Ok(Journal {
            connection,
            path,
            lists: HashSet::new(),
            lock: Some(Arc::new(lock)),
        })
    }

    /// Returns the lock of the state directory.
    pub fn lock(&self) -> Option<Arc<DirectoryLock>> {
        self.lock.clone()
    }

    /// Opens a journal in memory, for a test.
    ///
    /// # Errors
    /// When SQLite cannot open a database in memory.
    #[cfg(test)]
    pub fn in_memory() -> Result<Journal, JournalError> {
        let path = PathBuf::from(":memory:");
        let connection = Connection::open_in_memory().map_err(|source| classify(&path, source))?;
        prepare(&connection, &path)?;
        Ok(Journal {
            connection,
            path,
            lists: HashSet::new(),
            lock: None,
        })
    }

    /// Checks a journal without changing it. Returns `None` if it is sound, otherwise the problem.
    pub fn examine(state: &Path) -> Option<String> {
        let path = state.join("journal.sqlite");
        if !path.exists() {
            return None;
        }
        let check = || -> rusqlite::Result<String> {
            let connection = Connection::open_with_flags(&path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
            connection.query_row("PRAGMA quick_check", [], |row| row.get(0))
        };
        match check() {
            Ok(answer) if answer == "ok" => None,
            Ok(answer) => Some(answer),
            Err(source) => Some(classify(&path, source).to_string()),
        }
    }

    /// Returns the first unused value of the upper halves of job and epoch numbers. A number in the
    /// journal is never used again.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn numbers(&self) -> Result<u64, JournalError> {
        let highest = "SELECT max(n) FROM (SELECT max(job) AS n FROM jobs UNION SELECT max(job) FROM files \
                       UNION SELECT max(job) FROM deliveries UNION SELECT max(epoch) FROM files)";
        let highest: rusqlite::Result<Option<i64>> =
            self.connection.query_row(highest, [], |row| row.get(0));
        let highest = highest.map_err(|source| classify(&self.path, source))?;
        Ok(highest.map_or(0, |it| (number(it) >> 32) + 1))
    }

    /// Returns all files in the journal.
    ///
    /// # Errors
    /// When the journal cannot be read. Invalid rows are left out: their files are judged again.
    pub fn remembered(&self) -> Result<Vec<Remembered>, JournalError> {
        self.read_all()
            .map_err(|source| classify(&self.path, source))
    }

    fn read_all(&self) -> rusqlite::Result<Vec<Remembered>> {
        let mut delivered: HashMap<String, Vec<(String, Reported)>> = HashMap::new();
        let mut query = self
            .connection
            .prepare("SELECT path, reporter, job FROM deliveries")?;
        let mut rows = query.query([])?;
        while let Some(row) = rows.next()? {
            let job: Option<i64> = row.get(2)?;
            let reported = job.map_or(Reported::OfGone, |job| Reported::Of(JobId(number(job))));
            let entry = (row.get(1)?, reported);
            delivered.entry(row.get(0)?).or_default().push(entry);
        }
        let mut query = self.connection.prepare(
            "SELECT path, job, verdict, digest, basis, config, required_set, errors, warnings, \
             information, why, xqar, inputs, racy, epoch, written, own, own_errors, rests_on FROM files ORDER BY path",
        )?;
        let mut rows = query.query([])?;
        let mut all = Vec::new();
        while let Some(row) = rows.next()? {
            let path: String = row.get(0)?;
            if let Some(judged) = judged_of(row)? {
                let delivered = delivered.remove(&path).unwrap_or_default();
                all.push(Remembered {
                    path: from_text(&path).into(),
                    judged,
                    written: Some(row.get(15)?)
                        .filter(|it: &String| !it.is_empty())
                        // An unreadable fingerprint is stored as one that matches no file.
                        .map(|it| FileFingerprint::parse(&it).unwrap_or(FileFingerprint::NONE)),
                    delivered,
                });
            }
        }
        Ok(all)
    }

    /// Returns removed files, with the reporters that must still withdraw their reports about them.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn voids(&self) -> Result<Vec<Void>, JournalError> {
        let read = || -> rusqlite::Result<Vec<Void>> {
            let mut query = self.connection.prepare(
                "SELECT path, reporter, gone.xqar FROM deliveries LEFT JOIN gone USING (path) \
                 LEFT JOIN files USING (path) \
                 WHERE deliveries.job IS NULL AND (files.path IS NULL OR files.xqar <> gone.xqar)",
            )?;
            let rows = query.query_map([], |row| {
                let path: String = row.get(0)?;
                Ok(Void {
                    path: from_text(&path).into(),
                    reporter: row.get(1)?,
                    xqar: row
                        .get::<_, Option<String>>(2)?
                        .filter(|it| !it.is_empty())
                        .map(|it| from_text(&it)),
                })
            })?;
            rows.collect()
        };
        read().map_err(|source| classify(&self.path, source))
    }

    /// Returns the required bundles. This includes a bundle with a catalogue that is no longer
    /// readable, because it is still required.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn members(&self) -> Result<Vec<Member>, JournalError> {
        let read = || -> rusqlite::Result<Vec<Member>> {
            let mut query = self
                .connection
                .prepare("SELECT name, version, origin, catalogue FROM members ORDER BY name")?;
            let rows = query.query_map([], |row| {
                let origin: String = row.get(2)?;
                Ok(Member {
                    name: row.get(0)?,
                    version: row.get(1)?,
                    catalogue: serde_json::from_str(&row.get::<_, String>(3)?)
                        .ok()
                        .map(Arc::new),
                    origin: Origin::of(&origin).unwrap_or(Origin::Joined),
                })
            })?;
            rows.collect()
        };
        read().map_err(|source| classify(&self.path, source))
    }

    /// Writes entries in one transaction: all of them or none.
    ///
    /// # Errors
    /// When SQLite cannot write, for example because the disk is full. The caller must keep the
    /// entries then.
    pub fn write(&mut self, entries: &[Entry]) -> Result<(), JournalError> {
        let all: Vec<Change> = entries.iter().flat_map(changes).collect();
        self.make(&[&all])
    }

    /// Makes changes in one transaction: all of them or none.
    fn make(&mut self, changes: &[&[Change]]) -> Result<(), JournalError> {
        let made = self.try_to_make(changes);
        // Earlier changes take up to twice their room until a checkpoint moves them from the WAL into the database.
        let full = |error: &rusqlite::Error| {
            error.sqlite_error_code() == Some(rusqlite::ErrorCode::DiskFull)
        };
        let made = match made {
            Err(error) if full(&error) => self
                .connection
                .execute_batch("PRAGMA wal_checkpoint(TRUNCATE)")
                .and_then(|()| self.try_to_make(changes)),
            made => made,
        };
        made.map_err(|source| classify(&self.path, source))
    }

    fn try_to_make(&mut self, changes: &[&[Change]]) -> rusqlite::Result<()> {
        let transaction = self.connection.transaction()?;
        let mut lists = Vec::new();
        for change in changes.iter().copied().flatten() {
            if change.list.is_some_and(|it| self.lists.contains(&it)) {
                continue;
            }
            change.make(&transaction)?;
            lists.extend(change.list);
        }
        transaction.commit()?;
        if self.lists.len() > MOST_LISTS {
            self.lists.clear();
        }
        self.lists.extend(lists);
        Ok(())
    }

    /// Deletes the history of jobs older than `keep`.
    ///
    /// # Errors
    /// When SQLite cannot write.
    pub fn prune(&mut self, keep: Duration) -> Result<usize, JournalError> {
        let before = millis().saturating_sub(i64::try_from(keep.as_millis()).unwrap_or(i64::MAX));
        // This also deletes lists that no job uses any more, so no list is certainly stored now.
        self.lists.clear();
        let mut prune = || -> rusqlite::Result<usize> {
            let transaction = self.connection.transaction()?;
            let pruned = transaction.execute("DELETE FROM jobs WHERE at < ?1", params![before])?;
            if pruned > 0 {
                let unused =
                    "DELETE FROM checker_lists WHERE list NOT IN (SELECT list FROM job_skipped)";
                transaction.execute(unused, [])?;
            }
            transaction.commit()?;
            Ok(pruned)
        };
        prune().map_err(|source| classify(&self.path, source))
    }
}

/// Maximum number of lists of checkers in `Journal::lists`.
const MOST_LISTS: usize = 10_000;
