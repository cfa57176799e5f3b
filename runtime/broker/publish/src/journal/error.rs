//! Errors of the journal.

use std::path::{Path, PathBuf};

use qcbus_disk::trust::TrustError;

use super::SCHEMA_VERSION;
use crate::directory_lock::LockError;

/// Reason why the journal cannot be used, with a way to fix it.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// Another process has locked the journal.
    #[error(
        "the journal {path} is locked by another process ({source}); stop the other broker on this state \
         directory, or choose another directory for this one with --state"
    )]
    Locked {
        /// Path of the journal.
        path: PathBuf,
        /// Error of SQLite.
        source: rusqlite::Error,
    },
    /// Another broker uses this state directory, or the lock cannot be taken.
    #[error("{0}")]
    State(#[from] LockError),
    /// The disk of the journal is full.
    #[error("the journal {path} cannot be written: its disk is full; free some space")]
    Full {
        /// Path of the journal.
        path: PathBuf,
    },
    /// The file is no journal, or is corrupt.
    #[error(
        "the journal {path} cannot be used: {source}. It records which files are finished, and which manually \
         started bundles have joined. Move it away (`mv {path} {path}.broken`) and start again: all files are \
         then judged again, and manually started bundles are required once they have joined again; `qcbus \
         doctor` examines the journal"
    )]
    Broken {
        /// Path of the journal.
        path: PathBuf,
        /// Error of SQLite.
        source: rusqlite::Error,
    },
    /// A newer version of qcbus wrote the journal.
    #[error(
        "the journal {path} has schema {found}, this version of qcbus supports {SCHEMA_VERSION}: use the newer \
         qcbus, or choose another directory for this one with --state"
    )]
    Newer {
        /// Path of the journal.
        path: PathBuf,
        /// Schema version of the journal.
        found: i64,
    },
    /// Another user can change the contents of the state directory.
    #[error(
        "the state directory is not under this user's sole control: {0}; or choose another directory with --out \
         or --state"
    )]
    Foreign(TrustError),
    /// The state directory cannot be created.
    #[error(
        "cannot create the state directory {path}: {source}; choose another directory with --state"
    )]
    Directory {
        /// Path of the directory.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
}

impl From<TrustError> for JournalError {
    fn from(error: TrustError) -> Self {
        match error {
            TrustError::Io { path, source } => JournalError::Directory { path, source },
            foreign @ TrustError::Foreign { .. } => JournalError::Foreign(foreign),
        }
    }
}

/// Converts an SQLite error to an error of the journal.
pub(super) fn classify(path: &Path, source: rusqlite::Error) -> JournalError {
    use rusqlite::ErrorCode::{DatabaseBusy, DatabaseLocked};
    let path = path.to_path_buf();
    match source.sqlite_error_code() {
        Some(DatabaseBusy | DatabaseLocked) => JournalError::Locked { path, source },
        Some(rusqlite::ErrorCode::DiskFull) => JournalError::Full { path },
        _ => JournalError::Broken { path, source },
    }
}
