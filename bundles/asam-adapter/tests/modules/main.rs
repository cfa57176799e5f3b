//! Tests of hosted modules as a user runs them.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

mod guests;
mod kept;
