//! Generations: every start of a broker gets names that nobody has used before.
//!
//! On stable names a broker killed in its first milliseconds can leave a service behind that can
//! never be opened again, and dead entries pile up. So each start has its own prefix and its own
//! directory, `current` names them, and what older generations left is unlinked.

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
/// What a living broker keeps locked in its shared memory.
const LIFE: &str = "broker";
/// Its name until it is locked.
const UNNAMED_LIFE: &str = "broker.new";
/// Bytes of what is in it.
const IDENTITY_LEN: usize = 18;
/// A broker locks its shared memory within microseconds of making it, unless it is stopped in between.
const UNLOCKED_FOR: Duration = Duration::from_secs(60);
/// Names that are tried for such a directory; each is as good as new.
const ATTEMPTS: usize = 16;

/// What a broker writes for its peers.
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
    /// The generation in force, `None` when there is none or it cannot be read.
    pub(crate) fn current(instance: &Instance) -> Option<Generation> {
        let text = fs::read(instance.dir().join(CURRENT)).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Whether the broker that wrote this still runs.
    pub(crate) fn broker(&self) -> Option<Process> {
        Process::open(self.pid, self.pid_started)
    }

    /// A new generation, not yet announced. To be called under the instance's lock.
    pub(crate) fn begin(instance: &Instance, limits: Limits) -> Result<Generation, StartError> {
        // What a broker leaves that is killed while it writes one of its files.
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

    /// Keeps its shared memory from [`sweep_strays`] as long as the file is open. It gets its name when it is
    /// locked, or another start would take an unlocked one for that of a dead broker and remove the memory.
    pub(crate) fn lock_memory(&self) -> io::Result<File> {
        lock_life(&self.root, || {})
    }

    /// Makes this the generation in force.
    pub(crate) fn announce(&self, instance: &Instance) -> io::Result<()> {
        let mut file = tempfile::NamedTempFile::new_in(instance.dir())?;
        file.write_all(&serde_json::to_vec(self)?)?;
        file.flush()?;
        file.persist(instance.dir().join(CURRENT))?;
        Ok(())
    }

    /// Makes again what was taken from the runtime directory. What somebody else has put into a file's
    /// place stays.
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
            tracing::warn!("`{CURRENT}` was removed from the runtime directory; it was made again");
            self.announce(instance)?;
        }
        Ok(())
    }

    /// Withdraws it, so that peers stop trying to join.
    pub(crate) fn withdraw(&self, instance: &Instance) {
        let _ = fs::remove_file(instance.dir().join(CURRENT));
    }
}

/// Unlinks everything of this instance, except the generation `keep`. The caller holds the
/// instance's lock, so whatever is found belongs to nobody alive but peers that are leaving, or about
/// to join; what they have mapped stays readable for them. What cannot be unlinked is said, and a later
/// broker of the instance tries again.
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
            // Of a version that put its segments there.
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

/// Unlinks what brokers left that were killed and whose runtime directory is gone, so that nobody knows of it.
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

/// `unlocked` is called between making the file and locking it.
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

/// Nobody has it who lives. A broker that has not locked its own yet has no file of that name; nor has what somebody
/// made too late, whom the broker had stopped waiting for.
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

/// A random name that all shared memory of this instance begins with. It is kept in the instance's
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

/// A random number; not for secrets.
pub(crate) fn random() -> u64 {
    RandomState::new().hash_one(std::process::id())
}

/// The directory of everything that iceoryx2 makes, segments and the small files that it writes for
/// every service and port: in memory, and open to nobody else. Its name cannot be known beforehand, so
/// nobody can take it first.
fn root_in_memory(prefix: &str) -> io::Result<PathBuf> {
    let mut last = io::ErrorKind::AlreadyExists.into();
    for _ in 0..ATTEMPTS {
        // iceoryx2 binds Unix sockets in it, whose own names take up to 48 of the kernel's 107 bytes.
        let name = format!("{prefix}{:08x}", random() >> 32);
        let root = Path::new(SHARED_MEMORY).join(name);
        match fs::DirBuilder::new().mode(0o700).create(&root) {
            Ok(()) => return Ok(root),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Takes from group and others what iceoryx2 gives them of its own accord, whatever the umask is.
/// They do not get into `root` anyhow; this is for the day on which somebody opens it to them.
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
    fn what_nobody_has_locked_is_a_stray_when_it_is_old() {
        let root = root();
        assert!(!is_stray(&root), "its broker may be about to lock it");
        age(&root, UNLOCKED_FOR);
        assert!(is_stray(&root));
        removal_lock::lock_and_remove(&root).unwrap();
    }

    #[test]
    fn broker_that_has_not_locked_its_memory_yet_is_no_stray() {
        let root = root();
        let mut seen = None;
        let life = lock_life(&root, || seen = Some(is_stray(&root))).unwrap();
        assert_eq!((seen, is_stray(&root)), (Some(false), false));
        drop(life);
        assert!(is_stray(&root), "it has died");
        removal_lock::lock_and_remove(&root).unwrap();
    }

    #[test]
    fn what_a_broker_has_locked_is_none_however_old() {
        let root = root();
        let life = File::create(root.join(LIFE)).unwrap();
        flock(&life, FlockOperation::NonBlockingLockExclusive).unwrap();
        age(&root, UNLOCKED_FOR);
        assert!(!is_stray(&root));
        drop(life);
        assert!(is_stray(&root), "it has died");
        removal_lock::lock_and_remove(&root).unwrap();
    }

    #[test]
    fn what_cannot_be_removed_is_known_to_the_next_broker() {
        let dir = tempfile::TempDir::new().unwrap();
        let instance = Instance::at(dir.path().to_owned());
        let prefix = identity(&instance).unwrap();
        // A directory that we may not empty.
        let root = root_in_memory(&format!("{prefix}1_")).unwrap();
        let inner = root.join("inner");
        fs::create_dir(&inner).unwrap();
        fs::write(inner.join("file"), "").unwrap();
        let removable = fs::Permissions::from_mode(0o700);
        fs::set_permissions(&inner, fs::Permissions::from_mode(0o500)).unwrap();
        sweep(&instance, None);
        let known = dir.path().join(IDENTITY).exists();
        // For root nothing is forbidden.
        let is_left = root.exists();
        if is_left {
            fs::set_permissions(&inner, removable).unwrap();
            sweep(&instance, None);
        }
        assert_eq!((known, root.exists()), (is_left, false));
        assert!(!dir.path().join(IDENTITY).exists());
    }
}
