//! Inner sandbox: a bundle puts it around itself once it has joined.

use std::path::PathBuf;

use qcbus_formats::manifest::May;

use crate::SandboxError;
use crate::calls;
use crate::rules::{Rules, everything, files, listings, reading, trees};

/// Files that programs read by themselves: libraries for a backtrace, the time zone, the language,
/// the number of processors. They contain no secrets.
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

/// Needs of a bundle in addition to those that its manifest declares.
#[derive(Debug, Default)]
pub struct Sandboxed {
    /// Directory of shared memory of the joined generation. The bundle sees no other generation.
    pub memory: Option<PathBuf>,
    /// Files and directories that it reads.
    pub reads: Vec<PathBuf>,
    /// Directories in which it may list files at any depth, but not read them.
    pub lists: Vec<PathBuf>,
    /// What its manifest declares.
    pub may: May,
}

/// Confines this process from now on, except for what its manifest declares. It opens nothing for
/// writing and reads only what is named here. It cannot signal or trace others, connect or start
/// programs. Open files stay open. This can never be undone.
///
/// The process must have a single thread, because existing threads would stay unconfined.
///
/// # Errors
/// Returns [`SandboxError::Kernel`] if the process is not confined, or only partly.
pub fn confine(sandboxed: &Sandboxed) -> Result<(), SandboxError> {
    if threads() != Some(1) {
        let why = "other threads already run and would stay unconfined";
        return Err(SandboxError::kernel("a single thread is needed", why));
    }
    let may = &sandboxed.may;
    let mut rules = Rules::new(may.network)?.allow("/dev/null", everything())?;
    // Images are published in later segments with unknown names.
    if let Some(memory) = &sandboxed.memory {
        rules = rules.allow(memory, files())?;
    }
    for path in HARMLESS {
        rules = rules.allow(path, trees())?;
    }
    // This allows the running program, not a file that now lies at its path.
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
    // This comes first: the rest depends on it, and the filter needs a flag that it sets.
    let landlocked = rules.enforce()?;
    calls::forbid(may)?;
    match landlocked {
        true => Ok(()),
        false => Err(SandboxError::kernel(
            "Landlock",
            "this kernel does not support it",
        )),
    }
}

/// Returns the number of threads of this process, or `None` if it cannot be determined.
pub(crate) fn threads() -> Option<usize> {
    Some(std::fs::read_dir("/proc/self/task").ok()?.count())
}
