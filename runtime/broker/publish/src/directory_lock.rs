//! Directory locks: while a broker runs, its state, results and gate directories belong to it alone.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use qcbus_disk::trust::{self, TrustError};
use qcbus_messages::path_text::to_text;

/// Purpose of a directory for its owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// It contains the journal of a broker.
    State,
    /// It contains results.
    Results,
    /// It contains published accepted files.
    Gate,
}

impl Purpose {
    fn as_str(self) -> &'static str {
        match self {
            Purpose::State => "the state directory",
            Purpose::Results => "the results directory",
            Purpose::Gate => "the gate",
        }
    }

    fn way_out(self) -> &'static str {
        match self {
            Purpose::State => "another directory with --out or --state",
            Purpose::Results => "another directory with --out",
            Purpose::Gate => "another directory with --gate",
        }
    }

    /// Returns the name of the file that identifies the owner. The file remains when the directory is released.
    fn file(self) -> &'static str {
        match self {
            Purpose::State => "lock",
            Purpose::Results => ".qcbus/results",
            Purpose::Gate => GATE_FILE,
        }
    }
}

/// Name of the file that distinguishes a gate from other directories.
pub const GATE_FILE: &str = ".qcbus-gate";

/// Reason why a directory cannot be locked, with a remedy.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another broker has locked it.
    #[error(
        "{} is {} of another running broker ({holder}); stop that broker with `qcbus down`, or choose {}",
        to_text(directory), purpose.as_str(), purpose.way_out()
    )]
    Taken {
        /// The directory.
        directory: PathBuf,
        /// Its purpose for that broker.
        purpose: Purpose,
        /// The owner.
        holder: String,
    },
    /// Runs of `qcbus check` write into it.
    #[error(
        "`qcbus check` is writing results into {}; wait until it ends, or choose another directory with --out",
        to_text(directory)
    )]
    Shared {
        /// The directory.
        directory: PathBuf,
    },
    /// The directory cannot be used.
    #[error("cannot write {}: {source}; choose {}", to_text(path), purpose.way_out())]
    Unusable {
        /// The directory, or the file in it.
        path: PathBuf,
        /// Its intended purpose.
        purpose: Purpose,
        /// Error of the system.
        source: io::Error,
    },
}

/// Lock of a directory. It lasts until this value is dropped or the process ends.
#[derive(Debug)]
pub struct DirectoryLock {
    locked: Mutex<Locked>,
    directory: PathBuf,
    purpose: Purpose,
    /// The instance that owns the directory alone. `None` if runs of `check` share it.
    instance: Option<String>,
    /// The directory if it was created for this lock. It is removed with the lock if it is empty.
    made: Option<PathBuf>,
}

/// Files that are open as long as the directory is locked.
#[derive(Debug)]
struct Locked {
    file: File,
    /// The directory itself. It stays open so that no later directory gets its inode. `None` if it cannot be opened.
    directory: Option<File>,
}

impl Locked {
    fn new(file: File, directory: &Path) -> Locked {
        Locked {
            file,
            directory: File::open(directory).ok(),
        }
    }
}

impl DirectoryLock {
    /// Locks a directory for the broker of one instance.
    ///
    /// # Errors
    /// [`LockError`], each with a remedy.
    pub fn take(
        directory: &Path,
        purpose: Purpose,
        instance: &str,
    ) -> Result<DirectoryLock, LockError> {
        Ok(DirectoryLock {
            locked: Mutex::new(Locked::new(
                lock_alone(directory, purpose, instance)?,
                directory,
            )),
            directory: directory.to_path_buf(),
            purpose,
            instance: Some(instance.to_owned()),
            made: None,
        })
    }

    /// Locks a results directory together with other runs of `check`.
    ///
    /// # Errors
    /// [`LockError`], each with a remedy.
    pub fn share(directory: &Path) -> Result<DirectoryLock, LockError> {
        let made = (!directory.exists()).then(|| directory.to_path_buf());
        Ok(DirectoryLock {
            locked: Mutex::new(Locked::new(lock_shared(directory)?, directory)),
            directory: directory.to_path_buf(),
            purpose: Purpose::Results,
            instance: None,
            made,
        })
    }

