//! A broker under a tracer: it is killed at a system call, or gets a false answer to one.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

#[path = "../support/mod.rs"]
mod support;

mod crash_points;
mod disk_faults;
