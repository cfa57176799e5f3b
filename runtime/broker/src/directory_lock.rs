//! Who has a directory: the state, the results and the gate of a broker are each nobody else's
//! while it runs.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use qcbus_disk::trust::{self, TrustError};
use qcbus_messages::path_text::to_text;

/// What a directory is to the one who has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A broker's journal lies there.
    State,
    /// Results are written there.
    Results,
    /// Accepted files are published there.
    Gate,
}

impl Purpose {
    fn as_str(self) -> &'static str {
        match self {
            Purpose::State => "the state",
            Purpose::Results => "the directory of results",
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

    /// Name of the file in which the holder says who it is. It stays when nobody holds anything.
    fn file(self) -> &'static str {
        match self {
            Purpose::State => "lock",
            Purpose::Results => ".qcbus/results",
            Purpose::Gate => GATE_FILE,
        }
    }
}

/// Name of the file that tells a gate from any other directory.
pub const GATE_FILE: &str = ".qcbus-gate";

/// Why a directory cannot be had, with the way out.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// A broker has it.
    #[error(
        "{} is {} of another broker that runs ({holder}); stop that one with `qcbus down`, or give this one {}",
        to_text(directory), purpose.as_str(), purpose.way_out()
    )]
    Taken {
        /// The directory.
        directory: PathBuf,
        /// What it is to that broker.
        purpose: Purpose,
        /// Who.
        holder: String,
    },
    /// Runs of `qcbus check` write into it.
    #[error(
        "`qcbus check` is writing results into {}; wait for its end, or choose another directory with --out",
        to_text(directory)
    )]
    Shared {
        /// The directory.
        directory: PathBuf,
    },
    /// It cannot be taken.
    #[error("cannot write {}: {source}; choose {}", to_text(path), purpose.way_out())]
    Unusable {
        /// The directory, or the file in it.
        path: PathBuf,
        /// What it was to be.
        purpose: Purpose,
        /// What the system says.
        source: io::Error,
    },
}

/// A directory that is ours until this is dropped, or the process ends in whatever way.
#[derive(Debug)]
pub struct DirectoryLock {
    locked: Mutex<Locked>,
    directory: PathBuf,
    purpose: Purpose,
    /// The instance that has the directory alone; `None` when runs of `check` share it.
    instance: Option<String>,
    /// The directory, if it was made for this and is to go with it as long as it is empty.
    made: Option<PathBuf>,
}

/// What is open as long as a directory is ours.
#[derive(Debug)]
struct Locked {
    file: File,
    /// The directory itself, open so that none that is made later gets its inode. `None` where it cannot be opened.
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
    /// Takes a directory for the broker of an instance alone.
    ///
    /// # Errors
    /// [`LockError`]; each says what to do.
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

    /// Takes a directory of results together with others that do the same: runs of `check`.
    ///
    /// # Errors
    /// [`LockError`]; each says what to do.
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

    /// Makes sure that this is the lock of the directory that lies there now. Somebody may have removed the directory,
    /// or put another one in its place: that one is taken then, and made if there is none.
    ///
    /// # Errors
    /// When it cannot be taken, because another broker has it. Nothing may be written to it or removed from it then.
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

    /// Whether the directory that was taken lies there still.
    pub fn is_in_place(&self) -> bool {
        is_in_place(
            &self.locked().file,
            &locked_at(&self.directory, self.purpose),
        )
    }

    /// Whether the very directory that was taken lies there still, and its lock file was removed from it.
    pub fn has_lost_its_file(&self) -> bool {
        let locked = self.locked();
        let directory = locked.directory.as_ref();
        directory.is_some_and(|it| is_in_place(it, &self.directory))
            && !is_in_place(&locked.file, &locked_at(&self.directory, self.purpose))
    }

    /// The directory.
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
    // Only with the lock in hand: of two brokers that start at the same time, one at least sees the other.
    if purpose != Purpose::State {
        is_free_above(directory, purpose)?;
        is_free_below(directory)?;
    }
    // Only for whoever is refused: on a full disk the lock holds without it.
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

/// Whether the file that is locked lies at a path. Where nothing can be told, it does: a write there fails by itself.
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
        // It stays when there is anything in it, or somebody else uses it.
        if let Some(made) = &self.made
            && self.locked().file.try_lock().is_ok()
        {
            let _ = std::fs::remove_dir(made);
        }
        // A process that is being started at this moment has the descriptor, too, until it runs its program.
        let _ = self.locked().file.unlock();
    }
}

/// What is locked. Of results that is the directory itself: locking must not need any room, and
/// must leave nothing behind.
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

/// No broker may have a directory above, or this one as something else: what lies below is its
/// results, too, or what it has not published and removes.
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

/// No broker may have a directory below: it would be one of two that write its results, or would be cleared as a
/// part of the gate.
fn is_free_below(directory: &Path) -> Result<(), LockError> {
    let mut open = vec![directory.to_path_buf()];
    while let Some(next) = open.pop() {
        if next != directory {
            is_free(&next, Purpose::Results)?;
            is_free(&next, Purpose::Gate)?;
        }
        // A directory that cannot be looked into holds nothing of ours either.
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

/// A file system without locks is no reason to refuse the work.
fn without_locks(directory: &Path, error: &io::Error) {
    let directory = to_text(directory);
    tracing::warn!("cannot lock {directory}, see to it that nobody else uses it: {error}");
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
        // Whoever cannot be asked has not said.
        let _ = file.read_to_string(&mut text);
    }
    let holder = match text.trim().split_once(' ') {
        Some((pid, instance)) => format!("instance `{instance}`, process {pid}"),
        None => "it has not said which".to_owned(),
    };
    LockError::Taken {
        directory,
        purpose,
        holder,
    }
}

/// What is to be said of those directories into which others may write. Many want it so, and it has a price.
pub fn open_to_others<'p>(
    directories: impl Iterator<Item = &'p Path>,
) -> impl Iterator<Item = String> {
    directories.filter_map(|directory| match trust::directory(directory) {
        Err(error @ TrustError::Foreign { .. }) => Some(format!(
            "{} is not ours alone: what lies there is not ours for certain, and whoever may write there can have us \
             write elsewhere: {error}",
            to_text(directory)
        )),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_has_it_and_says_who() {
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
    fn replaced_directory_is_taken_unless_another_broker_has_it() {
        for purpose in [Purpose::State, Purpose::Results, Purpose::Gate] {
            let dir = tempfile::tempdir().unwrap();
            let (place, aside) = (dir.path().join("place"), dir.path().join("aside"));
            let first = DirectoryLock::take(&place, purpose, "first").unwrap();
            first.hold().unwrap();
            assert!(first.is_in_place());
            std::fs::rename(&place, &aside).unwrap();
            assert!(!first.is_in_place());
            first.hold().unwrap();
            assert!(first.is_in_place(), "it is made and taken");
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
    fn runs_share_results_and_a_broker_does_not() {
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
        assert!(!nothing.exists(), "nothing was written");
    }

    #[test]
    fn nobody_gets_a_directory_below_or_above_one_of_another_broker() {
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
            assert!(state.is_ok(), "a broker's state lies below its results");
            let in_both = DirectoryLock::share(dir.path());
            assert!(in_both.is_err(), "results of a check behind a gate");
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
