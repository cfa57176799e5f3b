//! An instance: one runtime directory, one broker.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use qcbus_disk::trust::{self, TrustError};
use rustix::fs::{FlockOperation, flock};

const LOCK: &str = "lock";
const MAX_NAME: usize = 48;

/// Where the broker of an instance and its peers find each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instance {
    dir: PathBuf,
    name: String,
}

/// Why an instance's directory cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InstanceError {
    /// The name would leave the runtime directory, or cannot be told from another.
    #[error(
        "`{0}` is no name of an instance: use up to {MAX_NAME} letters, digits, `.`, `_`, `-`, not beginning with `.`"
    )]
    BadName(String),
    /// The directory belongs to somebody else, who could read and replace what is in it.
    #[error("no runtime directory: {0}; or set XDG_RUNTIME_DIR to a directory of your own")]
    NotOurs(TrustError),
    /// The directory cannot be made.
    #[error("cannot use the runtime directory {}: {source}", dir.display())]
    Io {
        /// The directory.
        dir: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

impl Instance {
    /// The instance of this name: `$XDG_RUNTIME_DIR/qcbus/NAME`, or `qcbus-UID/NAME` in the
    /// directory for temporary files. The directory is made, readable by its owner only.
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

    /// The directory of all named instances of this user; made when it is missing.
    pub(crate) fn base_dir() -> Result<PathBuf, InstanceError> {
        let base = match std::env::var_os("XDG_RUNTIME_DIR") {
            Some(dir) if Path::new(&dir).is_absolute() => Path::new(&dir).join("qcbus"),
            _ => private_temporary_dir(),
        };
        private_dir(&base)?;
        Ok(base)
    }

    /// The instance in this directory, which the broker makes when it is missing.
    pub fn at(dir: PathBuf) -> Instance {
        let name = dir.file_name().map_or_else(
            || "default".into(),
            |name| name.to_string_lossy().into_owned(),
        );
        Instance { dir, name }
    }

    /// The runtime directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// The name, for people.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Process id of the broker that serves this instance at the moment, if one does.
    pub fn broker_pid(&self) -> Option<u32> {
        let file = File::open(self.dir.join(LOCK)).ok()?;
        match flock(&file, FlockOperation::NonBlockingLockShared) {
            // Free: nobody holds it. (Ours is released when `file` is closed.)
            Ok(()) => None,
            Err(_) => read_pid(&file),
        }
    }

    /// Makes the directory when it is missing. One that is there keeps its permissions: it may
    /// have been chosen by a person. Nobody else may write to it.
    pub(crate) fn create_dir(&self) -> Result<(), InstanceError> {
        match trust::directory(&self.dir) {
            Ok(_) => Ok(()),
            Err(error) if error.is_absent() => private_dir(&self.dir),
            Err(error) => Err(error.into()),
        }
    }
}

/// `qcbus-UID` in the directory for temporary files.
pub(crate) fn private_temporary_dir() -> PathBuf {
    let uid = rustix::process::getuid().as_raw();
    std::env::temp_dir().join(format!("qcbus-{uid}"))
}

/// Makes a directory that only we can read, or sees to it that it is one. What is not ours is left as
/// it is.
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

/// The broker's claim on an instance; released by the kernel when the process ends.
#[derive(Debug)]
pub(crate) struct InstanceLock {
    file: File,
    path: PathBuf,
}

/// Why the claim failed.
#[derive(Debug)]
pub(crate) enum LockError {
    Taken { pid: Option<u32> },
    Io(io::Error),
}

/// Attempts, two milliseconds apart, while the holder of the lock lives.
const ATTEMPTS: u32 = 50;

/// Attempts when the holder is dead.
const ATTEMPTS_AFTER_A_DEATH: u32 = 2500;

impl InstanceLock {
    pub(crate) fn take(instance: &Instance) -> Result<InstanceLock, LockError> {
        let path = instance.dir.join(LOCK);
        // Somebody may hold the lock for a moment to look whether it is free, and a broker that
        // stops removes the file; hence more than one attempt. A broker that was killed while it
        // started a child has left its lock with that child until the child is a program of its
        // own, which takes a while on a busy machine; hence many attempts when the holder is dead.
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

    /// Whether the file is there by which others see the claim.
    pub(crate) fn is_there(&self) -> bool {
        is_still_there(&self.file, &self.path)
    }

    /// Gives the instance up and leaves no file behind.
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

    #[test]
    fn names_that_leave_the_directory_are_refused() {
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
    fn a_lock_is_free_again_after_a_crash_and_after_a_stop() {
        let dir = tempfile::TempDir::new().unwrap();
        let instance = Instance::at(dir.path().to_owned());
        let lock = InstanceLock::take(&instance).unwrap();
        assert_eq!(instance.broker_pid(), Some(std::process::id()));
        assert!(matches!(
            InstanceLock::take(&instance),
            Err(LockError::Taken { pid: Some(pid) }) if pid == std::process::id()
        ));
        // As the kernel does when a process dies: the file stays.
        drop(lock);
        assert!(dir.path().join(LOCK).exists());
        assert_eq!(instance.broker_pid(), None);
        InstanceLock::take(&instance).unwrap().release();
        assert!(!dir.path().join(LOCK).exists());
    }
}
