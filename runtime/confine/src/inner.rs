//! The ring that a bundle draws around itself once it has joined.

use std::path::PathBuf;

use qcbus_formats::manifest::May;

use crate::SandboxError;
use crate::calls;
use crate::rules::{Rules, everything, files, listings, reading, trees};

/// Programs read these by themselves: libraries for a backtrace, the time zone, the language, how many processors
/// there are. Nothing in them is a secret.
const HARMLESS: &[&str] = &[
    "/usr/lib",
    "/usr/lib64",
    "/lib",
    "/lib64",
    "/usr/share/zoneinfo",
    "/usr/share/locale",
    "/etc/localtime",
    "/etc/ld.so.cache",
    "/sys/fs/cgroup",
    "/sys/devices/system/cpu",
    "/dev/urandom",
    "/proc/self",
    "/proc/cpuinfo",
    "/proc/meminfo",
];

/// What a bundle needs besides what its manifest declares.
#[derive(Debug, Default)]
pub struct Sandboxed {
    /// The directory of shared memory of the generation that it has joined. Of others it sees nothing.
    pub memory: Option<PathBuf>,
    /// Files and directories that it reads.
    pub reads: Vec<PathBuf>,
    /// Directories below which it may see what lies there, and not read it.
    pub lists: Vec<PathBuf>,
    /// What its manifest declares.
    pub may: May,
}

/// Puts this process inside: from now on it opens nothing for writing, reads nothing but what is named here,
/// signals and traces nobody else, connects nowhere and starts no program, unless its manifest declares that.
/// What it has open stays open. It can never be undone.
///
/// The process must have a single thread: threads that there are already would stay outside.
///
/// # Errors
/// [`SandboxError::Kernel`]: the process is not confined, or not wholly.
pub fn confine(sandboxed: &Sandboxed) -> Result<(), SandboxError> {
    if threads() != Some(1) {
        let why = "threads run already that would stay outside";
        return Err(SandboxError::kernel("a single thread is needed", why));
    }
    let may = &sandboxed.may;
    let mut rules = Rules::new(may.network)?.allow("/dev/null", everything())?;
    // Images are published in segments that come later, under names that nobody knows before.
    if let Some(memory) = &sandboxed.memory {
        rules = rules.allow(memory, files())?;
    }
    for path in HARMLESS {
        rules = rules.allow(path, trees())?;
    }
    // What runs, and not what lies at its path by now.
    rules = rules.allow("/proc/self/exe", files())?;
    for path in sandboxed.reads.iter().chain(&may.read) {
        rules = rules.allow(path, trees())?;
    }
    for path in &sandboxed.lists {
        rules = rules.allow(path, listings())?;
    }
    for path in &may.write {
        rules = rules.allow(path, everything())?;
    }
    if may.programs {
        rules = rules.allow("/", reading())?;
    }
    // First: without it nothing else counts for much, and the filter needs what it sets.
    let landlocked = rules.enforce()?;
    calls::forbid(may)?;
    match landlocked {
        true => Ok(()),
        false => Err(SandboxError::kernel(
            "Landlock",
            "this kernel does not have it",
        )),
    }
}

/// How many threads this process has; `None` where it cannot be learned.
pub(crate) fn threads() -> Option<usize> {
    Some(std::fs::read_dir("/proc/self/task").ok()?.count())
}
