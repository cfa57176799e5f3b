//! The journal: what must survive the broker, in SQLite. The schema is in `journal.sql`.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_formats::Text;
use qcbus_messages::JobId;
use qcbus_messages::path_text::from_text;
use rusqlite::{Connection, OpenFlags, params};

use crate::core::{Judged, Member, Origin, Reported};
use crate::directory_lock::{DirectoryLock, Purpose};
use qcbus_disk::{FileFingerprint, trust};

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

/// Version of the schema, kept in SQLite's `user_version`.
pub const SCHEMA_VERSION: i64 = 6;

/// A file with its verdict, as the journal remembers it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remembered {
    /// Absolute path.
    pub path: Arc<Path>,
    /// The verdict and what it depends on.
    pub judged: Judged,
    /// The mark of the verdict file as it was written, where that was remembered.
    pub written: Option<FileFingerprint>,
    /// The reporters that have said something of it.
    pub delivered: Vec<(String, Reported)>,
}

/// A file that has gone, and a reporter that has not yet taken back what it said of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Void {
    /// Absolute path of the file.
    pub path: Arc<Path>,
    /// The reporter.
    pub reporter: String,
    /// Where the result lay, if that is known.
    pub xqar: Option<PathBuf>,
}

/// What one job did, for the history.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct History {
    /// Source bytes.
    pub bytes: u64,
    /// Microseconds from the queue to the stored result.
    pub micros: u64,
    /// By bundle: name, version, microseconds, failure.
    pub bundles: Vec<(String, String, u64, String)>,
    /// Bundle, checker, status, number of issues, of those that failed or have findings.
    pub checkers: Vec<(String, String, String, u64)>,
    /// By bundle the checkers that were skipped.
    pub skipped: Vec<(String, Vec<Text>)>,
}

/// Something to remember.
#[derive(Debug)]
pub enum Entry {
    /// A verdict.
    Judged {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
        /// How it came about; absent when the verdict only got fresh stamps.
        history: Option<Box<History>>,
        /// The mark of the verdict file; absent when none was written now.
        written: Option<FileFingerprint>,
    },
    /// A file has gone.
    Withdrawn {
        /// The file.
        path: Arc<Path>,
        /// Who is to take back a report about it.
        reporters: Vec<String>,
    },
    /// A result was withdrawn that nothing was remembered of.
    Left {
        /// The file.
        path: Arc<Path>,
        /// Where the result lay.
        xqar: PathBuf,
        /// Who is to take back a report about it.
        reporters: Vec<String>,
    },
    /// A reporter has taken back its report about a file that has gone.
    Voided {
        /// The file.
        path: Arc<Path>,
        /// The reporter.
        reporter: String,
    },
    /// A bundle must judge from now on.
    Enrolled(Member),
    /// A bundle need not judge any more.
    Struck {
        /// Its name.
        name: String,
    },
    /// A reporter has a result.
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
    /// Lists of checkers that are in it for certain.
    lists: HashSet<i64>,
    /// Of the state directory; kept as long as the journal is.
    lock: Option<Arc<DirectoryLock>>,
}

impl Journal {
    /// Opens or makes the journal in a state directory, which is this instance's alone as long as
    /// the journal is open.
    ///
    /// # Errors
    /// See [`JournalError`]; each says what to do.
    pub fn open(state: &Path, instance: &str) -> Result<Journal, JournalError> {
        trust::make_directory(state)?;
        let path = state.join("journal.sqlite");
        // What was put there while others still could.
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

    /// The lock of the state directory.
    pub fn lock(&self) -> Option<Arc<DirectoryLock>> {
        self.lock.clone()
    }

    /// A journal that is forgotten with the process, for a test.
    ///
    /// # Errors
    /// When SQLite cannot even do that.
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

    /// Looks a journal through without changing it: `None` when it is sound, else what is wrong.
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

    /// From where on the upper halves of the numbers of jobs and epochs are new: none that is
    /// written here comes back.
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

    /// Everything that is remembered of files.
    ///
    /// # Errors
    /// When the journal cannot be read. Rows that make no sense are left out: their files are
    /// judged anew.
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
                        // What cannot be read is the mark of no file.
                        .map(|it| FileFingerprint::parse(&it).unwrap_or(FileFingerprint::NONE)),
                    delivered,
                });
            }
        }
        Ok(all)
    }

    /// Files that have gone and the reporters that have not yet taken back what they said of them.
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

    /// The bundles that must judge. One whose catalogue cannot be read any more is among them: it
    /// must judge nevertheless.
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
    /// When SQLite cannot write, a full disk for instance; the entries are the caller's to keep.
    pub fn write(&mut self, entries: &[Entry]) -> Result<(), JournalError> {
        let all: Vec<Change> = entries.iter().flat_map(changes).collect();
        self.make(&[&all])
    }

    /// Makes changes in one transaction: all of them or none.
    fn make(&mut self, changes: &[&[Change]]) -> Result<(), JournalError> {
        let made = self.try_to_make(changes);
        // What was written before may take twice its room until it is put where it belongs.
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

    /// Forgets the history of jobs older than `keep`.
    ///
    /// # Errors
    /// When SQLite cannot write.
    pub fn prune(&mut self, keep: Duration) -> Result<usize, JournalError> {
        let before = millis().saturating_sub(i64::try_from(keep.as_millis()).unwrap_or(i64::MAX));
        // Lists that no job has any more go, too, so that none is known for certain.
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

/// Lists of checkers that are remembered as being in the journal.
const MOST_LISTS: usize = 10_000;
