//! What former brokers of an instance have left running.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use rustix::process::Pid;

use crate::core::Launch;

/// Processes that former brokers of an instance have started. Their command lines tell: no list can
/// miss one of a broker that was killed before it wrote the list.
#[derive(Debug)]
pub struct Former {
    directory: Identity,
    before: Launch,
}

/// Device and inode of a directory. A path may lead elsewhere in another container.
type Identity = (u64, u64);

impl Former {
    /// Those of the instance with this directory, started before this launch. `None`: there is no
    /// such directory.
    pub fn of(instance_dir: &Path, before: Launch) -> Option<Former> {
        let directory = identity(instance_dir)?;
        Some(Former { directory, before })
    }

    /// Kills those that are of none of these starts. Returns their process ids and programs.
    pub fn kill_but(&self, joined: &BTreeSet<Launch>) -> Vec<(u32, String)> {
        let mut killed = Vec::new();
        for pid in processes() {
            let Some(command) = CommandLine::of(pid) else {
                continue;
            };
            let Some(launch) = command.launch() else {
                continue;
            };
            let former = launch < self.before && !joined.contains(&launch);
            if former && command.instance() == Some(self.directory) {
                kill_with_group(pid);
                killed.push((pid.as_raw_nonzero().get().unsigned_abs(), command.program()));
            }
        }
        killed
    }
}

fn processes() -> impl Iterator<Item = Pid> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    numbers.filter_map(Pid::from_raw)
}

/// Kills a process with its group, or alone where it leads none.
pub fn kill_with_group(pid: Pid) {
    use rustix::process::{Signal, kill_process, kill_process_group};
    if kill_process_group(pid, Signal::KILL).is_err() {
        // Not the leader of a group, or gone already.
        let _ = kill_process(pid, Signal::KILL);
    }
}

fn of_process(pid: Pid) -> PathBuf {
    Path::new("/proc").join(pid.as_raw_nonzero().to_string())
}

fn identity(directory: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    let found = std::fs::metadata(directory).ok()?;
    Some((found.dev(), found.ino()))
}

/// The launch that a process was started with, if it is a child of some broker.
pub fn launch_of(pid: Pid) -> Option<Launch> {
    CommandLine::of(pid)?.launch()
}

/// The words with which a process was started.
struct CommandLine {
    pid: Pid,
    words: Vec<Vec<u8>>,
}

impl CommandLine {
    /// `None`: there is no such process, or it has ended and nobody has buried it yet.
    fn of(pid: Pid) -> Option<CommandLine> {
        let line = std::fs::read(of_process(pid).join("cmdline")).ok()?;
        let words = line.split(|byte| *byte == 0).map(<[u8]>::to_vec);
        (!line.is_empty()).then(|| CommandLine {
            pid,
            words: words.collect(),
        })
    }

    fn behind(&self, flag: &str) -> Option<&[u8]> {
        let at = self
            .words
            .iter()
            .rposition(|word| word == flag.as_bytes())?;
        self.words.get(at + 1).map(Vec::as_slice)
    }

    /// Which start of a broker it is. A process id may have been given to somebody else since: only
    /// what was started with `--launch` is ours.
    fn launch(&self) -> Option<Launch> {
        let number = std::str::from_utf8(self.behind("--launch")?).ok()?;
        number.parse().ok().map(Launch)
    }

    /// Its directory, as the process itself sees it.
    fn instance(&self) -> Option<Identity> {
        use std::os::unix::ffi::OsStrExt as _;
        let told = Path::new(OsStr::from_bytes(self.behind("--instance-dir")?));
        let seen = match told.strip_prefix("/") {
            Ok(below) => of_process(self.pid).join("root").join(below),
            Err(_) => of_process(self.pid).join("cwd").join(told),
        };
        identity(&seen)
    }

    fn program(&self) -> String {
        let first = self.words.first().map(Vec::as_slice).unwrap_or_default();
        String::from_utf8_lossy(first).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::process::CommandExt as _;
    use std::process::{Child, Command, Stdio};

    use super::*;

    fn start(instance: &Path, launch: Launch) -> Child {
        let mut command = Command::new("sh");
        command.args(["-c", "sleep 1000; true", "sh", "--instance-dir"]);
        command.arg(instance);
        command.args(["--launch", &launch.0.to_string()]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let child = command.process_group(0).spawn().unwrap();
        // It may be there before its words are.
        while launch_of(Pid::from_child(&child)).is_none() {
            std::thread::yield_now();
        }
        child
    }

    fn ends(mut child: Child) -> bool {
        let runs = child.try_wait().unwrap().is_none();
        kill_with_group(Pid::from_child(&child));
        child.wait().unwrap();
        runs
    }

    #[test]
    fn only_what_a_former_broker_of_this_instance_started_and_did_not_join_is_killed() {
        let base = tempfile::tempdir().unwrap();
        let [here, link, elsewhere] = ["here", "link", "elsewhere"].map(|it| base.path().join(it));
        std::fs::create_dir(&here).unwrap();
        std::fs::create_dir(&elsewhere).unwrap();
        std::os::unix::fs::symlink(&here, &link).unwrap();
        let [first, joined, now] = [1, 2, 3].map(Launch::first_of);
        let mut stuck = [start(&here, first), start(&link, first)];
        let others = [
            start(&here, joined),
            start(&here, now),
            start(&elsewhere, first),
        ];
        let former = Former::of(&here, now).unwrap();
        let killed = former.kill_but(&BTreeSet::from([joined]));
        let last = stuck.each_mut().map(|it| it.wait().unwrap().success());
        let told = |id: u32| killed.contains(&(id, "sh".to_owned()));
        // There may be more: what a shell has just forked bears its words.
        assert!(stuck.iter().all(|it| told(it.id())), "{killed:?}");
        assert!(!others.iter().any(|it| told(it.id())), "{killed:?}");
        let spared = others.map(ends);
        assert_eq!((last, spared), ([false; 2], [true; 3]));
    }

    #[test]
    fn an_instance_without_a_directory_has_left_nothing() {
        let base = tempfile::tempdir().unwrap();
        let gone = base.path().join("gone");
        assert!(Former::of(&gone, Launch::first_of(1)).is_none());
    }
}
