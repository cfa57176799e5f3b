//! Descendants: processes that bundles have started and left behind.
//!
//! The broker is their subreaper: a process below a child becomes a child of the broker when its
//! parent ends. This is independent of its session and process group.

use std::collections::{BTreeMap, BTreeSet};

use qcbus_bus::Process;
pub use qcbus_confine::descendants::are_listed;
use qcbus_confine::descendants::{bury, children_of, listed, living_below, signal};
use qcbus_types::Launch;
use rustix::process::Signal;

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

/// Kills all descendants of a process. The caller must stop or kill the process itself immediately afterwards.
pub fn kill_below(process: &Process) {
    // The process must not notice the loss of its children and exit with a misleading code.
    signal(process.id().cast_signed(), Signal::STOP);
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

/// Returns all children of this process.
fn children() -> BTreeSet<i32> {
    children_of(std::process::id().cast_signed())
}

fn kill(pid: i32) {
    signal(pid, Signal::KILL);
}
