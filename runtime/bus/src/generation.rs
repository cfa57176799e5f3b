//! Generations: every start of a broker gets names that nobody has used before.
//!
//! On stable names a broker killed in its first milliseconds can leave a service behind that can
//! never be opened again, and dead entries pile up. So each start has its own prefix and its own
//! directory, `current` names them, and what older generations left is unlinked.

use std::collections::hash_map::RandomState;
use std::fs;
use std::hash::BuildHasher;
use std::io::{self, Write};
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

use qcbus_messages::PROTOCOL_VERSION;
use qcbus_messages::services::Limits;
use serde::{Deserialize, Serialize};

use crate::instance::{Instance, private_dir, private_temporary_dir};
use crate::memory::SHARED_MEMORY;
use crate::ports::ICEORYX2_VERSION;
use crate::process::{Process, start_time};

const CURRENT: &str = "current";
const IDENTITY: &str = "id";
/// What the directories of generations begin with in there; segments begin with the prefix itself.
const ROOT: &str = "d";
/// iceoryx2 binds Unix sockets below the root path: 107 bytes are the kernel's limit, of which a
/// socket's own name takes up to 66.
const MAX_ROOT: usize = 40;

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
    pub(crate) fn begin(instance: &Instance, limits: Limits) -> io::Result<Generation> {
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
        fs::create_dir(&dir)?;
        let prefix = format!("{identity}{number:x}_");
        let root = match root_in_memory(&prefix) {
            Some(root) => root,
            None => short_path(instance, &identity, &dir)?,
        };
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

    /// Makes this the generation in force.
    pub(crate) fn announce(&self, instance: &Instance) -> io::Result<()> {
        let mut file = tempfile::NamedTempFile::new_in(instance.dir())?;
        serde_json::to_writer(&mut file, self)?;
        file.flush()?;
        file.persist(instance.dir().join(CURRENT))?;
        Ok(())
    }

    /// Withdraws it, so that peers stop trying to join. First step of a stop.
    pub(crate) fn withdraw(&self, instance: &Instance) {
        let _ = fs::remove_file(instance.dir().join(CURRENT));
    }
}

/// Unlinks everything of this instance, except the generation `keep`. The caller holds the
/// instance's lock, so whatever is found belongs to nobody alive but peers that are leaving; what
/// they have mapped stays readable for them.
pub(crate) fn sweep(instance: &Instance, keep: Option<&Generation>) {
    let Ok(identity) = identity(instance) else {
        return;
    };
    for name in names_in(Path::new(SHARED_MEMORY)) {
        let path = Path::new(SHARED_MEMORY).join(&name);
        let bare = name.strip_prefix(ROOT).unwrap_or(&name);
        let kept = keep.is_some_and(|keep| bare.starts_with(&keep.prefix));
        if !bare.starts_with(&identity) || kept {
            continue;
        }
        let _ = match name.starts_with(ROOT) {
            true => fs::remove_dir_all(path),
            false => fs::remove_file(path),
        };
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
    if keep.is_none() {
        let _ = fs::remove_file(link_path(&identity));
        let _ = fs::remove_file(instance.dir().join(IDENTITY));
    }
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
        && text.len() == 18
        && text.starts_with("qc")
        && text[2..17].bytes().all(|byte| byte.is_ascii_hexdigit())
        && text.ends_with('g')
    {
        return Ok(text);
    }
    let fresh = format!("qc{:015x}g", random() >> 4);
    let mut file = tempfile::NamedTempFile::new_in(instance.dir())?;
    file.write_all(fresh.as_bytes())?;
    file.persist(&path)?;
    Ok(fresh)
}

/// A random number; not for secrets.
pub(crate) fn random() -> u64 {
    RandomState::new().hash_one(std::process::id())
}

/// A directory for the small files that iceoryx2 writes for every service and port. It syncs each
/// of them to the disk, dozens for one start and one join: in memory, where the segments that they
/// describe are anyhow, that is free, and nothing of them is of use after a power cut.
fn root_in_memory(prefix: &str) -> Option<PathBuf> {
    let root = Path::new(SHARED_MEMORY).join(format!("{ROOT}{prefix}"));
    fs::DirBuilder::new().mode(0o700).create(&root).ok()?;
    Some(root)
}

/// The directory itself, or a way to it through a symbolic link in our own temporary directory
/// when its path is too long for a socket's name.
fn short_path(instance: &Instance, identity: &str, dir: &Path) -> io::Result<PathBuf> {
    if dir.is_absolute() && dir.as_os_str().len() <= MAX_ROOT {
        return Ok(dir.to_owned());
    }
    let link = link_path(identity);
    if let Some(parent) = link.parent() {
        private_dir(parent).map_err(io::Error::other)?;
    }
    let _ = fs::remove_file(&link);
    std::os::unix::fs::symlink(fs::canonicalize(instance.dir())?, &link)?;
    let name = dir.file_name().unwrap_or_default();
    Ok(link.join(name))
}

fn link_path(identity: &str) -> PathBuf {
    private_temporary_dir().join(&identity[..12])
}
