//! The removal lock of a generation: prevents the creation of files in its shared memory during and
//! after its removal.
//!
//! A directory cannot be removed while a process creates files in it. iceoryx2 also recreates
//! missing directories whenever a node or port is created. A late peer would thus leave shared
//! memory behind that no broker knows. Therefore a process that may create files holds the lock
//! shared, and the remover locks it first. The kernel releases these locks when a process dies.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::fs::{FlockOperation, flock};

/// Name of the lock file in the directory of a generation.
const REMOVAL_LOCK: &str = "removal-lock";
/// Content of the file once it is locked for removal. A process that has the file open sees this
/// even after the file is deleted.
const LOCKED: &[u8] = b"locked";
/// Content of the file once the remover no longer waits for the holders of the lock.
const GONE: &[u8] = b"locked, gone";
/// Maximum wait for the holders of the lock. A peer holds it for less than a millisecond, unless it
/// is stopped meanwhile. A stopped peer cleans up itself when it continues.
const OUT_WITHIN: Duration = Duration::from_secs(2);
/// Attempts to remove a directory. A resumed process may create files in it, or files may disappear
/// meanwhile.
const ATTEMPTS: usize = 50;

/// Access to the removal lock of a generation.
#[derive(Debug, Clone)]
pub(crate) struct RemovalLock {
    file: Arc<File>,
    root: PathBuf,
}

/// A shared hold of the removal lock. The memory stays while this exists.
#[derive(Debug)]
pub(crate) struct Inside {
    removal_lock: RemovalLock,
}

/// Reason why the lock cannot be taken.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoEntry {
    /// The broker is ending or has ended.
    #[error("the broker is about to end, or its shared memory was removed")]
    Locked,
    /// The generation may be usable, but this process cannot use it.
    #[error("cannot use the shared memory of the broker in {root}: {source}")]
    Failed { root: PathBuf, source: io::Error },
}

impl NoEntry {
    fn of(root: &Path, source: io::Error) -> NoEntry {
        match source.kind() {
            // A process that holds the exclusive lock is about to remove the generation.
            io::ErrorKind::NotFound | io::ErrorKind::WouldBlock => NoEntry::Locked,
            _ => NoEntry::Failed {
                root: root.to_path_buf(),
                source,
            },
        }
    }
}

/// Creates the lock file of a generation.
///
/// # Errors
/// Returns the error of the operating system.
pub(crate) fn make(root: &Path) -> io::Result<()> {
    let mut how = File::options();
    let how = how.write(true).create_new(true).mode(0o600);
    how.open(root.join(REMOVAL_LOCK)).map(|_| ())
}

impl RemovalLock {
    /// Opens the lock file of an existing generation.
    pub(crate) fn of(root: &Path) -> Result<RemovalLock, NoEntry> {
        let mut how = File::options();
        let how = how.read(true).custom_flags(libc::O_NOFOLLOW);
        let opened = how.open(root.join(REMOVAL_LOCK));
        let file = opened.map_err(|error| NoEntry::of(root, error))?;
        Ok(RemovalLock {
            file: Arc::new(file),
            root: root.to_path_buf(),
        })
    }

    /// Takes the lock shared for a short time. Each open file allows one hold at a time, because
    /// the kernel does not count the locks of one file.
    pub(crate) fn enter(&self) -> Result<Inside, NoEntry> {
        let locked = flock(&self.file, FlockOperation::NonBlockingLockShared);
        locked.map_err(|error| NoEntry::of(&self.root, error.into()))?;
        let inside = Inside {
            removal_lock: self.clone(),
        };
        match self.says_at_least(LOCKED) {
            true => Err(NoEntry::Locked),
            false => Ok(inside),
        }
    }

    fn says_at_least(&self, what: &[u8]) -> bool {
        let data = self.file.metadata();
        data.is_ok_and(|data| data.len() >= what.len() as u64)
    }
}

impl Inside {
    /// Returns the directory of the generation.
    pub(crate) fn root(&self) -> &Path {
        &self.removal_lock.root
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        // The remover has stopped waiting for this process. Files created since then have no owner.
        if self.removal_lock.says_at_least(GONE) {
            let _ = remove(&self.removal_lock.root);
        }
        let _ = flock(&self.removal_lock.file, FlockOperation::Unlock);
    }
}

/// Locks a generation for removal and removes its memory. Memory mapped by peers stays readable for
/// them.
///
/// # Errors
/// Returns the error of the operating system. Some files then still exist.
pub(crate) fn lock_and_remove(root: &Path) -> io::Result<()> {
    let _locked = lock_for_removal(root);
    remove(root)
}

