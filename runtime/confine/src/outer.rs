//! The ring that the broker draws around a bundle before its program begins.

use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use qcbus_formats::manifest::May;

use crate::SandboxError;
use crate::rules::{Rules, everything, reading};

/// What a bundle writes to while it joins. Devices that take everything and keep nothing are harmless.
const WRITTEN: &[&str] = &[
    "/dev/shm",
    "/dev/null",
    "/dev/zero",
    "/dev/full",
    "/dev/tty",
];

/// A ring to be drawn around one process.
#[derive(Debug)]
pub struct Outer(OwnedFd);

impl Outer {
    /// The ring for a bundle. `None`: this kernel has no Landlock.
    ///
    /// # Errors
    /// [`SandboxError::Kernel`].
    pub fn new(may: &May) -> Result<Option<Outer>, SandboxError> {
        let mut rules = Rules::new(may.network)?.allow("/", reading())?;
        for path in WRITTEN {
            rules = rules.allow(path, everything())?;
        }
        for path in &may.write {
            rules = rules.allow(path, everything())?;
        }
        Ok(rules.into_descriptor().map(Outer))
    }

    /// Has a process begin its life inside.
    #[expect(
        unsafe_code,
        reason = "only the new process itself can step into the ring, between fork and exec"
    )]
    pub fn surround(self, command: &mut Command) {
        let ring = self.0;
        // SAFETY: between fork and exec only two system calls are made; nothing is allocated and no lock is taken.
        // The descriptor belongs to the closure, which lives as long as the command.
        unsafe {
            command.pre_exec(move || {
                let set = libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
                let failed = || Err(std::io::Error::last_os_error());
                if set != 0 {
                    return failed();
                }
                match libc::syscall(libc::SYS_landlock_restrict_self, ring.as_raw_fd(), 0) {
                    0 => Ok(()),
                    _ => failed(),
                }
            });
        }
    }
}
