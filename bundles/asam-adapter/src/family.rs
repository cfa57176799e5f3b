//! All descendants of a process, regardless of their process group or session.
//!
//! A runner is the subreaper of its runs (`PR_SET_CHILD_SUBREAPER`): a process whose parent ends
//! becomes a child of the runner. Therefore all processes of a run are descendants of the runner.
//! Its only other descendants are the fork servers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};

/// Time limit for killed processes to end. A process that waits for a disk without an answer cannot
/// end.
const GONE_WITHIN: Duration = Duration::from_secs(20);

/// Makes this process the subreaper of its descendants.
///
/// # Errors
/// Kernel errors.
pub(crate) fn adopt() -> std::io::Result<()> {
    Ok(rustix::process::set_child_subreaper(Some(
        rustix::process::getpid(),
    ))?)
}

/// Returns the living descendants of this process, without `spared` but with their children.
pub(crate) fn living(spared: &[i32]) -> BTreeSet<i32> {
    let found = below(std::process::id().cast_signed());
    found
        .into_iter()
        .filter(|pid| !spared.contains(pid))
        .filter(|pid| listed(*pid).is_some_and(|it| !it.is_dead))
        .collect()
}

/// Returns the private memory of processes in bytes. Memory shared with other processes does not
/// count.
pub(crate) fn memory(pids: &BTreeSet<i32>) -> u64 {
    let page = rustix::param::page_size() as u64;
    let used = |pid: &i32| {
        let text = std::fs::read_to_string(format!("/proc/{pid}/statm")).ok()?;
        let mut fields = text.split_whitespace().skip(1);
        let resident: u64 = fields.next()?.parse().ok()?;
        let shared: u64 = fields.next()?.parse().ok()?;
        Some(resident.saturating_sub(shared) * page)
    };
    pids.iter().filter_map(used).sum()
}

/// Kills all descendants of this process, except `spared`, and reaps them.
///
/// # Errors
/// The number of processes that cannot be killed.
pub(crate) fn end(spared: &[i32]) -> Result<(), usize> {
    let begin = Instant::now();
    loop {
        let living = stopped(spared);
        for pid in &living {
            signal(*pid, Signal::KILL);
        }
        bury(spared);
        if living.is_empty() {
            return Ok(());
        }
        if begin.elapsed() > GONE_WITHIN {
            return Err(living.len());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Stops all descendants before the kill, so that none can start another one meanwhile.
fn stopped(spared: &[i32]) -> BTreeSet<i32> {
    let mut known = BTreeSet::new();
    // A hostile process may fork faster than this loop. The caller checks again after the kill.
    for _ in 0..16 {
        let living = living(spared);
        let mut more = false;
        for pid in &living {
            if known.insert(*pid) {
                signal(*pid, Signal::STOP);
                more = true;
            }
        }
        if !more {
            return living;
        }
    }
    known
}

/// Reaps children that have ended, except `spared`.
fn bury(spared: &[i32]) {
    let own = children_of(std::process::id().cast_signed()).unwrap_or_else(|| {
        let own = std::process::id().cast_signed();
        let all = processes().into_iter();
        all.filter(|(_, it)| it.parent == own)
            .map(|(pid, _)| pid)
            .collect()
    });
    for pid in own.into_iter().filter(|pid| !spared.contains(pid)) {
        if let Some(pid) = Pid::from_raw(pid) {
            let _ = waitpid(Some(pid), WaitOptions::NOHANG);
        }
    }
}

fn signal(pid: i32, signal: Signal) {
    if let Some(pid) = Pid::from_raw(pid) {
        // The process may have ended by itself.
        let _ = kill_process(pid, signal);
    }
}

/// A process as listed by the kernel.
#[derive(Debug, Clone, Copy)]
struct Listed {
    parent: i32,
    is_dead: bool,
}

fn listed(pid: i32) -> Option<Listed> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command is in parentheses and may contain anything. State and parent follow it.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace();
    let state = fields.next()?;
    let parent = fields.next()?.parse().ok()?;
    let is_dead = matches!(state, "Z" | "X");
    Some(Listed { parent, is_dead })
}

fn processes() -> BTreeMap<i32, Listed> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = entries.filter_map(|it| it.file_name().to_str()?.parse::<i32>().ok());
    numbers
        .filter_map(|pid| Some((pid, listed(pid)?)))
        .collect()
}

/// Returns all descendants of a process. It uses the kernel's lists of children, if they exist. A
/// list may miss a child while other children end. The next call finds such a child.
fn below(root: i32) -> BTreeSet<i32> {
    let mut found = BTreeSet::from([root]);
    let mut open = vec![root];
    while let Some(parent) = open.pop() {
        let Some(children) = children_of(parent) else {
            return below_by_parents(root);
        };
        open.extend(children.into_iter().filter(|it| found.insert(*it)));
    }
    found.remove(&root);
    found
}

fn below_by_parents(root: i32) -> BTreeSet<i32> {
    let all = processes();
    let mut found = BTreeSet::from([root]);
    loop {
        let more = all
            .iter()
            .filter(|(pid, it)| found.contains(&it.parent) && !found.contains(pid));
        let more: Vec<i32> = more.map(|(pid, _)| *pid).collect();
        if more.is_empty() {
            found.remove(&root);
            return found;
        }
        found.extend(more);
    }
}

/// Returns the children of all threads of a process, or `None` if this kernel keeps no lists of
/// children.
fn children_of(process: i32) -> Option<BTreeSet<i32>> {
    if !Path::new("/proc/thread-self/children").exists() {
        return None;
    }
    let threads = std::fs::read_dir(format!("/proc/{process}/task"));
    let mut found = BTreeSet::new();
    for thread in threads.into_iter().flatten().flatten() {
        // A thread that has ended meanwhile has no list.
        let list = std::fs::read_to_string(thread.path().join("children"));
        let list = list.unwrap_or_default();
        found.extend(
            list.split_whitespace()
                .filter_map(|it| it.parse::<i32>().ok()),
        );
    }
    Some(found)
}
