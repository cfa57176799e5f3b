//! Checks whether another process is alive, safe against reused process ids.

use std::fs;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{
    Pid, PidfdFlags, Signal, getpgid, kill_process_group, pidfd_open, pidfd_send_signal,
};

/// A handle on a process. It stays valid for this process when the id is reused.
#[derive(Debug, Clone)]
pub struct Process {
    pid: Pid,
    fd: Arc<OwnedFd>,
}

impl Process {
    /// Opens a process. Returns `None` if it does not exist, or if it did not start at `started`,
    /// in clock ticks since boot.
    pub fn open(pid: u32, started: Option<u64>) -> Option<Process> {
        let id = Pid::from_raw(i32::try_from(pid).ok()?)?;
        let process = Process::from_fd(id, pidfd_open(id, PidfdFlags::empty()).ok()?);
        // The handle was opened first. If the start time matches now, it matches the handle.
        let same = started.is_none_or(|started| start_time(pid) == Some(started));
        (same && process.is_alive()).then_some(process)
    }

    pub(crate) fn from_fd(pid: Pid, fd: OwnedFd) -> Process {
        let fd = Arc::new(fd);
        Process { pid, fd }
    }

    /// Returns its id, which is unique only while the process lives.
    pub fn id(&self) -> u32 {
        self.pid.as_raw_nonzero().get().unsigned_abs()
    }

    /// Checks whether it is alive. An ended process that was not waited for counts as dead.
    pub fn is_alive(&self) -> bool {
        !self.ends_within(Duration::ZERO)
    }

    /// Waits for its end, up to a limit, and returns whether it has ended.
    pub fn ends_within(&self, limit: Duration) -> bool {
        let mut fds = [PollFd::new(&self.fd, PollFlags::IN)];
        let limit = Timespec::try_from(limit).ok();
        matches!(poll(&mut fds, limit.as_ref()), Ok(ready) if ready > 0)
    }

    /// Checks whether the process is stopped, so that it does nothing until it is continued.
    pub fn is_stopped(&self) -> bool {
        let state = stat(self.id()).and_then(|rest| rest.chars().next());
        matches!(state, Some('T' | 't')) && self.is_alive()
    }

    /// Kills the process, with its group if it leads one. A later process with the same id is not
    /// affected.
    pub fn kill(&self) {
        let leads = self.is_alive() && getpgid(Some(self.pid)) == Ok(self.pid);
        if leads {
            // It lived a moment ago, so it owns the id. Its group owns the id as long as it has a
            // member.
            let _ = kill_process_group(self.pid, Signal::KILL);
        }
        // The process may have ended by itself.
        let _ = pidfd_send_signal(&self.fd, Signal::KILL);
    }
}

/// Returns the start time of a process in clock ticks since boot. With the id it is unique.
pub(crate) fn start_time(pid: u32) -> Option<u64> {
    // This is the 22nd field of the whole line.
    stat(pid)?.split_whitespace().nth(19)?.parse().ok()
}

/// Returns the data of a process from proc(5), starting with the third field, its state.
fn stat(pid: u32) -> Option<String> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is the command in parentheses and may contain anything.
    let (_, rest) = stat.rsplit_once(')')?;
    Some(rest.trim_start().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn process_is_distinguished_from_another_with_its_id() {
        let own = std::process::id();
        assert!(Process::open(own, start_time(own)).is_some());
        assert!(Process::open(own, Some(1)).is_none());
        assert!(Process::open(0, None).is_none());
        assert!(Process::open(u32::MAX, None).is_none());
    }

    #[test]
    fn process_is_killed_only_with_its_own_group() {
        use std::os::unix::process::CommandExt as _;
        let start = |group: bool| {
            let mut command = std::process::Command::new("sleep");
            command.arg("1000");
            if group {
                command.process_group(0);
            }
            command.spawn().unwrap()
        };
        for group in [true, false] {
            let mut child = start(group);
            let mut bystander = start(false);
            let process = Process::open(child.id(), None).unwrap();
            assert_eq!(process.id(), child.id());
            process.kill();
            assert!(!child.wait().unwrap().success());
            // The process no longer exists.
            process.kill();
            assert!(bystander.try_wait().unwrap().is_none());
            bystander.kill().unwrap();
            bystander.wait().unwrap();
        }
    }

    #[test]
    fn death_is_noticed_before_the_process_is_reaped() {
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
