//! Inspection of processes through `/proc`.

use std::path::{Path, PathBuf};

/// A process that belongs to an instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Process {
    /// Process id.
    pub pid: i32,
    /// Command line.
    pub words: Vec<String>,
}

/// Role of a process in the instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ProcessKind {
    /// `qcbus serve`.
    Broker,
    /// A standard bundle.
    Bundle,
    /// A standard reporter.
    Reporter,
    /// A misbehaving bundle or reporter, or an ASAM module, its adapter or a process that it
    /// started.
    Animal,
    /// A command such as `qcbus wait`.
    Other,
}

impl Process {
    /// Returns the role of the process.
    pub fn kind(&self) -> ProcessKind {
        let said = |word: &str| self.words.iter().skip(1).any(|it| it == word);
        let program = self.words.first().map_or("", String::as_str);
        let is_of_a_module = self.words.iter().any(|it| it.contains("/guests/qc_"));
        if program.ends_with("/zoo") || is_of_a_module {
            ProcessKind::Animal
        } else if said("serve") {
            ProcessKind::Broker
        } else if said("bundle") && said("run") {
            ProcessKind::Bundle
        } else if said("reporter") && said("run") {
            ProcessKind::Reporter
        } else {
            ProcessKind::Other
        }
    }

    /// Sends a signal. A process that has ended meanwhile is not an error.
    pub fn signal(&self, signal: rustix::process::Signal) {
        signal_pid(self.pid, signal);
    }
}

/// Sends a signal to a process that this test started.
pub fn signal_pid(pid: i32, signal: rustix::process::Signal) {
    if let Some(pid) = rustix::process::Pid::from_raw(pid) {
        let _ = rustix::process::kill_process(pid, signal);
    }
}

/// Returns all processes with this directory in their command line. Zombies are left out because
/// they have no command line.
pub fn of_directory(directory: &Path) -> Vec<Process> {
    let wanted = directory.to_string_lossy();
    let mut found: Vec<Process> = all()
        .filter(|process| process.words.iter().any(|word| *word == wanted))
        .filter(|process| process.pid != i32::try_from(std::process::id()).unwrap())
        .collect();
    found.sort_by_key(|process| process.pid);
    found
}

/// Returns all processes with this text in their command line.
pub fn all_with(text: &str) -> Vec<Process> {
    let own = std::process::id().cast_signed();
    let others = all().filter(|process| process.pid != own);
    others
        .filter(|process| process.words.iter().any(|word| word.contains(text)))
        .collect()
}

fn all() -> impl Iterator<Item = Process> {
    std::fs::read_dir("/proc")
        .unwrap()
        .flatten()
        .filter_map(|entry| {
            let pid = entry.file_name().to_str()?.parse().ok()?;
            let line = std::fs::read(entry.path().join("cmdline")).ok()?;
            let words = line
                .split(|byte| *byte == 0)
                .filter(|word| !word.is_empty());
            let words = words
                .map(|word| String::from_utf8_lossy(word).into_owned())
                .collect();
            Some(Process { pid, words })
        })
}

/// Returns the parent of a process. The parent of a confined bundle is the launcher that the broker
/// has started.
pub fn parent_of(pid: u32) -> u32 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
    let (_, rest) = stat.rsplit_once(')').unwrap();
    rest.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Returns the value of a field in `/proc/PID/status` that counts KiB.
pub fn memory_kib(pid: u32, field: &str) -> Option<u64> {
    let path = PathBuf::from(format!("/proc/{pid}/status"));
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find(|line| line.starts_with(field))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Returns the private memory of a process. Mappings from /dev/shm are not counted.
pub fn private_kib(pid: u32) -> Option<u64> {
    memory_kib(pid, "RssAnon:")
}

/// Returns the peak private memory of a process: its total peak minus the memory that it shares
/// now.
pub fn peak_private_kib(pid: u32) -> Option<u64> {
    let shared = memory_kib(pid, "RssShmem:")?;
    Some(memory_kib(pid, "VmHWM:")?.saturating_sub(shared))
}

/// Returns a name that a process gives to a file while it writes it.
pub fn temporary_name(pid: u32) -> String {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
    let (_, rest) = stat.rsplit_once(')').unwrap();
    // This is the start time (proc(5), the 22nd field).
    let started = rest.split_whitespace().nth(19).unwrap();
    format!(".qcbus-{pid}.{started}-a1b2c3.tmp")
}
