//! Generations: every start of a broker gets names that were never used before.
//!
//! With stable names, a broker killed in its first milliseconds can leave a service behind that can
//! never be opened again. Dead entries also accumulate. So each start has its own prefix and its
//! own directory. `current` names them, and the remains of older generations are unlinked.

use std::collections::hash_map::RandomState;
use std::fs::{self, File};
use std::hash::BuildHasher;
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use qcbus_messages::PROTOCOL_VERSION;
use qcbus_messages::services::Limits;
use rustix::fs::{FlockOperation, flock};
use serde::{Deserialize, Serialize};

use crate::instance::Instance;
use crate::memory::SHARED_MEMORY;
use crate::options::StartError;
use crate::ports::ICEORYX2_VERSION;
use crate::process::{Process, start_time};
use crate::removal_lock;

const CURRENT: &str = "current";
const IDENTITY: &str = "id";
/// File in the shared memory that a living broker keeps locked.
const LIFE: &str = "broker";
/// Name of that file until it is locked.
const UNNAMED_LIFE: &str = "broker.new";
/// Length of the identity in bytes.
const IDENTITY_LEN: usize = 18;
/// Age from which unlocked shared memory counts as stale. A broker locks its memory within
/// microseconds of creating it, unless it is stopped in between.
const UNLOCKED_FOR: Duration = Duration::from_secs(60);
/// Number of names that are tried for the root directory. Each name is random.
const ATTEMPTS: usize = 16;

/// Description of a generation that a broker writes for its peers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Generation {
    pub(crate) number: u64,
    pub(crate) prefix: String,
    pub(crate) root: PathBuf,
    pub(crate) protocol: u32,
    pub(crate) iceoryx2: String,
    pub(crate) pid: u32,
    pub(crate) pid_started: Option<u64>,
    pub(crate) limits: Limits,
}

