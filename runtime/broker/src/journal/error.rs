//! Why the journal cannot be used.

use std::path::{Path, PathBuf};

use qcbus_disk::trust::TrustError;

use super::SCHEMA_VERSION;
use crate::directory_lock::LockError;

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
    #[error("the journal {path} cannot be written: its disk is full; make room")]
    Full {
        /// The journal.
        path: PathBuf,
    },
    /// It is no journal, or a broken one.
    #[error(
        "the journal {path} cannot be used: {source}. It remembers which files are finished, and which bundles joined that were started by hand: move it away (`mv {path} {path}.broken`) and start again, everything is then judged anew, and bundles that were started by hand must judge once they have joined again; `qcbus doctor` looks into it"
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
    /// Somebody else decides what is in it.
    #[error(
        "the state is not in this broker's hands alone: {0}; or choose another directory with --out or --state"
    )]
    Foreign(TrustError),
    /// Its directory cannot be made.
    #[error("cannot make the state directory {path}: {source}; choose another with --state")]
    Directory {
        /// The directory.
        path: PathBuf,
        /// What the system says.
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

/// What SQLite says, as what it means for the journal.
pub(super) fn classify(path: &Path, source: rusqlite::Error) -> JournalError {
    use rusqlite::ErrorCode::{DatabaseBusy, DatabaseLocked};
    let path = path.to_path_buf();
    match source.sqlite_error_code() {
        Some(DatabaseBusy | DatabaseLocked) => JournalError::Locked { path, source },
        Some(rusqlite::ErrorCode::DiskFull) => JournalError::Full { path },
        _ => JournalError::Broken { path, source },
    }
}
