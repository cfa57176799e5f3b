//! The broker with its directories, its clients and its limits.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

#[path = "../support/mod.rs"]
mod support;

mod copied;
mod failures;
mod file_names;
mod gate;
mod hidden;
mod hostile_files;
mod live_changes;
mod ownership;
mod removed;
mod reported;
mod rests_on;
mod serve;
mod stamps;
mod supervised;
mod unfinished;
mod zero_copy;
