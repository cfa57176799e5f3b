//! Contents of a gate directory, including files from other programs.

use std::collections::{HashMap, HashSet};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use qcbus_disk::{foreign, remove};
use qcbus_document::FileKind;
use qcbus_messages::Digest;
use qcbus_messages::path_text::to_text;
use qcbus_types::digest_of;

use crate::directory_lock::{GATE_FILE, LockError};

/// Reason why a directory cannot be a gate, with a way to fix it.
#[derive(Debug, thiserror::Error)]
pub enum GateError {
    /// Another broker uses the directory, or the lock cannot be taken.
    #[error("{0}")]
    Lock(#[from] LockError),
    /// The directory contains files of another program.
    #[error(
        "the gate {} contains files but is not a gate of qcbus, which removes everything it has not published: \
         choose an empty directory with --gate, or run `touch {}` to give qcbus this directory with its contents",
        to_text(directory), to_text(&directory.join(GATE_FILE))
    )]
    Foreign {
        /// The directory.
        directory: PathBuf,
    },
    /// The directory cannot be searched, or something in it cannot be removed.
    #[error(
        "cannot clear the gate {}: {source}; choose another directory with --gate",
        to_text(directory)
    )]
    Contents {
        /// The directory.
        directory: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
}

/// Refuses a directory that contains files and was no gate before.
pub(super) fn refuse_foreign(directory: &Path) -> Result<(), GateError> {
    let found = files(directory).map_err(|source| GateError::Contents {
        directory: directory.to_path_buf(),
        source,
    })?;
    if found.is_empty() || directory.join(GATE_FILE).exists() {
        return Ok(());
    }
    Err(GateError::Foreign {
        directory: directory.to_path_buf(),
    })
}

/// Returns everything below the directory except directories and the gate's own file, with sizes in bytes. Unreadable
/// directories, such as `lost+found`, are skipped because they contain no published files.
pub(super) fn files(directory: &Path) -> io::Result<HashMap<PathBuf, u64>> {
    let mut found = HashMap::new();
    let mut open = vec![directory.to_path_buf()];
    while let Some(next) = open.pop() {
        let entries = match std::fs::read_dir(&next) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(_) if next != *directory => continue,
            Err(error) => return Err(error),
        };
        for entry in entries {
            let entry = entry?;
            let data = entry.metadata()?;
            if data.is_dir() {
                open.push(entry.path());
            } else if entry.file_name() != GATE_FILE || next != *directory {
                // Another program can change an entry that is no regular file, or has another hard link, at any time.
                let is_ours = data.is_file() && data.nlink() == 1;
                let size = if is_ours { data.len() } else { u64::MAX };
                found.insert(entry.path(), size);
            }
        }
    }
    Ok(found)
}

/// Returns the digest of a file of this size in bytes, or `None` if it cannot be read.
pub(super) fn digest_at(path: &Path, size: u64) -> Option<Digest> {
    let bytes = foreign::read(path, size).ok()?;
    Some(digest_of(&bytes))
}

/// Removes all files that are not in `kept`, and the directories that become empty. Files that
/// refer to others are removed before the files that they refer to.
pub(super) fn remove_others(
    directory: &Path,
    there: &HashMap<PathBuf, u64>,
    kept: &HashSet<PathBuf>,
) -> io::Result<()> {
    let mut others: Vec<&PathBuf> = there.keys().filter(|it| !kept.contains(*it)).collect();
    others.sort_by_key(|path| match FileKind::of_path(path) {
        Some(FileKind::Xodr) => 1,
        Some(_) => 0,
        None => 2,
    });
    for other in others {
        remove(other)?;
        let above = other.ancestors().skip(1);
        for above in above.take_while(|it| *it != directory) {
            if std::fs::remove_dir(above).is_err() {
                break;
            }
        }
    }
    Ok(())
}
