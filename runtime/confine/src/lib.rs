//! Sandbox: permanently restricts what a bundle may do to others.
//!
//! There are two sandboxes, because a joining bundle must create and open files that it must not
//! access afterwards:
//!
//! - The broker applies the *outer* sandbox ([`Outer`]) to every bundle that it starts, before the
//!   program begins. It forbids writing outside of shared memory, network access and signals to
//!   others. No program can bypass it.
//! - The bundle applies the *inner* sandbox ([`confine`]) to itself once it has joined. It opens
//!   nothing for writing, reads only declared files and starts no process. It then writes only to
//!   its open files: its own streams.
//!
//! [`descendants`] finds all processes that a program has started.
//!
//! A sandbox cannot be widened again, so [`run_sessions`] starts a fresh process after a lost
//! session.

mod calls;
pub mod descendants;
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

/// Returns the Landlock version of the running kernel, or 0 if it has none.
#[expect(
    unsafe_code,
    reason = "the crate does not return the Landlock version of the kernel"
)]
pub fn kernel_level() -> u32 {
    const TELL_THE_LEVEL: libc::c_uint = 1;
    let nothing = std::ptr::null::<libc::c_void>();
    // SAFETY: without a set of rules the call creates nothing and only returns a number.
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