impl Generation {
    /// Returns the current generation, or `None` if there is none or it cannot be read.
    pub(crate) fn current(instance: &Instance) -> Option<Generation> {
        let text = fs::read(instance.dir().join(CURRENT)).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Returns the broker that wrote this, if it still runs.
    pub(crate) fn broker(&self) -> Option<Process> {
        Process::open(self.pid, self.pid_started)
    }

    /// Creates a new, unannounced generation. The caller must hold the instance's lock.
    pub(crate) fn begin(instance: &Instance, limits: Limits) -> Result<Generation, StartError> {
        // A broker that is killed while it writes one of its files leaves these behind.
        for name in names_in(instance.dir()) {
            if name.starts_with(".tmp") {
                let _ = fs::remove_file(instance.dir().join(name));
            }
        }
        let identity = identity(instance)?;
        let number = last_number(instance) + 1;
        let dir = instance.dir().join(format!("g{number}"));
        let _ = fs::remove_dir_all(&dir);
        fs::DirBuilder::new().mode(0o700).create(&dir)?;
        let prefix = format!("{identity}{number:x}_");
        let root = root_in_memory(&prefix).map_err(StartError::shared_memory)?;
        removal_lock::make(&root).map_err(StartError::shared_memory)?;
        Ok(Generation {
            number,
            prefix,
            root,
            protocol: PROTOCOL_VERSION,
            iceoryx2: ICEORYX2_VERSION.to_owned(),
            pid: std::process::id(),
            pid_started: start_time(std::process::id()),
            limits,
        })
    }

    /// Protects its shared memory from [`sweep_strays`] while the returned file is open. The file
    /// gets its final name after it is locked. Otherwise another start would take it for that of a
    /// dead broker and remove the memory.
    pub(crate) fn lock_memory(&self) -> io::Result<File> {
        lock_life(&self.root, || {})
    }

    /// Makes this the current generation.
    pub(crate) fn announce(&self, instance: &Instance) -> io::Result<()> {
        let mut file = tempfile::NamedTempFile::new_in(instance.dir())?;
        file.write_all(&serde_json::to_vec(self)?)?;
        file.flush()?;
        file.persist(instance.dir().join(CURRENT))?;
        Ok(())
    }

    /// Restores files that were removed from the runtime directory. A file that another process has
    /// put in their place stays.
    pub(crate) fn restore(&self, instance: &Instance) -> io::Result<()> {
        if !instance.dir().join(IDENTITY).exists()
            && let Some(identity) = self.prefix.get(..IDENTITY_LEN)
        {
            write_identity(instance, identity)?;
        }
        let dir = instance.dir().join(format!("g{}", self.number));
        if !dir.exists() {
            fs::DirBuilder::new().mode(0o700).create(&dir)?;
        }
        if !instance.dir().join(CURRENT).exists() {
            tracing::warn!(
                "`{CURRENT}` was removed from the runtime directory; it was created again"
            );
            self.announce(instance)?;
        }
        Ok(())
    }

    /// Withdraws the generation, so that peers stop trying to join.
    pub(crate) fn withdraw(&self, instance: &Instance) {
        let _ = fs::remove_file(instance.dir().join(CURRENT));
    }
}

/// Unlinks everything of this instance, except the generation `keep`. The caller holds the
/// instance's lock, so only peers that leave or join can still use the files. Memory they have
/// mapped stays readable for them. Failures are logged, and a later broker of the instance tries
/// again.
pub(crate) fn sweep(instance: &Instance, keep: Option<&Generation>) {
    let Ok(identity) = identity(instance) else {
        return;
    };
    let mut all = true;
    for name in names_in(Path::new(SHARED_MEMORY)) {
        let path = Path::new(SHARED_MEMORY).join(&name);
        let kept = keep.is_some_and(|keep| keep.root == path);
        if !name.starts_with(&identity) || kept {
            continue;
        }
        let removed = match path.is_dir() {
            true => removal_lock::lock_and_remove(&path),
            // An older version put its segments there.
            false => fs::remove_file(&path),
        };
        if let Err(error) = removed {
            tracing::warn!(%error, "{} could not be removed and stays for now", path.display());
            all = false;
        }
    }
    for name in names_in(instance.dir()) {
        let kept = keep.is_some_and(|keep| name == format!("g{}", keep.number));
        let generation = name
            .strip_prefix('g')
            .is_some_and(|number| number.parse::<u64>().is_ok());
        if generation && !kept {
            let _ = fs::remove_dir_all(instance.dir().join(&name));
        }
    }
    if keep.is_none() && all {
        let _ = fs::remove_file(instance.dir().join(IDENTITY));
    }
}

/// Unlinks the remains of killed brokers if their runtime directory no longer exists.
pub(crate) fn sweep_strays() -> usize {
    let user = rustix::process::geteuid().as_raw();
    let is_own = |path: &Path| {
        let data = fs::symlink_metadata(path);
        data.is_ok_and(|data| data.is_dir() && data.uid() == user)
    };
    let is_ours = |name: &String| name.get(..IDENTITY_LEN).is_some_and(is_identity);
    let names = names_in(Path::new(SHARED_MEMORY)).into_iter();
    let roots = names
        .filter(is_ours)
        .map(|name| Path::new(SHARED_MEMORY).join(name));
    let strays = roots.filter(|root| is_own(root) && is_stray(root));
    strays
        .filter(|it| removal_lock::lock_and_remove(it).is_ok())
        .count()
}

/// Creates and locks the life file. `unlocked` is called between creating and locking.
fn lock_life(root: &Path, unlocked: impl FnOnce()) -> io::Result<File> {
    let path = root.join(UNNAMED_LIFE);
    let mut how = File::options();
    let how = how.write(true).create_new(true).mode(0o600);
    let file = how.open(&path)?;
    unlocked();
    flock(&file, FlockOperation::NonBlockingLockExclusive)?;
    fs::rename(&path, root.join(LIFE))?;
    Ok(file)
}

/// Checks whether no living broker owns this directory. The file is missing if a broker has not
/// locked its memory yet. It is also missing if a peer created the directory after the broker
/// stopped waiting.
fn is_stray(root: &Path) -> bool {
    match File::options().write(true).open(root.join(LIFE)) {
        Ok(file) => flock(&file, FlockOperation::NonBlockingLockExclusive).is_ok(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => is_old(root),
        Err(_) => false,
    }
}

fn is_old(root: &Path) -> bool {
    let changed = fs::metadata(root).and_then(|data| data.modified());
    let age = changed.ok().and_then(|it| it.elapsed().ok());
    age.is_some_and(|age| age >= UNLOCKED_FOR)
}

fn names_in(dir: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(dir) else {
        return Vec::new();
    };
    entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .collect()
}

fn last_number(instance: &Instance) -> u64 {
    let announced = Generation::current(instance).map_or(0, |generation| generation.number);
    let begun = names_in(instance.dir())
        .iter()
        .filter_map(|name| name.strip_prefix('g')?.parse().ok())
        .max();
    announced.max(begun.unwrap_or(0))
}

/// Returns the random prefix of all shared memory of this instance. It is kept in the instance's
/// directory and not derived from its path: two containers may share memory but not directories.
fn identity(instance: &Instance) -> io::Result<String> {
    let path = instance.dir().join(IDENTITY);
    if let Ok(text) = fs::read_to_string(&path)
        && is_identity(&text)
    {
        return Ok(text);
    }
    let fresh = format!("qc{:015x}g", random() >> 4);
    write_identity(instance, &fresh)?;
    Ok(fresh)
}

fn is_identity(text: &str) -> bool {
    text.len() == IDENTITY_LEN
        && text.strip_prefix("qc").is_some_and(|rest| {
            let number = rest.strip_suffix('g');
            number.is_some_and(|it| it.bytes().all(|byte| byte.is_ascii_hexdigit()))
        })
}

fn write_identity(instance: &Instance, identity: &str) -> io::Result<()> {
    let mut file = tempfile::NamedTempFile::new_in(instance.dir())?;
    file.write_all(identity.as_bytes())?;
    file.persist(instance.dir().join(IDENTITY))?;
    Ok(())
}

/// Returns a random number that is not suitable for secrets.
pub(crate) fn random() -> u64 {
    RandomState::new().hash_one(std::process::id())
}

/// Creates the directory for all iceoryx2 files: segments and the small files for every service and
/// port. It lies in memory and only its user can access it. Its name is unpredictable, so another
/// process cannot take it first.
fn root_in_memory(prefix: &str) -> io::Result<PathBuf> {
    let mut last = io::ErrorKind::AlreadyExists.into();
    for _ in 0..ATTEMPTS {
        // iceoryx2 binds Unix sockets in it. Their names take up to 48 of the kernel's 107 bytes.
        let name = format!("{prefix}{:08x}", random() >> 32);
        let root = Path::new(SHARED_MEMORY).join(name);
        match fs::DirBuilder::new().mode(0o700).create(&root) {
            Ok(()) => return Ok(root),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Removes the permissions that iceoryx2 gives to group and others, whatever the umask is. They
/// cannot enter `root` anyway. This protects the files in case `root` is opened to them.
pub(crate) fn close_to_others(root: &Path) -> io::Result<()> {
    for entry in fs::read_dir(root)? {
        let entry = entry?;
        let mut rights = entry.metadata()?.permissions();
        if rights.mode() & 0o077 != 0 {
            rights.set_mode(rights.mode() & 0o700);
            fs::set_permissions(entry.path(), rights)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use super::*;
    use crate::tests::unlocked;

    fn root() -> PathBuf {
        let prefix = format!("qc{:015x}g1_", random() >> 4);
        let root = root_in_memory(&prefix).unwrap();
        removal_lock::make(&root).unwrap();
        fs::write(root.join("segment"), "of a broker").unwrap();
        root
    }

    fn age(root: &Path, by: Duration) {
        let then = SystemTime::now() - by;
        File::open(root).unwrap().set_modified(then).unwrap();
    }

    #[test]
    fn unlocked_root_is_stray_once_it_is_old() {
        let root = root();
        assert!(!is_stray(&root), "a broker may be about to lock it");
        age(&root, UNLOCKED_FOR);
        assert!(is_stray(&root));
        removal_lock::lock_and_remove(&root).unwrap();
    }

    #[test]
    fn memory_of_a_starting_broker_is_not_stray() {
        let root = root();
        let mut seen = None;
        let life = lock_life(&root, || seen = Some(is_stray(&root))).unwrap();
        assert_eq!((seen, is_stray(&root)), (Some(false), false));
        drop(life);
        unlocked("the memory of a dead broker is stray", || is_stray(&root));
        removal_lock::lock_and_remove(&root).unwrap();
    }

    #[test]
    fn locked_root_is_not_stray_at_any_age() {
        let root = root();
        let life = File::create(root.join(LIFE)).unwrap();
        flock(&life, FlockOperation::NonBlockingLockExclusive).unwrap();
        age(&root, UNLOCKED_FOR);
        assert!(!is_stray(&root));
        drop(life);
        unlocked("the memory of a dead broker is stray", || is_stray(&root));
        removal_lock::lock_and_remove(&root).unwrap();
    }

    #[test]
    fn unremovable_root_is_known_to_the_next_broker() {
        let dir = tempfile::TempDir::new().unwrap();
        let instance = Instance::at(dir.path().to_owned());
        let prefix = identity(&instance).unwrap();
        // A directory that this user cannot empty.
        let root = root_in_memory(&format!("{prefix}1_")).unwrap();
        let inner = root.join("inner");
        fs::create_dir(&inner).unwrap();
        fs::write(inner.join("file"), "").unwrap();
        let removable = fs::Permissions::from_mode(0o700);
        fs::set_permissions(&inner, fs::Permissions::from_mode(0o500)).unwrap();
        sweep(&instance, None);
        let known = dir.path().join(IDENTITY).exists();
        // Root has no such restrictions.
        let is_left = root.exists();
        if is_left {
            fs::set_permissions(&inner, removable).unwrap();
            sweep(&instance, None);
        }
        assert_eq!((known, root.exists()), (is_left, false));
        assert!(!dir.path().join(IDENTITY).exists());
    }
}
