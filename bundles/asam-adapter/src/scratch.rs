//! Private directories, one for each run.
//!
//! The runner holds a lock on the directory during the run. A directory without a lock was left by
//! a killed runner. The next runner removes it at its start.

use std::fs::File;
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use qcbus_disk::trust;
use rustix::fs::{FlockOperation, flock};

/// Directory in which private directories are created.
#[derive(Debug)]
pub(crate) struct Scratch {
    root: PathBuf,
}

impl Scratch {
    /// Creates `root` and removes the directories of dead runners in it.
    ///
    /// # Errors
    /// System errors, and an error if other users can write to the root.
    pub fn open(root: &Path) -> io::Result<Scratch> {
        trust::make_private_directory(root).map_err(io::Error::other)?;
        // Modules may write canonical paths, and these must be found again in the result.
        let root = root.canonicalize()?;
        let scratch = Scratch { root };
        let _lock = scratch.lock()?;
        sweep(&scratch.root);
        Ok(scratch)
    }

    /// Creates a directory for one run. It is removed when the value is dropped.
    ///
    /// # Errors
    /// System errors.
    pub fn for_a_run(&self) -> io::Result<Room> {
        let _lock = self.lock()?;
        let own = std::process::id();
        let number = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), own);
        let path = self.root.join(format!("{own}-{number:016x}"));
        private(&path)?;
        let lock = File::open(&path)?;
        flock(&lock, FlockOperation::NonBlockingLockExclusive)?;
        Ok(Room { path, _lock: lock })
    }

    /// Locks the root, so that no directory is swept and none is new and still unlocked.
    fn lock(&self) -> io::Result<File> {
        let lock = File::open(&self.root)?;
        flock(&lock, FlockOperation::LockExclusive)?;
        Ok(lock)
    }
}

/// Private directory of one run.
#[derive(Debug)]
pub(crate) struct Room {
    path: PathBuf,
    /// Held while the directory is in use.
    _lock: File,
}

impl Room {
    /// Returns the path of the directory.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Creates a subdirectory.
    ///
    /// # Errors
    /// System errors.
    pub fn directory(&self, name: &str) -> io::Result<PathBuf> {
        let path = self.path.join(name);
        private(&path)?;
        Ok(path)
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        remove(&self.path);
    }
}

fn private(path: &Path) -> io::Result<()> {
    std::fs::DirBuilder::new().mode(0o700).create(path)
}

/// Removes the directories that have no lock.
fn sweep(root: &Path) {
    let entries = std::fs::read_dir(root).into_iter().flatten().flatten();
    for entry in entries {
        let path = entry.path();
        // A module may have removed its read permission. An unreadable directory may be in use.
        let opened = File::open(&path).or_else(|_| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o700))?;
            File::open(&path)
        });
        let lock = |it: File| flock(&it, FlockOperation::NonBlockingLockExclusive).is_ok();
        if opened.is_ok_and(lock) {
            remove(&path);
        }
    }
}

/// Removes a path regardless of the permissions in it.
fn remove(path: &Path) {
    if std::fs::remove_dir_all(path).is_ok() || path.symlink_metadata().is_err() {
        return;
    }
    // A run may have taken permissions away, or made a tree that is too deep for open directories.
    let script = "chmod -R u+rwx -- \"$0\"; rm -rf -- \"$0\"";
    let removed = Command::new("sh")
        .args(["-c", script])
        .arg(path)
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .status();
    if path.symlink_metadata().is_ok() {
        tracing::warn!(path = %path.display(), ?removed, "a private directory cannot be removed");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_scratch_of_dead_runners_is_removed() {
        let base = tempfile::tempdir().unwrap();
        let root = base.path().join("scratch");
        let living = Scratch::open(&root).unwrap();
        let room = living.for_a_run().unwrap();
        let left = root.join("1-left");
        let deep = left.join("shut");
        std::fs::create_dir_all(deep.join("more")).unwrap();
        std::fs::set_permissions(&deep, std::fs::Permissions::from_mode(0o000)).unwrap();
        Scratch::open(&root).unwrap();
        assert!(!left.exists());
        assert!(room.path().exists());
        drop(room);
        assert_eq!(std::fs::read_dir(&root).unwrap().count(), 0);
    }
}
