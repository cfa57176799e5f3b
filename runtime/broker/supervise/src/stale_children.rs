//! Stale children: processes that former brokers of an instance have left running.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};

use qcbus_bus::Process;
use qcbus_types::Launch;

use crate::launches::Launches;

/// Processes that former brokers of an instance have started, and their descendants. They are identified by their
/// environment. Unlike a list, this also covers a broker that was killed before it wrote the list.
#[derive(Debug)]
pub struct StaleChildren {
    launches: Launches,
    before: Launch,
}

impl StaleChildren {
    /// Returns the processes that were started before this launch.
    pub fn of(launches: &Launches, before: Launch) -> StaleChildren {
        let launches = launches.clone();
        StaleChildren { launches, before }
    }

    /// Kills the processes of this launch.
    pub fn kill_those_of(&self, launch: Launch) {
        self.kill(|it| it == launch);
    }

    /// Kills all processes except those of these launches. Returns their process ids and programs.
    pub fn kill_but(&self, joined: &BTreeSet<Launch>) -> Vec<(u32, String)> {
        self.kill(|launch| launch < self.before && !joined.contains(&launch))
    }

    fn kill(&self, is_meant: impl Fn(Launch) -> bool) -> Vec<(u32, String)> {
        let mut killed = Vec::new();
        for id in processes() {
            // The handle comes first, so that all data read later belongs to this process or to none.
            let Some(process) = Process::open(id, None) else {
                continue;
            };
            let Some(launch) = self.launches.of_process(id) else {
                continue;
            };
            if is_meant(launch) && process.is_alive() {
                let program = program(id);
                process.kill();
                killed.push((id, program));
            }
        }
        killed
    }
}

fn processes() -> impl Iterator<Item = u32> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok())
}

fn of_process(id: u32) -> PathBuf {
    Path::new("/proc").join(id.to_string())
}

/// Returns the first word of its command line.
fn program(id: u32) -> String {
    let line = std::fs::read(of_process(id).join("cmdline")).unwrap_or_default();
    let first = line.split(|byte| *byte == 0).next().unwrap_or_default();
    qcbus_messages::path_text::to_text(Path::new(OsStr::from_bytes(first)))
}

#[cfg(test)]
mod tests {
    use std::os::unix::process::CommandExt as _;
    use std::process::{Child, Command};

    use qcbus_bus::LAUNCH;
    use rustix::process::{Pid, Signal, kill_process_group};

    use super::*;

    /// Starts a process with or without this proof.
    fn start(proof: Option<&str>) -> Child {
        let mut command = Command::new("sh");
        // The command line of a process proves nothing.
        command.args(["-c", "sleep 1000; true", "sh", "--launch", "1099511627776"]);
        command.process_group(0);
        command
            .env_remove(LAUNCH)
            .envs(proof.map(|it| (LAUNCH, it)));
        command.spawn().unwrap()
    }

    fn ends(mut child: Child) -> bool {
        let runs = child.try_wait().unwrap().is_none();
        // This also kills the processes that it has started.
        let group = Pid::from_child(&child);
        kill_process_group(group, Signal::KILL).unwrap();
        child.wait().unwrap();
        runs
    }

    #[test]
    fn only_stale_children_of_this_instance_are_killed() {
        let base = tempfile::tempdir().unwrap();
        let [here, elsewhere] = ["here", "elsewhere"].map(|name| {
            let path = base.path().join(name);
            std::fs::create_dir(&path).unwrap();
            Launches::of(&path).unwrap()
        });
        let [first, joined, now] = [1, 2, 3].map(Launch::first_of);
        let proof = here.proof(first, "a");
        // All descendants belong to the same launch, in any session.
        let mut grandchild = Command::new("sh");
        grandchild.args(["-c", "setsid sleep 1000 & wait"]);
        let grandchild = grandchild
            .env(LAUNCH, &proof)
            .process_group(0)
            .spawn()
            .unwrap();
        let mut stuck = [start(Some(&proof)), grandchild];
        let others = [
            start(Some(&here.proof(joined, "a"))),
            start(Some(&here.proof(now, "a"))),
            start(Some(&elsewhere.proof(first, "a"))),
            start(Some(&proof.replace(":a", ":b"))),
            start(None),
        ];
        let stale_children = StaleChildren::of(&here, now);
        let killed = stale_children.kill_but(&BTreeSet::from([joined]));
        let last = stuck.each_mut().map(|it| it.wait().unwrap().success());
        let told = |id: u32| killed.iter().any(|(it, _)| *it == id);
        assert!(stuck.iter().all(|it| told(it.id())), "{killed:?}");
        assert!(!others.iter().any(|it| told(it.id())), "{killed:?}");
        let spared = others.map(ends);
        assert_eq!((last, spared), ([false; 2], [true; 5]));
        // The next iteration finds processes that were just being started.
        while !stale_children
            .kill_but(&BTreeSet::from([joined]))
            .is_empty()
        {
            std::thread::yield_now();
        }
    }
}
