//! Files under temporary names, until they get their final name or are removed.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::TempPath;

/// A file under a temporary name. Dropping it removes the file. If the disk refuses, the removal is
/// retried later.
#[derive(Debug)]
pub struct Temporary(Option<TempPath>);

/// Reason why a file could not be renamed, and the file.
#[derive(Debug)]
pub struct Unnamed {
    /// Error of the file system.
    pub error: io::Error,
    /// The file, still under its temporary name.
    pub file: Temporary,
}

impl Temporary {
    pub(crate) fn new(path: TempPath) -> Temporary {
        Temporary(Some(path))
    }

    /// Returns its current path.
    pub fn path(&self) -> &Path {
        self.0.as_deref().unwrap_or(Path::new(""))
    }

    /// Gives the file its final name and replaces an existing file.
    ///
    /// # Errors
    /// Returns the error of the file system and the file, which can be stored elsewhere.
    pub fn persist(mut self, place: &Path) -> Result<(), Unnamed> {
        let Some(path) = self.0.take() else {
            return Ok(());
        };
        path.persist(place).map_err(|refused| Unnamed {
            error: refused.error,
            file: Temporary(Some(refused.path)),
        })
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let Some(path) = self.0.take() else { return };
        let name = path.to_path_buf();
        if path.close().is_err_and(|error| is_left(&error)) {
            left().push(name);
        }
    }
}

/// Files that this process could not remove.
static LEFT: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn left() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    LEFT.lock().unwrap_or_else(PoisonError::into_inner)
}

fn is_left(error: &io::Error) -> bool {
    error.kind() != io::ErrorKind::NotFound
}

/// Tries again to remove the temporary files of this process that could not be removed.
pub fn remove_left() {
    let tried = std::mem::take(&mut *left());
    if tried.is_empty() {
        return;
    }
    let refused = |path: &PathBuf| std::fs::remove_file(path).is_err_and(|error| is_left(&error));
    let again: Vec<PathBuf> = tried.into_iter().filter(refused).collect();
    left().extend(again);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn temporary_in(directory: &Path) -> (Temporary, PathBuf) {
        let file = tempfile::NamedTempFile::new_in(directory).unwrap();
        let path = file.path().to_path_buf();
        (Temporary::new(file.into_temp_path()), path)
    }

    /// A directory in place of the file simulates a disk that refuses to remove it.
    #[test]
    fn file_that_cannot_be_removed_is_removed_later() {
        let dir = tempfile::tempdir().unwrap();
        let (temporary, path) = temporary_in(dir.path());
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        drop(temporary);
        remove_left();
        assert!(path.exists());
        std::fs::remove_dir(&path).unwrap();
        std::fs::write(&path, "left").unwrap();
        // Another test may be trying the same file at this moment and record it a little later.
        let is_removed = || {
            remove_left();
            std::thread::yield_now();
            !path.exists()
        };
        assert!((0..10_000).any(|_| is_removed()));
        assert!(!left().contains(&path));
    }

    #[test]
    fn file_that_cannot_be_named_keeps_its_temporary_name() {
        let dir = tempfile::tempdir().unwrap();
        let (temporary, path) = temporary_in(dir.path());
        let refused = temporary.persist(&dir.path().join("no/such")).unwrap_err();
        assert!(path.exists());
        refused.file.persist(&dir.path().join("named")).unwrap();
        assert!(!path.exists() && dir.path().join("named").exists());
    }
}
