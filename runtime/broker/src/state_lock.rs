//! The hold on a state directory: while one broker has it, no other may believe the journal in it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::Path;

use crate::journal::JournalError;

/// Name of the file that is locked. It says who holds it, and stays when nobody does.
const LOCK: &str = "lock";

/// A state directory that is ours until this is dropped, or the process ends in whatever way.
#[derive(Debug)]
pub struct StateLock {
    _file: File,
}

impl StateLock {
    /// Takes a state directory for the broker of an instance.
    ///
    /// # Errors
    /// [`JournalError::Held`] when another broker has it.
    pub fn take(state: &Path, instance: &str) -> Result<StateLock, JournalError> {
        let path = state.join(LOCK);
        let fail = |source| JournalError::Lock {
            path: path.clone(),
            source,
        };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(fail)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(JournalError::Held {
                    state: state.to_path_buf(),
                    holder: holder(&mut file),
                });
            }
            // A file system without locks is no reason to refuse the work.
            Err(TryLockError::Error(error)) => {
                tracing::warn!("cannot lock {}: {error}", path.display());
            }
        }
        // Only for whoever is refused: on a full disk the lock holds without it.
        let said = file.set_len(0);
        let _ = said.and_then(|()| writeln!(file, "{} {instance}", std::process::id()));
        Ok(StateLock { _file: file })
    }
}

fn holder(file: &mut File) -> String {
    let mut text = String::new();
    let _ = file.read_to_string(&mut text);
    match text.trim().split_once(' ') {
        Some((pid, instance)) => format!("instance `{instance}`, process {pid}"),
        None => "it has not said which".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_has_it_and_says_who() {
        let dir = tempfile::tempdir().unwrap();
        let first = StateLock::take(dir.path(), "first").unwrap();
        let refused = StateLock::take(dir.path(), "second")
            .unwrap_err()
            .to_string();
        let holder = format!("instance `first`, process {}", std::process::id());
        assert!(refused.contains(&holder), "{refused}");
        drop(first);
        let _second = StateLock::take(dir.path(), "second").unwrap();
        let refused = StateLock::take(dir.path(), "third")
            .unwrap_err()
            .to_string();
        assert!(refused.contains("instance `second`"), "{refused}");
    }
}
