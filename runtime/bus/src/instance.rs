//! An instance: one runtime directory, one broker.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use qcbus_disk::trust::{self, TrustError};
use rustix::fs::{FlockOperation, flock};

const LOCK: &str = "lock";
const MAX_NAME: usize = 48;

/// Location where the broker of an instance and its peers find each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    dir: PathBuf,
    name: String,
}

/// Reason why an instance's directory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InstanceError {
    /// The name would lead out of the runtime directory or is ambiguous.
    #[error(
        "`{0}` is not a valid instance name: use up to {MAX_NAME} letters, digits, `.`, `_`, `-`, not beginning \
         with `.`"
    )]
    BadName(String),
    /// The directory belongs to another user, who could read and replace its content.
    #[error(
        "cannot use the runtime directory: {0}; or set XDG_RUNTIME_DIR to a directory of your own"
    )]
    NotOurs(TrustError),
    /// The directory cannot be created.
    #[error("cannot use the runtime directory {}: {source}", dir.display())]
    Io {
        /// The directory.
        dir: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

impl Instance {
    /// Returns the instance of this name: `$XDG_RUNTIME_DIR/qcbus/NAME`, or `qcbus-UID/NAME` in the
    /// directory for temporary files. Creates the directory, readable by its owner only.
    ///
    /// # Errors
    /// See [`InstanceError`].
    pub fn named(name: &str) -> Result<Instance, InstanceError> {
        let allowed = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        if name.is_empty()
            || name.len() > MAX_NAME
            || name.starts_with('.')
            || !name.chars().all(allowed)
        {
            return Err(InstanceError::BadName(name.to_owned()));
        }
        let dir = Instance::base_dir()?.join(name);
        private_dir(&dir)?;
        Ok(Instance {
            dir,
            name: name.to_owned(),
        })
    }

    /// Returns the directory of all named instances of this user and creates it if missing.
    pub(crate) fn base_dir() -> Result<PathBuf, InstanceError> {
        let base = match std::env::var_os("XDG_RUNTIME_DIR") {
            Some(dir) if Path::new(&dir).is_absolute() => Path::new(&dir).join("qcbus"),
            _ => private_temporary_dir(),
        };
        private_dir(&base)?;
        Ok(base)
    }

    /// Returns the instance in this directory. The broker creates the directory if it is missing.
    pub fn at(dir: PathBuf) -> Instance {
        let name = dir.file_name().map_or_else(
            || "default".into(),
            |name| name.to_string_lossy().into_owned(),
        );
        Instance { dir, name }
    }

    /// Returns the runtime directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Returns the name for display.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the process id of the broker that currently serves this instance, if there is one.
    pub fn broker_pid(&self) -> Option<u32> {
        let file = File::open(self.dir.join(LOCK)).ok()?;
        match flock(&file, FlockOperation::NonBlockingLockShared) {
            // The lock is free. (The lock taken here is released when `file` is closed.)
            Ok(()) => None,
            Err(_) => read_pid(&file),
        }
    }

    /// Creates the directory if it is missing. An existing one keeps its permissions, because a
    /// person may have chosen them. Other users must not be able to write to it.
    pub(crate) fn create_dir(&self) -> Result<(), InstanceError> {
        match trust::directory(&self.dir) {
            Ok(_) => Ok(()),
            Err(error) if error.is_absent() => private_dir(&self.dir),
            Err(error) => Err(error.into()),
        }
    }
}

/// Returns `qcbus-UID` in the directory for temporary files.
pub(crate) fn private_temporary_dir() -> PathBuf {
    let uid = rustix::process::getuid().as_raw();
    std::env::temp_dir().join(format!("qcbus-{uid}"))
}

/// Creates a directory that only this user can read, or restricts an existing one. A directory of
/// another user is left as it is.
pub(crate) fn private_dir(dir: &Path) -> Result<(), InstanceError> {
    trust::make_private_directory(dir)?;
    Ok(())
}

impl From<TrustError> for InstanceError {
    fn from(error: TrustError) -> Self {
        match error {
            TrustError::Io { path: dir, source } => InstanceError::Io { dir, source },
            foreign @ TrustError::Foreign { .. } => InstanceError::NotOurs(foreign),
        }
    }
}

/// The broker's lock on an instance. The kernel releases it when the process ends.
#[derive(Debug)]
pub(crate) struct InstanceLock {
    file: File,
    path: PathBuf,
}

/// Reason why the lock cannot be taken.
#[derive(Debug)]
pub(crate) enum LockError {
    Taken { pid: Option<u32> },
    Io(io::Error),
}

/// Attempts, two milliseconds apart, while the holder of the lock is alive.
const ATTEMPTS: u32 = 50;

/// Attempts when the holder is dead.
const ATTEMPTS_AFTER_A_DEATH: u32 = 2500;

impl InstanceLock {
    pub(crate) fn take(instance: &Instance) -> Result<InstanceLock, LockError> {
        let path = instance.dir.join(LOCK);
        // More than one attempt is needed: a process may briefly hold the lock to check it, and a
        // stopping broker removes the file. A broker killed while it started a child leaves its
        // lock with that child until the child executes its own program. This takes a while on a
        // busy machine, so there are many attempts when the holder is dead.
        let mut holder = None;
        for attempt in 0..ATTEMPTS_AFTER_A_DEATH {
            if attempt >= ATTEMPTS && holder.is_none_or(is_alive) {
                break;
            }
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(&path)
                .map_err(LockError::Io)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) if is_still_there(&file, &path) => {
                    file.set_len(0).map_err(LockError::Io)?;
                    write!(file, "{}", std::process::id()).map_err(LockError::Io)?;
                    return Ok(InstanceLock { file, path });
                }
                Ok(()) => continue,
                Err(rustix::io::Errno::WOULDBLOCK) => holder = read_pid(&file),
                Err(error) => return Err(LockError::Io(error.into())),
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        Err(LockError::Taken { pid: holder })
    }

    /// Checks whether the lock file by which others see the lock still exists.
    pub(crate) fn is_there(&self) -> bool {
        is_still_there(&self.file, &self.path)
    }

    /// Releases the instance and removes the lock file.
    pub(crate) fn release(self) {
        let _ = fs::remove_file(&self.path);
    }
}

fn is_alive(pid: u32) -> bool {
    Path::new("/proc").join(pid.to_string()).exists()
}

fn is_still_there(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(mapped_image), Ok(named)) => {
            (mapped_image.dev(), mapped_image.ino()) == (named.dev(), named.ino())
        }
        _ => false,
    }
}

