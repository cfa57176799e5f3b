//! Descendants of a process, regardless of their process group or session.
//!
//! A process whose parent ends becomes a child of its nearest subreaper. A subreaper therefore finds
//! all processes that its children have left behind among its own descendants.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};

/// A process as listed by the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Listed {
    /// Process id of its parent.
    pub parent: i32,
    /// Whether it has ended and waits to be reaped.
    pub is_dead: bool,
}

/// Returns the entry of a process, or `None` if there is none.
pub fn listed(pid: i32) -> Option<Listed> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command is in parentheses and may contain any character. State and parent follow it.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut fields = rest.split_whitespace();
    let state = fields.next()?;
    let parent = fields.next()?.parse().ok()?;
    let is_dead = matches!(state, "Z" | "X");
    Some(Listed { parent, is_dead })
}

/// Returns the living descendants of a process. Uses the kernel's lists of children if they exist,
/// because a search through all processes takes milliseconds. A list may miss a child while other
/// children end. A later call finds such a child.
pub fn living_below(root: i32) -> BTreeSet<i32> {
    let is_alive = |pid: &i32| listed(*pid).is_some_and(|it| !it.is_dead);
    let mut found = BTreeSet::from([root]);
    let mut open = vec![root];
    while let Some(parent) = open.pop() {
        let Some(children) = listed_children(parent) else {
            found = below_by_parents(root);
            break;
        };
        open.extend(children.into_iter().filter(|it| found.insert(*it)));
    }
    found.remove(&root);
    found.into_iter().filter(is_alive).collect()
}

/// Returns the children of a process, living or dead.
pub fn children_of(process: i32) -> BTreeSet<i32> {
    listed_children(process).unwrap_or_else(|| {
        let children = processes().into_iter();
        let children = children.filter(|(_, it)| it.parent == process);
        children.map(|(pid, _)| pid).collect()
    })
}

/// Checks whether the kernel lists the children of a process.
pub fn are_listed() -> bool {
    Path::new("/proc/thread-self/children").exists()
}

/// Sends a signal to a process, which may have ended by itself.
pub fn signal(pid: i32, signal: Signal) {
    if let Some(pid) = Pid::from_raw(pid) {
        let _ = kill_process(pid, signal);
    }
}

/// Reaps a child of this process if it has ended. Only for children that no other code waits for.
pub fn bury(pid: i32) {
    if let Some(pid) = Pid::from_raw(pid) {
        let _ = waitpid(Some(pid), WaitOptions::NOHANG);
    }
}

/// Returns the children of all threads of a process, or `None` if this kernel keeps no lists.
fn listed_children(process: i32) -> Option<BTreeSet<i32>> {
    if !are_listed() {
        return None;
    }
    let threads = std::fs::read_dir(format!("/proc/{process}/task"));
    let threads = threads.into_iter().flatten().flatten();
    // A thread that has ended meanwhile has no list.
    let lists = threads.filter_map(|it| std::fs::read_to_string(it.path().join("children")).ok());
    let pids = lists.flat_map(|list| {
        let pids = list.split_whitespace().filter_map(|it| it.parse().ok());
        pids.collect::<Vec<i32>>()
    });
    Some(pids.collect())
}

fn below_by_parents(root: i32) -> BTreeSet<i32> {
    let all = processes();
    let mut found = BTreeSet::from([root]);
    loop {
        let children = all.iter().filter(|(_, it)| found.contains(&it.parent));
        let more: BTreeSet<i32> = children.map(|(pid, _)| *pid).collect();
        let before = found.len();
        found.extend(more);
        if found.len() == before {
            return found;
        }
    }
}

fn processes() -> BTreeMap<i32, Listed> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = entries.filter_map(|it| it.file_name().to_str()?.parse::<i32>().ok());
    numbers
        .filter_map(|pid| Some((pid, listed(pid)?)))
        .collect()
}
