//! Whether another process is alive, safe against reused process ids.

use std::fs;
use std::os::fd::OwnedFd;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, pidfd_open};

/// A handle on a process that stays with it when the id is used again.
#[derive(Debug)]
pub(crate) struct Process {
    fd: OwnedFd,
}

impl Process {
    /// `None` when there is no such process (any more), or it is not the one that started at
    /// `started`.
    pub(crate) fn open(pid: u32, started: Option<u64>) -> Option<Process> {
        let fd = pidfd_open(
            Pid::from_raw(i32::try_from(pid).ok()?)?,
            PidfdFlags::empty(),
        )
        .ok()?;
        let process = Process { fd };
        // The handle was opened first: when the start time fits now, it fits the handle.
        let same = started.is_none_or(|started| start_time(pid) == Some(started));
        (same && process.is_alive()).then_some(process)
    }

    /// A process that has ended but was not yet waited for counts as dead.
    pub(crate) fn is_alive(&self) -> bool {
        let mut fds = [PollFd::new(&self.fd, PollFlags::IN)];
        let at_once = Timespec::default();
        !matches!(poll(&mut fds, Some(&at_once)), Ok(ready) if ready > 0)
    }
}

/// When a process started, in clock ticks since boot: with the id it names a process for good.
pub(crate) fn start_time(pid: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is the command in parentheses and may contain anything, so the fields are
    // counted from its end: the start time is the 22nd of all (proc(5)).
    let (_, rest) = stat.rsplit_once(')')?;
    rest.split_whitespace().nth(19)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_told_from_another_with_its_id() {
        let own = std::process::id();
        assert!(Process::open(own, start_time(own)).is_some());
        assert!(Process::open(own, Some(1)).is_none());
        assert!(Process::open(0, None).is_none());
        assert!(Process::open(u32::MAX, None).is_none());
    }

    #[test]
    fn a_death_is_seen_before_anybody_has_waited_for_it() {
        let mut child = std::process::Command::new("cat")
            .stdin(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let process = Process::open(child.id(), start_time(child.id())).unwrap();
        assert!(process.is_alive());
        child.kill().unwrap();
        while process.is_alive() {
            std::thread::yield_now();
        }
        child.wait().unwrap();
    }
}
