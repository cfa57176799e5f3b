//! Restrictions of a child before its program starts.

use rustix::process::{Resource, setrlimit};
use tokio::process::Command;

use super::Surroundings;

/// Sets the limits that must be set between fork and exec.
#[expect(
    unsafe_code,
    reason = "a child's own limits can only be set in pre_exec"
)]
pub(super) fn restrict(command: &mut Command, surroundings: &Surroundings) {
    let memory = surroundings.memory_limit;
    let descriptors = surroundings.descriptors;
    let with_broker = surroundings.die_with_broker;
    let broker = std::process::id();
    // SAFETY: between fork and exec only async-signal-safe functions are called: close_range,
    // setrlimit, prctl and getppid; nothing is allocated and no lock is taken.
    unsafe {
        command.pre_exec(move || {
            // File descriptors that the broker inherited must not reach the child.
            libc::syscall(
                libc::SYS_close_range,
                3,
                u32::MAX,
                libc::CLOSE_RANGE_CLOEXEC,
            );
            if let Some(bytes) = memory {
                let limit = libc::rlimit {
                    rlim_cur: bytes,
                    rlim_max: bytes,
                };
                if libc::setrlimit(libc::RLIMIT_DATA, &raw const limit) != 0 {
                    return Err(std::io::Error::last_os_error());
                }
            }
            if let Some(limit) = descriptors {
                setrlimit(Resource::Nofile, limit)?;
            }
            if with_broker {
                if libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) != 0 {
                    return Err(std::io::Error::last_os_error());
                }
                // The broker may have died between fork and prctl.
                if u32::try_from(libc::getppid()) != Ok(broker) {
                    return Err(std::io::Error::from_raw_os_error(libc::ESRCH));
                }
            }
            Ok(())
        });
    }
}
