//! Whom this process speaks to on its stderr: a broker listens to what it has started until that has joined.

use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};

use rustix::fs::fstat;
use rustix::io::{FdFlags, fcntl_dupfd_cloexec, fcntl_setfd};
use rustix::stdio::dup2_stderr;

/// The environment variable in which whoever starts a peer, and listens to its stderr until it has joined, says which
/// descriptor is the lasting one: its number, device and inode, with colons between.
pub const STDERR: &str = "QCBUS_STDERR";

/// The broker's own stderr, for what may outlive the broker: this process has the broker's ear for its stderr, which
/// goes with the broker. `None`: nobody listens.
#[expect(
    unsafe_code,
    reason = "a descriptor that was handed over is known by its number only"
)]
pub fn lasting_stderr() -> Option<OwnedFd> {
    let told = std::env::var(STDERR).ok()?;
    let mut numbers = told.split(':').map(str::parse::<u64>);
    let mut next = || numbers.next()?.ok();
    let (number, device, inode) = (i32::try_from(next()?).ok()?, next()?, next()?);
    if number <= 2 {
        return None;
    }
    // SAFETY: the descriptor is only borrowed, for calls that refuse a number that is not open.
    let handed = unsafe { BorrowedFd::borrow_raw(number) };
    // The variable may have come here without the descriptor, and the number may be that of another one.
    let stat = fstat(handed).ok()?;
    if (stat.st_dev, stat.st_ino) != (device, inode) {
        return None;
    }
    // What this process starts in its turn has no use for it.
    fcntl_setfd(handed, FdFlags::CLOEXEC).ok()?;
    fcntl_dupfd_cloexec(handed, 3).ok()
}

/// This process has joined: what it says from now on goes to the log, also when another broker has taken over.
pub(crate) fn joined() {
    if let Some(lasting) = lasting_stderr() {
        // Where that fails, it goes on as it is.
        let _ = dup2_stderr(&lasting);
    }
}

/// The two that a process may speak to, for one that has others join.
#[derive(Debug)]
pub struct SendSide {
    heard: OwnedFd,
    lasting: OwnedFd,
}

impl SendSide {
    /// `None`: nobody listens.
    pub fn take() -> Option<SendSide> {
        let lasting = lasting_stderr()?;
        let heard = fcntl_dupfd_cloexec(std::io::stderr().as_fd(), 3).ok()?;
        Some(SendSide { heard, lasting })
    }

    /// The broker listens.
    pub fn is_heard(&self) {
        let _ = dup2_stderr(&self.heard);
    }

    /// The broker may end, and this process goes on.
    pub fn lasts(&self) {
        let _ = dup2_stderr(&self.lasting);
    }
}