/// Waits for the holders of the lock, up to a limit. Returns `None` if there is no lock file or it
/// cannot be opened for writing.
fn lock_for_removal(root: &Path) -> Option<File> {
    let mut how = File::options();
    let how = how.write(true).custom_flags(libc::O_NOFOLLOW);
    let file = how.open(root.join(REMOVAL_LOCK)).ok()?;
    // This is written first. Otherwise a continuous sequence of holders would keep it open.
    file.write_all_at(LOCKED, 0).ok()?;
    let until = Instant::now() + OUT_WITHIN;
    while flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() && Instant::now() < until
    {
        std::thread::sleep(Duration::from_micros(200));
    }
    file.write_all_at(GONE, 0).ok()?;
    Some(file)
}

fn remove(root: &Path) -> io::Result<()> {
    let mut last = Ok(());
    for attempt in 0..ATTEMPTS {
        if attempt > 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
        match fs::remove_dir_all(root) {
            Ok(()) => return Ok(()),
            // The root must be missing, not just one of its files, which their creators may remove.
            Err(_) if !root.exists() => return Ok(()),
            Err(error) => last = Err(error),
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    fn root() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::TempDir::new().unwrap();
        let root = dir.path().join("root");
        fs::create_dir(&root).unwrap();
        make(&root).unwrap();
        (dir, root)
    }

    #[test]
    fn removed_directory_cannot_be_entered() {
        let (_dir, root) = root();
        let early = RemovalLock::of(&root).unwrap();
        drop(early.enter().unwrap());
        lock_and_remove(&root).unwrap();
        assert!(!root.exists());
        assert!(matches!(early.enter(), Err(NoEntry::Locked)));
        assert!(matches!(RemovalLock::of(&root), Err(NoEntry::Locked)));
    }

    #[test]
    fn unopenable_lock_is_not_reported_as_locked() {
        let (_dir, root) = root();
        fs::remove_file(root.join(REMOVAL_LOCK)).unwrap();
        std::os::unix::fs::symlink("elsewhere", root.join(REMOVAL_LOCK)).unwrap();
        let refused = RemovalLock::of(&root).unwrap_err().to_string();
        assert!(refused.contains("symbolic links"), "{refused}");
        assert!(!refused.contains("about to end"), "{refused}");
    }

    #[test]
    fn removal_waits_for_a_process_inside() {
        let (_dir, root) = root();
        let inside = RemovalLock::of(&root).unwrap().enter().unwrap();
        let remover = {
            let root = root.clone();
            std::thread::spawn(move || lock_and_remove(&root))
        };
        std::thread::sleep(Duration::from_millis(20));
        fs::write(root.join("node"), "made inside").unwrap();
        drop(inside);
        remover.join().unwrap().unwrap();
        assert!(!root.exists());
    }

    #[test]
    fn process_stopped_inside_removes_its_late_files() {
        let (_dir, root) = root();
        let inside = RemovalLock::of(&root).unwrap().enter().unwrap();
        lock_and_remove(&root).unwrap();
        assert!(
            !root.exists(),
            "the removal does not wait for the stopped process"
        );
        fs::create_dir(&root).unwrap();
        fs::write(root.join("node"), "made too late").unwrap();
        drop(inside);
        assert!(!root.exists());
    }

    #[test]
    fn removal_succeeds_with_concurrent_users() {
        for _ in 0..20 {
            let (_dir, root) = root();
            let over = AtomicBool::new(false);
            std::thread::scope(|scope| {
                for maker in 0..4 {
                    let (root, over) = (&root, &over);
                    scope.spawn(move || {
                        let removal_lock = RemovalLock::of(root);
                        for number in 0.. {
                            let inside = removal_lock.as_ref().ok().and_then(|it| it.enter().ok());
                            // iceoryx2 does the same.
                            if inside.is_some() {
                                fs::create_dir_all(root.join("nodes")).unwrap();
                                fs::write(root.join(format!("nodes/{maker}-{number}")), "")
                                    .unwrap();
                            }
                            if inside.is_none() && over.load(Ordering::Relaxed) {
                                return;
                            }
                        }
                    });
                }
                std::thread::sleep(Duration::from_millis(3));
                lock_and_remove(&root).unwrap();
                std::thread::sleep(Duration::from_millis(2));
                over.store(true, Ordering::Relaxed);
            });
            assert!(!root.exists());
        }
    }
}
