//! The door of a generation: nobody makes a file in its shared memory while that is removed, or afterwards.
//!
//! A directory in which somebody makes a file cannot be removed, and iceoryx2 makes a directory that is missing
//! again, with all above it, for whoever makes a node or a port: a peer that came a moment too late would leave
//! shared memory behind of which no broker knows. So whoever may make files is inside of the door meanwhile, and
//! who removes the memory shuts it first. Both are locks of the kernel's: it opens them when a process dies.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::fs::{FlockOperation, flock};

/// Its name in the directory of a generation.
const REMOVAL_LOCK: &str = "removal-lock";
/// What is in it once nobody may enter any more: whoever has it open sees that, whatever has become of the file.
const LOCKED: &[u8] = b"locked";
/// And once nobody waits any longer for those who are inside.
const GONE: &[u8] = b"locked, gone";
/// A peer is inside for less than a millisecond at a time, unless it was stopped there. That one tidies up behind
/// itself when it goes on.
const OUT_WITHIN: Duration = Duration::from_secs(2);
/// Attempts at removing a directory in which somebody who was stopped makes files, or whose files go meanwhile.
const ATTEMPTS: usize = 50;

/// The way into the memory of a generation.
#[derive(Debug, Clone)]
pub(crate) struct RemovalLock {
    file: Arc<File>,
    root: PathBuf,
}

/// As long as this lives, the memory stays.
#[derive(Debug)]
pub(crate) struct Inside {
    removal_lock: RemovalLock,
}

/// Why nobody comes in.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoEntry {
    /// The broker goes, or has gone.
    #[error("the broker is about to end, or somebody has removed its shared memory")]
    Locked,
    /// It may be open: this process cannot use it.
    #[error("cannot use the shared memory of the broker in {root}: {source}")]
    Failed { root: PathBuf, source: io::Error },
}

impl NoEntry {
    fn of(root: &Path, source: io::Error) -> NoEntry {
        match source.kind() {
            // Somebody who has locked it is about to shut it.
            io::ErrorKind::NotFound | io::ErrorKind::WouldBlock => NoEntry::Locked,
            _ => NoEntry::Failed {
                root: root.to_path_buf(),
                source,
            },
        }
    }
}

/// Gives a generation its door.
///
/// # Errors
/// What the system says.
pub(crate) fn make(root: &Path) -> io::Result<()> {
    let mut how = File::options();
    let how = how.write(true).create_new(true).mode(0o600);
    how.open(root.join(REMOVAL_LOCK)).map(|_| ())
}

impl RemovalLock {
    /// The door of a generation that is there.
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

    /// Goes in for a moment. Of one door one at a time is inside: the kernel does not count locks of one file.
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
    /// The directory of the generation.
    pub(crate) fn root(&self) -> &Path {
        &self.removal_lock.root
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        // It did not come out in time: what it made since then is nobody's.
        if self.removal_lock.says_at_least(GONE) {
            let _ = remove(&self.removal_lock.root);
        }
        let _ = flock(&self.removal_lock.file, FlockOperation::Unlock);
    }
}

/// Shuts the door of a generation for good and removes its memory. What peers have mapped stays readable for them.
///
/// # Errors
/// What the system says; then something of it is still there.
pub(crate) fn lock_and_remove(root: &Path) -> io::Result<()> {
    let _locked = lock_for_removal(root);
    remove(root)
}

/// Waits until nobody is inside, but not for ever. `None`: it has no door, or none that we can shut.
fn lock_for_removal(root: &Path) -> Option<File> {
    let mut how = File::options();
    let how = how.write(true).custom_flags(libc::O_NOFOLLOW);
    let file = how.open(root.join(REMOVAL_LOCK)).ok()?;
    // First, or those who come and go would keep it open.
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
            // Not: one of its files. Those may be removed by whoever made them.
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
    fn nobody_enters_what_is_removed() {
        let (_dir, root) = root();
        let early = RemovalLock::of(&root).unwrap();
        drop(early.enter().unwrap());
        lock_and_remove(&root).unwrap();
        assert!(!root.exists());
        assert!(matches!(early.enter(), Err(NoEntry::Locked)));
        assert!(matches!(RemovalLock::of(&root), Err(NoEntry::Locked)));
    }

    #[test]
    fn what_cannot_be_opened_is_not_said_to_be_shut() {
        let (_dir, root) = root();
        fs::remove_file(root.join(REMOVAL_LOCK)).unwrap();
        std::os::unix::fs::symlink("elsewhere", root.join(REMOVAL_LOCK)).unwrap();
        let refused = RemovalLock::of(&root).unwrap_err().to_string();
        assert!(refused.contains("symbolic links"), "{refused}");
        assert!(!refused.contains("about to end"), "{refused}");
    }

    #[test]
    fn what_is_removed_waits_for_whoever_is_inside() {
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
    fn who_was_stopped_inside_removes_what_it_made_too_late() {
        let (_dir, root) = root();
        let inside = RemovalLock::of(&root).unwrap().enter().unwrap();
        lock_and_remove(&root).unwrap();
        assert!(!root.exists(), "it does not wait for ever");
        fs::create_dir(&root).unwrap();
        fs::write(root.join("node"), "made too late").unwrap();
        drop(inside);
        assert!(!root.exists());
    }

    #[test]
    fn it_goes_under_the_hands_of_many() {
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
                            // As iceoryx2 does.
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
