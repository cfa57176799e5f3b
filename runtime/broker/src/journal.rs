//! The journal: what must survive the broker, in SQLite. The schema is in `journal.sql`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use qcbus_messages::path_text::{from_text, to_text as text};
use qcbus_messages::{Digest, JobId, Verdict};
use rusqlite::{Connection, OpenFlags, Transaction, params};

use crate::core::{Epoch, Input, Judged, Juror, Jury, Mark, Member, Origin, Stamp};
use crate::directory_lock::{DirectoryLock, LockError, Purpose};
use crate::disk::FileMark;

/// Version of the schema, kept in SQLite's `user_version`.
pub const SCHEMA_VERSION: i64 = 3;

const SCHEMA: &str = include_str!("journal.sql");

/// Why the journal cannot be used, with the way out.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// Another process holds it.
    #[error(
        "the journal {path} is locked by another process ({source}); stop the other broker on this state directory, or give this one another with --state"
    )]
    Locked {
        /// The journal.
        path: PathBuf,
        /// What SQLite says.
        source: rusqlite::Error,
    },
    /// Another broker works with this state directory, or it cannot be taken.
    #[error("{0}")]
    State(#[from] LockError),
    /// Its disk is full.
    #[error(
        "the journal {path} cannot be written: its disk is full; make room, it is tried again until there is some"
    )]
    Full {
        /// The journal.
        path: PathBuf,
    },
    /// It is no journal, or a broken one.
    #[error(
        "the journal {path} cannot be used: {source}. It only remembers which files are finished: move it away (`mv {path} {path}.broken`) and start again, everything is then judged anew; `qcbus doctor` looks into it"
    )]
    Broken {
        /// The journal.
        path: PathBuf,
        /// What SQLite says.
        source: rusqlite::Error,
    },
    /// It was written by a newer version of qcbus.
    #[error(
        "the journal {path} has schema {found}, this version of qcbus knows {SCHEMA_VERSION}: use the newer qcbus, or give this one another directory with --state"
    )]
    Newer {
        /// The journal.
        path: PathBuf,
        /// Its schema.
        found: i64,
    },
    /// Its directory cannot be made.
    #[error("cannot make the state directory {path}: {source}; choose another with --state")]
    Directory {
        /// The directory.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// A file with its verdict, as the journal remembers it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remembered {
    /// Absolute path.
    pub path: Arc<Path>,
    /// The verdict and what it depends on.
    pub judged: Judged,
    /// The mark of the verdict file as it was written, where that was remembered.
    pub written: Option<FileMark>,
    /// The reporters that have it, each with the job whose result it has.
    pub delivered: Vec<(String, JobId)>,
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
    /// Bundle, checker, status, number of issues, of checkers worth mentioning.
    pub checkers: Vec<(String, String, String, u64)>,
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
        written: Option<FileMark>,
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
    /// Kept as long as the journal is.
    _lock: Option<DirectoryLock>,
}

impl Journal {
    /// Opens or makes the journal in a state directory, which is this instance's alone as long as
    /// the journal is open.
    ///
    /// # Errors
    /// See [`JournalError`]; each says what to do.
    pub fn open(state: &Path, instance: &str) -> Result<Journal, JournalError> {
        std::fs::create_dir_all(state).map_err(|source| JournalError::Directory {
            path: state.to_path_buf(),
            source,
        })?;
        let lock = DirectoryLock::take(state, Purpose::State, instance)?;
        let path = state.join("journal.sqlite");
        let fail = |source| classify(&path, source);
        let connection = Connection::open(&path).map_err(fail)?;
        connection
            .busy_timeout(Duration::from_secs(5))
            .map_err(fail)?;
        prepare(&connection, &path)?;
        Ok(Journal {
            connection,
            path,
            _lock: Some(lock),
        })
    }

