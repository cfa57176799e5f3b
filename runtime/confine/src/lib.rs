//! What a bundle may do to others, taken from it for good.
//!
//! There are two rings, because a bundle that joins must make and open what afterwards it must not:
//!
//! - The *outer* ring ([`Outer`]) is drawn by the broker around every bundle that it starts, before the program
//!   begins: nothing outside of shared memory is written, no network, no signals to others. A program cannot
//!   step over it, whatever it is made of.
//! - The *inner* ring ([`confine`]) is drawn by the bundle itself once it has joined: nothing is opened for
//!   writing any more, nothing is read but what was declared, no process is started. Everything that it writes
//!   from then on goes to what it has open: its own streams.
//!
//! What lies inside cannot be widened again, so a session that is lost is followed by one in a fresh process:
//! [`run_sessions`] starts them.

mod calls;
mod inner;
mod launcher;
mod looks;
mod orders;
mod outer;
mod rules;

pub use inner::{Sandboxed, confine};
pub use launcher::{After, LauncherEnd, run_sessions};
pub use looks::{Looks, looks, own_filters};
pub use orders::{Orders, SandboxError};
pub use outer::Outer;

/// How much of Landlock the running kernel has, as it numbers it; 0: none.
#[expect(unsafe_code, reason = "the crate does not tell what the kernel has")]
pub fn kernel_level() -> u32 {
    const TELL_THE_LEVEL: libc::c_uint = 1;
    let nothing = std::ptr::null::<libc::c_void>();
    // SAFETY: without a set of rules the call makes nothing and only answers.
    let level = unsafe {
        libc::syscall(
            libc::SYS_landlock_create_ruleset,
            nothing,
            0_usize,
            TELL_THE_LEVEL,
        )
    };
    u32::try_from(level).unwrap_or(0)
}