    /// Makes sure that this lock belongs to the directory that exists now. Another process may have
    /// removed or replaced the directory. Then the new directory is locked, and created if
    /// necessary.
    ///
    /// # Errors
    /// Returns an error if another broker has locked it. In this case no file in it may be written
    /// or removed.
    pub fn hold(&self) -> Result<(), LockError> {
        let mut locked = self.locked();
        if is_in_place(&locked.file, &locked_at(&self.directory, self.purpose)) {
            return Ok(());
        }
        let file = match &self.instance {
            Some(instance) => lock_alone(&self.directory, self.purpose, instance)?,
            None => lock_shared(&self.directory)?,
        };
        *locked = Locked::new(file, &self.directory);
        Ok(())
    }

    /// Checks whether the locked directory still exists at its path.
    pub fn is_in_place(&self) -> bool {
        is_in_place(
            &self.locked().file,
            &locked_at(&self.directory, self.purpose),
        )
    }

    /// Checks whether the locked directory still exists at its path but its lock file was removed.
    pub fn has_lost_its_file(&self) -> bool {
        let locked = self.locked();
        let directory = locked.directory.as_ref();
        directory.is_some_and(|it| is_in_place(it, &self.directory))
            && !is_in_place(&locked.file, &locked_at(&self.directory, self.purpose))
    }

    /// Returns the directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    fn locked(&self) -> MutexGuard<'_, Locked> {
        self.locked.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn lock_alone(directory: &Path, purpose: Purpose, instance: &str) -> Result<File, LockError> {
    let mut file = open(directory, purpose)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(refusal(&mut file, directory, purpose)),
        Err(TryLockError::Error(error)) => without_locks(directory, &error),
    }
    // The check needs the lock: of two brokers that start at the same time, at least one sees the other.
    if purpose != Purpose::State {
        is_free_above(directory, purpose)?;
        is_free_below(directory)?;
    }
    // The error is ignored, because the text is only for rejected brokers. On a full disk the lock
    // is valid without it.
    let _ = introduce(&mut file, directory, purpose, instance);
    Ok(file)
}

fn lock_shared(directory: &Path) -> Result<File, LockError> {
    let mut file = open(directory, Purpose::Results)?;
    is_free_above(directory, Purpose::Results)?;
    match file.try_lock_shared() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(refusal(&mut file, directory, Purpose::Results));
        }
        Err(TryLockError::Error(error)) => without_locks(directory, &error),
    }
    Ok(file)
}

/// Checks whether the locked file exists at a path. If this cannot be determined, the answer is
/// yes, because a write there fails by itself.
fn is_in_place(file: &File, path: &Path) -> bool {
    let identity = |data: std::fs::Metadata| (data.dev(), data.ino());
    match (
        file.metadata().map(identity),
        std::fs::metadata(path).map(identity),
    ) {
        (Ok(locked), Ok(there)) => locked == there,
        (_, Err(error)) => error.kind() != io::ErrorKind::NotFound,
        (Err(_), Ok(_)) => true,
    }
}

impl Drop for DirectoryLock {
    fn drop(&mut self) {
        // The directory stays if it is not empty or if another process uses it.
        if let Some(made) = &self.made
            && self.locked().file.try_lock().is_ok()
        {
            let _ = std::fs::remove_dir(made);
        }
        // The unlock is explicit, because a starting process also has the descriptor until it executes its program.
        let _ = self.locked().file.unlock();
    }
}

/// Returns the path that is locked. For results it is the directory itself, because locking must
/// not need disk space or leave a file.
fn locked_at(directory: &Path, purpose: Purpose) -> PathBuf {
    match purpose {
        Purpose::Results => directory.to_path_buf(),
        Purpose::State | Purpose::Gate => directory.join(purpose.file()),
    }
}