fn read_pid(mut file: &File) -> Option<u32> {
    let mut text = String::new();
    file.rewind().ok()?;
    file.take(32).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::unlocked;

    #[test]
    fn invalid_instance_names_are_refused() {
        for name in [
            "",
            ".",
            "..",
            "a/b",
            "../x",
            ".hidden",
            "ä",
            &"x".repeat(49),
        ] {
            let refused = Instance::named(name);
            assert!(matches!(refused, Err(InstanceError::BadName(_))), "{name}");
        }
    }

    #[test]
    fn lock_is_free_again_after_crash_or_stop() {
        let dir = tempfile::TempDir::new().unwrap();
        let instance = Instance::at(dir.path().to_owned());
        let lock = InstanceLock::take(&instance).unwrap();
        assert_eq!(instance.broker_pid(), Some(std::process::id()));
        assert!(matches!(
            InstanceLock::take(&instance),
            Err(LockError::Taken { pid: Some(pid) }) if pid == std::process::id()
        ));
        // The file stays, as when a process dies.
        drop(lock);
        assert!(dir.path().join(LOCK).exists());
        unlocked("no broker runs", || instance.broker_pid().is_none());
        InstanceLock::take(&instance).unwrap().release();
        assert!(!dir.path().join(LOCK).exists());
    }
}
