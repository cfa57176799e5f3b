//! What lies in the directory of a gate, whoever put it there.

use std::collections::{HashMap, HashSet};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use qcbus_disk::{foreign, remove};
use qcbus_document::FileKind;
use qcbus_messages::Digest;
use qcbus_messages::path_text::to_text;

use crate::directory_lock::{GATE_FILE, LockError};
use crate::store::digest_of;

/// Why a directory cannot be a gate, with the way out.
#[derive(Debug, thiserror::Error)]
pub enum GateError {
    /// Another broker has it, or it cannot be taken.
    #[error("{0}")]
    Lock(#[from] LockError),
    /// Somebody else's files are in it.
    #[error(
        "the gate {} holds files and is no gate of qcbus, which removes whatever it has not published: choose an empty directory with --gate, or `touch {}` to let it have this one with all that is in it",
        to_text(directory), to_text(&directory.join(GATE_FILE))
    )]
    Foreign {
        /// The directory.
        directory: PathBuf,
    },
    /// It cannot be looked through, or something in it cannot be removed.
    #[error(
        "cannot clear the gate {}: {source}; choose another with --gate",
        to_text(directory)
    )]
    Contents {
        /// The directory.
        directory: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Refuses a directory that has files and was no gate before.
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

/// Everything below the directory but directories and the gate's own file, with sizes in bytes.
/// Directories that cannot be looked into, such as `lost+found`, hold nothing of ours.
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
                // Nothing but a file has the size of one, and who has another name of it can change it at any time.
                let is_ours = data.is_file() && data.nlink() == 1;
                let size = if is_ours { data.len() } else { u64::MAX };
                found.insert(entry.path(), size);
            }
        }
    }
    Ok(found)
}

/// The digest of a file of this size in bytes; `None` when it cannot be read.
pub(super) fn digest_at(path: &Path, size: u64) -> Option<Digest> {
    let bytes = foreign::read(path, size).ok()?;
    Some(digest_of(&bytes))
}

/// Removes all files that are not kept, what refers to others before what others refer to, and the
/// directories that are empty then.
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
