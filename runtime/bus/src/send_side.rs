//! Target of this process's stderr. A broker reads the stderr of a started process until it has
//! joined.

use std::os::fd::{AsFd as _, BorrowedFd, OwnedFd};

use rustix::fs::fstat;
use rustix::io::{FdFlags, fcntl_dupfd_cloexec, fcntl_setfd};
use rustix::stdio::dup2_stderr;

/// Environment variable that names the lasting stderr: its descriptor number, device and inode,
/// separated by colons. It is set by a process that starts a peer and reads its stderr until it
/// joins.
pub const STDERR: &str = "QCBUS_STDERR";

/// Returns the broker's own stderr, for output that may outlive the broker. The stderr of this
/// process is read by the broker and ends with it. Returns `None` if the stderr is not read.
#[expect(
    unsafe_code,
    reason = "a descriptor that was passed on is known only by its number"
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
    // The variable may be inherited without the descriptor, and the number may belong to another
    // one.
    let stat = fstat(handed).ok()?;
    if (stat.st_dev, stat.st_ino) != (device, inode) {
        return None;
    }
    // Children of this process do not need it.
    fcntl_setfd(handed, FdFlags::CLOEXEC).ok()?;
    fcntl_dupfd_cloexec(handed, 3).ok()
}

/// Redirects stderr to the log after this process has joined. This lasts even if another broker
/// takes over.
pub(crate) fn joined() {
    if let Some(lasting) = lasting_stderr() {
        // If this fails, stderr stays as it is.
        let _ = dup2_stderr(&lasting);
    }
}

/// The two targets of stderr, for a process that lets others join.
#[derive(Debug)]
pub struct SendSide {
    heard: OwnedFd,
    lasting: OwnedFd,
}

impl SendSide {
    /// Returns both targets, or `None` if the stderr is not read.
    pub fn take() -> Option<SendSide> {
        let lasting = lasting_stderr()?;
        let heard = fcntl_dupfd_cloexec(std::io::stderr().as_fd(), 3).ok()?;
        Some(SendSide { heard, lasting })
    }

    /// Redirects stderr to the broker, which reads it.
    pub fn is_heard(&self) {
        let _ = dup2_stderr(&self.heard);
    }

    /// Redirects stderr to the lasting target, because this process may outlive the broker.
    pub fn lasts(&self) {
        let _ = dup2_stderr(&self.lasting);
    }
}
