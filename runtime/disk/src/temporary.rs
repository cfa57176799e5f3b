//! Files under temporary names, until they get their final name or are removed.

use std::fs::File;
use std::io;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use rustix::fs::renameat;
use tempfile::TempPath;

/// A file under a temporary name. Dropping it removes the file. If the disk refuses, the removal is
/// retried later.
#[derive(Debug)]
pub struct Temporary {
    /// `None` after the file got its final name.
    path: Option<TempPath>,
    /// The directory in which the file was written. A restored backup can replace the directory at
    /// its path, and the backup can contain a partial file of the same name.
    directory: File,
}

/// Reason why a file could not be renamed, and the file.
#[derive(Debug)]
pub struct Unnamed {
    /// Error of the file system.
    pub error: io::Error,
    /// The file, still under its temporary name.
    pub file: Temporary,
}

impl Temporary {
    /// Takes a file that was just created.
    pub(crate) fn new(path: TempPath) -> io::Result<Temporary> {
        let directory = open_directory(parent(&path))?;
        Ok(Temporary {
            path: Some(path),
            directory,
        })
    }

    /// Returns its current path.
    pub fn path(&self) -> &Path {
        self.path.as_deref().unwrap_or(Path::new(""))
    }

    /// Gives the file its final name and replaces an existing file. The final name is in the same
    /// directory.
    ///
    /// # Errors
    /// Returns the error of the file system and the file, which can be renamed again. The error is
    /// `NotFound` if another directory took the place of this one.
    pub fn persist(mut self, place: &Path) -> Result<(), Unnamed> {
        if let Err(error) = self.rename(place) {
            return Err(Unnamed { error, file: self });
        }
        // The name is no longer temporary, so it must not be removed.
        drop(self.path.take().map(TempPath::keep));
        Ok(())
    }

    fn rename(&self, place: &Path) -> io::Result<()> {
        let written = self.directory.metadata()?;
        let now = std::fs::metadata(parent(place))?;
        if (written.dev(), written.ino()) != (now.dev(), now.ino()) {
            return Err(io::ErrorKind::NotFound.into());
        }
        let (Some(from), Some(to)) = (self.path().file_name(), place.file_name()) else {
            return Err(io::ErrorKind::InvalidFilename.into());
        };
        Ok(renameat(&self.directory, from, &self.directory, to)?)
    }
}

/// Opens a directory for renaming in it, which needs no permission to list it.
fn open_directory(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    let options = options
        .read(true)
        .custom_flags(libc::O_PATH | libc::O_DIRECTORY);
    options.open(path)
}

/// Returns the directory of a path.
pub(crate) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(directory) if !directory.as_os_str().is_empty() => directory,
        _ => Path::new("."),
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let Some(path) = self.path.take() else {
            return;
        };
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
        (Temporary::new(file.into_temp_path()).unwrap(), path)
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

    /// A backup was taken while the file was partial, and was then restored in one step.
    #[test]
    fn partial_file_of_a_restored_backup_gets_no_final_name() {
        let dir = tempfile::tempdir().unwrap();
        let [live, backup] = ["live", "backup"].map(|name| dir.path().join(name));
        std::fs::create_dir(&live).unwrap();
        std::fs::create_dir(&backup).unwrap();
        let (temporary, path) = temporary_in(&live);
        std::fs::write(backup.join(path.file_name().unwrap()), "partial").unwrap();
        let exchange = rustix::fs::RenameFlags::EXCHANGE;
        rustix::fs::renameat_with(rustix::fs::CWD, &live, rustix::fs::CWD, &backup, exchange)
            .unwrap();
        let refused = temporary.persist(&live.join("report.txt")).unwrap_err();
        assert_eq!(refused.error.kind(), io::ErrorKind::NotFound);
        assert!(!live.join("report.txt").exists());
    }
}
