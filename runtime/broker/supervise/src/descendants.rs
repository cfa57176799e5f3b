//! Descendants: processes that bundles have started and left behind.
//!
//! The broker is their subreaper: a process below a child becomes a child of the broker when its
//! parent ends. This is independent of its session and process group.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use qcbus_bus::Process;
use qcbus_types::Launch;
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};

use crate::launches::Launches;

/// Children of this process that no bundle left behind. A script may start a process and then
/// execute the broker, for example.
#[derive(Debug)]
pub struct Strangers {
    before: BTreeSet<i32>,
    /// Whether this is the first process of a container, which inherits all orphaned processes.
    is_first: bool,
}

/// Makes this process the subreaper of its descendants. Returns the processes that must be left alone.
pub fn adopt() -> Strangers {
    let strangers = Strangers {
        before: children(),
        is_first: std::process::id() == 1,
    };
    if let Err(error) = rustix::process::set_child_subreaper(Some(rustix::process::getpid())) {
        tracing::warn!(%error, "cannot find the descendants of bundles");
    }
    strangers
}

/// A process as listed by the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Listed {
    parent: i32,
    is_dead: bool,
}

/// Returns all processes.
fn processes() -> BTreeMap<i32, Listed> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok());
    numbers
        .filter_map(|pid| Some((pid, listed(pid)?)))
        .collect()
}

fn listed(pid: i32) -> Option<Listed> {
    let stat =
        std::fs::read_to_string(Path::new("/proc").join(pid.to_string()).join("stat")).ok()?;
    // The command is in parentheses and may contain any character. State and parent follow it.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace();
    let state = fields.next()?;
    let parent = fields.next()?.parse().ok()?;
    Some(Listed {
        parent,
        is_dead: matches!(state, "Z" | "X"),
    })
}

/// Kills all descendants of a process. The caller must stop or kill the process itself immediately afterwards.
pub fn kill_below(process: &Process) {
    // The process must not notice the loss of its children and exit with a misleading code.
    if let Some(pid) = Pid::from_raw(process.id().cast_signed()) {
        let _ = kill_process(pid, Signal::STOP);
    }
    // A repeated search finds processes that are started meanwhile. The number of attempts is
    // limited, because a hostile process may start new ones for ever.
    for _ in 0..8 {
        let living = living_below(process.id().cast_signed());
        if living.is_empty() {
            return;
        }
        living.into_iter().for_each(kill);
    }
}

/// Returns the living descendants of a process. Uses the kernel's lists of children if they exist, because a search
/// through all processes takes milliseconds. A list may miss an entry while other entries end. Such a process becomes
/// a child of the broker when its parent ends, and is found then.
fn living_below(root: i32) -> Vec<i32> {
    let is_alive = |pid: &i32| listed(*pid).is_some_and(|it| !it.is_dead);
    let mut found = BTreeSet::from([root]);
    let mut open = vec![root];
    while let Some(parent) = open.pop() {
        let Some(children) = children_of(&parent.to_string()) else {
            let all = processes();
            let below = below(&all, root).into_iter();
            return below.filter(|it| !all[it].is_dead).collect();
        };
        open.extend(children.into_iter().filter(|it| found.insert(*it)));
    }
    found.remove(&root);
    found.into_iter().filter(is_alive).collect()
}

/// Checks whether a process is a descendant of another one.
pub fn is_below(pid: u32, root: u32) -> bool {
    let mut pid = pid.cast_signed();
    // No ancestry is that deep. The limit also ends the loop if the kernel's lists change meanwhile.
    for _ in 0..64 {
        match listed(pid) {
            Some(found) if found.parent == root.cast_signed() => return true,
            Some(found) if found.parent > 1 => pid = found.parent,
            _ => return false,
        }
    }
    false
}

fn below(all: &BTreeMap<i32, Listed>, root: i32) -> BTreeSet<i32> {
    let mut found = BTreeSet::from([root]);
    loop {
        let children = all
            .iter()
            .filter(|(pid, it)| found.contains(&it.parent) && !found.contains(pid));
        let children: Vec<i32> = children.map(|(pid, _)| *pid).collect();
        if children.is_empty() {
            found.remove(&root);
            return found;
        }
        found.extend(children);
    }
}

/// Kills and reaps descendants: children of this process that are not in `ours`. Processes left on purpose by a
/// launch in `ours` stay as long as it does. The environment identifies the launch. A process without a proof is
/// killed unless it may be a stranger. Returns the number of processes that were still alive.
pub fn sweep(
    ours: &BTreeMap<Launch, Option<u32>>,
    strangers: &Strangers,
    launches: &Launches,
) -> usize {
    let known = ours.values().flatten().map(|pid| pid.cast_signed());
    let known: BTreeSet<i32> = known.collect();
    let mut left = 0;
    let theirs = |pid: &i32| known.contains(pid) || strangers.before.contains(pid);
    for pid in children().into_iter().filter(|pid| !theirs(pid)) {
        let Some(descendant) = listed(pid) else {
            continue;
        };
        if descendant.is_dead {
            bury(pid);
            continue;
        }
        let is_left = match launches.of_process(pid.unsigned_abs()) {
            Some(launch) => !ours.contains_key(&launch),
            None => !strangers.is_first,
        };
        if is_left {
            left += 1;
            // Its descendants are killed too, otherwise the next sweep would find them as orphaned processes.
            living_below(pid).into_iter().for_each(kill);
            kill(pid);
        }
    }
    left
}

/// Checks whether the kernel lists the children of a process.
pub fn are_listed() -> bool {
    let own = std::process::id().to_string();
    Path::new("/proc/self/task")
        .join(own)
        .join("children")
        .exists()
}

/// Returns all children of this process.
fn children() -> BTreeSet<i32> {
    children_of("self").unwrap_or_else(|| {
        let own = std::process::id().cast_signed();
        let all = processes().into_iter();
        all.filter(|(_, it)| it.parent == own)
            .map(|(pid, _)| pid)
            .collect()
    })
}

/// Returns all children of a process, from the lists of all its threads. Returns `None` if the
/// kernel was built without these lists.
fn children_of(process: &str) -> Option<BTreeSet<i32>> {
    let threads = Path::new("/proc").join(process).join("task");
    let threads = std::fs::read_dir(threads).into_iter().flatten().flatten();
    let lists = threads.map(|thread| std::fs::read_to_string(thread.path().join("children")));
    let mut found = BTreeSet::new();
    for list in lists {
        match list {
            Ok(list) => found.extend(
                list.split_whitespace()
                    .filter_map(|it| it.parse::<i32>().ok()),
            ),
            // The thread has ended meanwhile.
            Err(error) if error.raw_os_error() == Some(ESRCH) => {}
            Err(error) if error.kind() == std::io::ErrorKind::NotFound && are_listed() => {}
            Err(_) => return None,
        }
    }
    Some(found)
}

const ESRCH: i32 = rustix::io::Errno::SRCH.raw_os_error();

fn kill(pid: i32) {
    if let Some(pid) = Pid::from_raw(pid) {
        // The process may have ended already.
        let _ = kill_process(pid, Signal::KILL);
    }
}

/// Reaps an ended process. Only for descendants: other processes are reaped by the code that started them.
fn bury(pid: i32) {
    if let Some(pid) = Pid::from_raw(pid) {
        let _ = waitpid(Some(pid), WaitOptions::NOHANG);
    }
}
