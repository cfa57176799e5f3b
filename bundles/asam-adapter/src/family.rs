//! All descendants of a process, regardless of their process group or session.
//!
//! A runner is the subreaper of its runs (`PR_SET_CHILD_SUBREAPER`): a process whose parent ends
//! becomes a child of the runner. Therefore all processes of a run are descendants of the runner.
//! Its only other descendants are the fork servers.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use qcbus_confine::descendants::{bury, children_of, living_below, signal};
use rustix::process::Signal;

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
    let mut found = living_below(own());
    found.retain(|pid| !spared.contains(pid));
    found
}

fn own() -> i32 {
    std::process::id().cast_signed()
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
        let ended = children_of(own()).into_iter();
        ended.filter(|pid| !spared.contains(pid)).for_each(bury);
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