    /// A journal that is forgotten with the process, for a single run.
    ///
    /// # Errors
    /// When SQLite cannot even do that.
    pub fn in_memory() -> Result<Journal, JournalError> {
        let path = PathBuf::from(":memory:");
        let connection = Connection::open_in_memory().map_err(|source| classify(&path, source))?;
        prepare(&connection, &path)?;
        Ok(Journal {
            connection,
            path,
            _lock: None,
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
        let mut delivered: HashMap<String, Vec<(String, JobId)>> = HashMap::new();
        let mut query = self
            .connection
            .prepare("SELECT path, reporter, job FROM deliveries")?;
        let mut rows = query.query([])?;
        while let Some(row) = rows.next()? {
            let entry = (row.get(1)?, JobId(number(row.get(2)?)));
            delivered.entry(row.get(0)?).or_default().push(entry);
        }
        let mut query = self.connection.prepare(
            "SELECT path, job, verdict, digest, basis, config, jury, errors, warnings, \
             information, why, xqar, inputs, racy, epoch, written FROM files ORDER BY path",
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
                        .map(FileMark),
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
                 WHERE deliveries.job = 0 AND (files.path IS NULL OR files.xqar <> gone.xqar)",
            )?;
            let rows = query.query_map([], |row| {
                let path: String = row.get(0)?;
                Ok(Void {
                    path: from_text(&path).into(),
                    reporter: row.get(1)?,
                    xqar: row.get::<_, Option<String>>(2)?.map(|it| from_text(&it)),
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
        let path = self.path.clone();
        let mut write = || -> rusqlite::Result<()> {
            let transaction = self.connection.transaction()?;
            for entry in entries {
                put(&transaction, entry)?;
            }
            transaction.commit()
        };
        write().map_err(|source| classify(&path, source))
    }

    /// Forgets the history of jobs older than `keep`.
    ///
    /// # Errors
    /// When SQLite cannot write.
    pub fn prune(&mut self, keep: Duration) -> Result<usize, JournalError> {
        let before = millis().saturating_sub(i64::try_from(keep.as_millis()).unwrap_or(i64::MAX));
        self.connection
            .execute("DELETE FROM jobs WHERE at < ?1", params![before])
            .map_err(|source| classify(&self.path, source))
    }
}

fn prepare(connection: &Connection, path: &Path) -> Result<(), JournalError> {
    let fail = |source| classify(path, source);
    let found: i64 = connection
        .query_row("PRAGMA user_version", [], |row| row.get(0))
        .map_err(fail)?;
    if found > SCHEMA_VERSION {
        return Err(JournalError::Newer {
            path: path.to_path_buf(),
            found,
        });
    }
    if found == 1 || found == 2 {
        // What is in the old column is no jury, so that every verdict is looked at again.
        let newer = "BEGIN; ALTER TABLE files RENAME COLUMN bundles TO jury; \
                     ALTER TABLE files ADD COLUMN epoch INTEGER NOT NULL DEFAULT 0; \
                     ALTER TABLE files ADD COLUMN written TEXT NOT NULL DEFAULT ''; \
                     PRAGMA user_version = 3; COMMIT;";
        connection.execute_batch(newer).map_err(fail)?;
    }
    // WAL with synchronous=NORMAL survives a killed process; after a power cut the last verdicts
    // may be missing, and their files are judged anew.
    connection
        .execute_batch(&format!(
            "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA foreign_keys = ON; \
             {SCHEMA} PRAGMA user_version = {SCHEMA_VERSION};"
        ))
        .map_err(fail)
}

fn classify(path: &Path, source: rusqlite::Error) -> JournalError {
    use rusqlite::ErrorCode::{DatabaseBusy, DatabaseLocked};
    let path = path.to_path_buf();
    match source.sqlite_error_code() {
        Some(DatabaseBusy | DatabaseLocked) => JournalError::Locked { path, source },
        Some(rusqlite::ErrorCode::DiskFull) => JournalError::Full { path },
        _ => JournalError::Broken { path, source },
    }
}

fn put(transaction: &Transaction<'_>, entry: &Entry) -> rusqlite::Result<()> {
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
        Entry::Withdrawn { path, reporters } => {
            let path = text(path);
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
                deliver(transaction, &path, reporter, JobId(0))?;
            }
        }
        Entry::Left {
            path,
            xqar,
            reporters,
        } => {
            let path = text(path);
            for reporter in reporters {
                transaction.execute(
                    "INSERT OR REPLACE INTO gone (path, xqar) VALUES (?1, ?2)",
                    params![path, text(xqar)],
                )?;
                deliver(transaction, &path, reporter, JobId(0))?;
            }
        }
        Entry::Voided { path, reporter } => {
            transaction.execute(
                "DELETE FROM deliveries WHERE path = ?1 AND reporter = ?2 AND job = 0",
                params![text(path), reporter],
            )?;
            transaction.execute(
                "DELETE FROM gone WHERE path = ?1 AND path NOT IN \
                 (SELECT path FROM deliveries WHERE path = ?1 AND job = 0)",
                params![text(path)],
            )?;
        }
        Entry::Enrolled(member) => put_member(transaction, member)?,
        Entry::Struck { name } => {
            transaction.execute("DELETE FROM members WHERE name = ?1", params![name])?;
        }
        Entry::Delivered {
            path,
            reporter,
            job,
        } => {
            deliver(transaction, &text(path), reporter, *job)?;
        }
    }
    Ok(())
}

fn deliver(
    transaction: &Transaction<'_>,
    path: &str,
    reporter: &str,
    job: JobId,
) -> rusqlite::Result<()> {
    let mut statement = transaction.prepare_cached(
        "INSERT OR REPLACE INTO deliveries (path, reporter, job) VALUES (?1, ?2, ?3)",
    )?;
    statement
        .execute(params![path, reporter, signed(job.0)])
        .map(|_| ())
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
        text(&judged.xqar),
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

fn jury_to_text(jury: &Jury) -> String {
    let row = |juror: &Juror| {
        (
            juror.name.clone(),
            juror.mark.map(|it| format!("{:016x}", it.0)),
        )
    };
    let rows: Vec<(String, Option<String>)> = jury.0.iter().map(row).collect();
    serde_json::to_string(&rows).unwrap_or_default()
}

fn jury_from_text(text: &str) -> Jury {
    let read = || -> Option<Vec<Juror>> {
        let rows: Vec<(String, Option<String>)> = serde_json::from_str(text).ok()?;
        let juror = |(name, mark): (String, Option<String>)| {
            let mark = match mark {
                Some(mark) => Some(Mark(u64::from_str_radix(&mark, 16).ok()?)),
                None => None,
            };
            Some(Juror { name, mark })
        };
        rows.into_iter().map(juror).collect()
    };
    read().map_or_else(Jury::unknown, Jury)
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

/// A path, and of its content size, time of modification, inode, digest, time of change.
type InputRow = (String, Option<(u64, i128, u64, String, i128)>);

/// The same in schema 1, which knew no time of change.
type InputRowOfSchema1 = (String, Option<(u64, i128, u64, String)>);

fn inputs_to_text(inputs: &[Input]) -> String {
    let rows: Vec<InputRow> = inputs
        .iter()
        .map(|input| {
            let content = input.content.map(|(stamp, digest)| {
                (
                    stamp.size,
                    stamp.mtime_ns,
                    stamp.inode,
                    digest.to_string(),
                    stamp.ctime_ns,
                )
            });
            (text(&input.path), content)
        })
        .collect();
    serde_json::to_string(&rows).unwrap_or_default()
}

fn inputs_from_text(text: &str) -> Option<Vec<Input>> {
    let rows = serde_json::from_str(text).ok();
    let rows: Vec<InputRow> = rows.or_else(|| rows_of_schema_1(text))?;
    let input = |(path, content): InputRow| {
        let content = match content {
            None => None,
            Some((size, mtime_ns, inode, digest, ctime_ns)) => Some((
                Stamp {
                    size,
                    mtime_ns,
                    ctime_ns,
                    inode,
                },
                digest.parse().ok()?,
            )),
        };
        Some(Input {
            path: from_text(&path).into(),
            content,
        })
    };
    rows.into_iter().map(input).collect()
}

/// Without a time of change a stamp fits no file, which is then read once more and found to be the
/// same, or not.
fn rows_of_schema_1(text: &str) -> Option<Vec<InputRow>> {
    let rows: Vec<InputRowOfSchema1> = serde_json::from_str(text).ok()?;
    let row = |(path, content): InputRowOfSchema1| {
        let content = content.map(|(size, mtime, inode, digest)| (size, mtime, inode, digest, 0));
        (path, content)
    };
    Some(rows.into_iter().map(row).collect())
}

fn judged_of(row: &rusqlite::Row<'_>) -> rusqlite::Result<Option<Judged>> {
    let digest = |index| -> rusqlite::Result<Option<Digest>> {
        Ok(row.get::<_, String>(index)?.parse().ok())
    };
    let verdict = match row.get::<_, String>(2)?.as_str() {
        "accepted" => Verdict::Accepted,
        "rejected" => Verdict::Rejected,
        "undetermined" => Verdict::Undetermined,
        _ => return Ok(None),
    };
    let (own, basis, config) = (digest(3)?, digest(4)?, digest(5)?);
    let inputs = inputs_from_text(&row.get::<_, String>(12)?);
    let (Some(digest), Some(basis), Some(config), Some(inputs)) = (own, basis, config, inputs)
    else {
        return Ok(None);
    };
    Ok(Some(Judged {
        job: JobId(number(row.get(1)?)),
        verdict,
        digest,
        basis,
        config,
        jury: Arc::new(jury_from_text(&row.get::<_, String>(6)?)),
        epoch: Epoch(number(row.get(14)?)),
        inputs,
        racy: row.get(13)?,
        counts: [
            number(row.get(7)?),
            number(row.get(8)?),
            number(row.get(9)?),
        ],
        why: serde_json::from_str(&row.get::<_, String>(10)?).unwrap_or_default(),
        xqar: from_text(&row.get::<_, String>(11)?),
    }))
}

fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

fn number(signed: i64) -> u64 {
    u64::try_from(signed).unwrap_or(0)
}

/// Milliseconds since 1970. Only ever shown or compared with the retention time, so a clock that
/// jumps does no harm.
fn millis() -> i64 {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use qcbus_messages::Catalogue;

    use super::*;

    fn judged(job: u64) -> Judged {
        Judged {
            job: JobId(job),
            verdict: Verdict::Undetermined,
            digest: Digest([1; 32]),
            basis: Digest([2; 32]),
            config: Digest([3; 32]),
            jury: Arc::new(Jury(vec![
                Juror {
                    name: "mine".to_owned(),
                    mark: None,
                },
                Juror {
                    name: "xodrBundle".to_owned(),
                    mark: Some(Mark(u64::MAX)),
                },
            ])),
            epoch: Epoch(1 << 40),
            inputs: vec![
                Input {
                    path: Path::new("/a.xosc").into(),
                    content: Some((
                        Stamp {
                            size: 1,
                            mtime_ns: -(1 << 70),
                            ctime_ns: 1 << 71,
                            inode: 3,
                        },
                        Digest([1; 32]),
                    )),
                },
                Input {
                    path: Path::new("/a.xodr").into(),
                    content: None,
                },
            ],
            racy: true,
            counts: [1, 2, 3],
            why: vec!["xodrBundle: it died".to_owned()],
            xqar: PathBuf::from("/out/a.xosc.xqar"),
        }
    }

    #[test]
    fn what_was_written_is_remembered() {
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
                        written: Some(FileMark("7 8 9".to_owned())),
                    },
                    // Only fresh stamps.
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
        assert_eq!(all[0].written, Some(FileMark("7 8 9".to_owned())));
        assert_eq!(all[0].delivered, [("json".to_owned(), JobId(5))]);
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
    fn a_journal_of_schema_1_opens_and_its_stamps_fit_nothing() {
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
                "ALTER TABLE files RENAME COLUMN jury TO bundles; \
                 ALTER TABLE files DROP COLUMN epoch; ALTER TABLE files DROP COLUMN written; \
                 UPDATE files SET bundles = 'ffffffffffffffff'; PRAGMA user_version = 1",
            )
            .unwrap();
        drop(journal);
        let all = Journal::open(dir.path(), "default")
            .unwrap()
            .remembered()
            .unwrap();
        assert_eq!(all.len(), 1);
        let (stamp, known) = all[0].judged.inputs[0].content.unwrap();
        assert_eq!((stamp.size, stamp.mtime_ns, stamp.inode), (1, 7, 3));
        assert_eq!(stamp.ctime_ns, 0);
        assert_eq!(known, digest);
        assert_eq!(all[0].judged.inputs[1], written.inputs[1]);
        assert_eq!(all[0].judged.basis, written.basis);
        assert_eq!(*all[0].judged.jury, Jury::unknown());
        assert_eq!(all[0].written, None);
    }

    #[test]
    fn who_must_judge_is_remembered_until_struck() {
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
        // Of another version of qcbus, perhaps: it must judge nevertheless.
        let spoilt = "UPDATE members SET catalogue = '{\"kinds\": 7}'";
        journal.connection.execute_batch(spoilt).unwrap();
        assert_eq!(journal.members().unwrap()[0].catalogue, None);
        let name = "mine".to_owned();
        journal.write(&[Entry::Struck { name }]).unwrap();
        assert_eq!(journal.members().unwrap(), []);
    }

    #[test]
    fn a_broken_journal_says_so_and_what_to_do() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(
            dir.path().join("journal.sqlite"),
            "this is no database at all, is it?",
        )
        .unwrap();
        let error = Journal::open(dir.path(), "test").unwrap_err().to_string();
        assert!(error.contains("move it away"), "{error}");
        assert!(Journal::examine(dir.path()).is_some());
    }

    #[test]
    fn a_newer_journal_is_left_alone() {
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
}