fn open(directory: &Path, purpose: Purpose) -> Result<File, LockError> {
    let fail = |path: &Path, source| LockError::Unusable {
        path: path.to_path_buf(),
        purpose,
        source,
    };
    std::fs::create_dir_all(directory).map_err(|source| fail(directory, source))?;
    let path = locked_at(directory, purpose);
    if purpose == Purpose::Results {
        return File::open(&path).map_err(|source| fail(&path, source));
    }
    OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(&path)
        .map_err(|source| fail(&path, source))
}

/// Checks that no broker owns a parent directory, or this directory for another purpose. Otherwise
/// its files would be results of that broker, or the gate would remove them as unpublished.
fn is_free_above(directory: &Path, wanted: Purpose) -> Result<(), LockError> {
    for above in directory.ancestors() {
        for purpose in [Purpose::Results, Purpose::Gate] {
            if above != directory || purpose != wanted {
                is_free(above, purpose)?;
            }
        }
    }
    Ok(())
}

/// Checks that no broker owns a subdirectory. Otherwise two brokers would write its results, or it
/// would be cleared as a part of the gate.
fn is_free_below(directory: &Path) -> Result<(), LockError> {
    let mut open = vec![directory.to_path_buf()];
    while let Some(next) = open.pop() {
        if next != directory {
            is_free(&next, Purpose::Results)?;
            is_free(&next, Purpose::Gate)?;
        }
        // A directory that cannot be read contains no locked directory either.
        let entries = std::fs::read_dir(&next).into_iter().flatten().flatten();
        let below = entries.filter(|it| it.file_type().is_ok_and(|it| it.is_dir()));
        open.extend(below.map(|it| it.path()));
    }
    Ok(())
}

fn is_free(directory: &Path, purpose: Purpose) -> Result<(), LockError> {
    // A lock file that cannot be opened has no living broker behind it.
    let Ok(mut file) = File::open(locked_at(directory, purpose)) else {
        return Ok(());
    };
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Err(refusal(&mut file, directory, purpose)),
        _ => Ok(()),
    }
}

/// Warns that a file system has no locks. This is no reason to refuse the work.
fn without_locks(directory: &Path, error: &io::Error) {
    let directory = to_text(directory);
    tracing::warn!("cannot lock {directory}: {error}; make sure that no other process uses it");
}

fn introduce(
    file: &mut File,
    directory: &Path,
    purpose: Purpose,
    instance: &str,
) -> io::Result<()> {
    let text = format!("{} {instance}\n", std::process::id());
    if purpose == Purpose::Results {
        let path = directory.join(purpose.file());
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        return std::fs::write(path, text);
    }
    file.set_len(0)?;
    file.write_all(text.as_bytes())
}

fn refusal(file: &mut File, directory: &Path, purpose: Purpose) -> LockError {
    let directory = directory.to_path_buf();
    if purpose == Purpose::Results && file.try_lock_shared().is_ok() {
        return LockError::Shared { directory };
    }
    let mut text = String::new();
    if purpose == Purpose::Results {
        text = std::fs::read_to_string(directory.join(purpose.file())).unwrap_or_default();
    } else {
        // If the file cannot be read, the owner stays unknown.
        let _ = file.read_to_string(&mut text);
    }
    let holder = match text.trim().split_once(' ') {
        Some((pid, instance)) => format!("instance `{instance}`, process {pid}"),
        None => "unknown instance".to_owned(),
    };
    LockError::Taken {
        directory,
        purpose,
        holder,
    }
}

/// Returns warnings about directories that other users may write to. This is often intended, but it has risks.
pub fn open_to_others<'p>(
    directories: impl Iterator<Item = &'p Path>,
) -> impl Iterator<Item = String> {
    directories.filter_map(|directory| match trust::directory(directory) {
        Err(error @ TrustError::Foreign { .. }) => Some(format!(
            "{} is not under this user's sole control: its files cannot be trusted, and other users can redirect \
             what this broker writes: {error}",
            to_text(directory)
        )),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_directory_is_refused_with_name_of_holder() {
        for purpose in [Purpose::State, Purpose::Results, Purpose::Gate] {
            let dir = tempfile::tempdir().unwrap();
            let take = |instance| DirectoryLock::take(dir.path(), purpose, instance);
            let first = take("first").unwrap();
            let refused = take("second").unwrap_err().to_string();
            let holder = format!("instance `first`, process {}", std::process::id());
            assert!(refused.contains(&holder), "{refused}");
            drop(first);
            let _second = take("second").unwrap();
            let refused = take("third").unwrap_err().to_string();
            assert!(refused.contains("instance `second`"), "{refused}");
        }
    }

    #[test]
    fn replaced_directory_is_taken_unless_held_by_another() {
        for purpose in [Purpose::State, Purpose::Results, Purpose::Gate] {
            let dir = tempfile::tempdir().unwrap();
            let (place, aside) = (dir.path().join("place"), dir.path().join("aside"));
            let first = DirectoryLock::take(&place, purpose, "first").unwrap();
            first.hold().unwrap();
            assert!(first.is_in_place());
            std::fs::rename(&place, &aside).unwrap();
            assert!(!first.is_in_place());
            first.hold().unwrap();
            assert!(
                first.is_in_place(),
                "the directory is created and locked again"
            );
            let second = DirectoryLock::take(&place, purpose, "second");
            assert!(matches!(second, Err(LockError::Taken { .. })));
            std::fs::remove_dir_all(&place).unwrap();
            let second = DirectoryLock::take(&place, purpose, "second").unwrap();
            let refused = first.hold().unwrap_err().to_string();
            assert!(refused.contains("instance `second`"), "{refused}");
            drop(second);
            first.hold().unwrap();
        }
    }

    #[test]
    fn runs_share_results_directory_but_broker_does_not() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let broker = || DirectoryLock::take(&out, Purpose::Results, "farm");
        let one = DirectoryLock::share(&out).unwrap();
        let other = DirectoryLock::share(&out).unwrap();
        assert!(matches!(broker(), Err(LockError::Shared { .. })));
        drop(one);
        assert!(matches!(broker(), Err(LockError::Shared { .. })));
        drop(other);
        let held = broker().unwrap();
        let refused = DirectoryLock::share(&out).unwrap_err().to_string();
        assert!(refused.contains("instance `farm`"), "{refused}");
        drop(held);
        drop(DirectoryLock::share(&out).unwrap());
        let nothing = dir.path().join("nothing");
        drop(DirectoryLock::share(&nothing).unwrap());
        assert!(!nothing.exists(), "nothing is created");
    }

    #[test]
    fn directory_nested_in_held_directory_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let below = dir.path().join("maps/new");
        for held in [Purpose::Results, Purpose::Gate] {
            let lock = DirectoryLock::take(dir.path(), held, "first").unwrap();
            for wanted in [Purpose::Results, Purpose::Gate] {
                let refused = DirectoryLock::take(&below, wanted, "second").unwrap_err();
                assert!(
                    refused.to_string().contains("instance `first`"),
                    "{refused}"
                );
            }
            assert!(DirectoryLock::share(&below).is_err());
            let state = DirectoryLock::take(&below, Purpose::State, "first");
            assert!(
                state.is_ok(),
                "the state of a broker may be below its results"
            );
            let in_both = DirectoryLock::share(dir.path());
            assert!(in_both.is_err(), "results of a check must not be in a gate");
            drop(lock);
            let second = DirectoryLock::take(&below, held, "second").unwrap();
            for wanted in [Purpose::Results, Purpose::Gate] {
                let refused = DirectoryLock::take(dir.path(), wanted, "first").unwrap_err();
                assert!(
                    refused.to_string().contains("instance `second`"),
                    "{refused}"
                );
            }
            drop(second);
            assert!(DirectoryLock::take(dir.path(), held, "first").is_ok());
        }
    }
}
