//! The bus between real endpoints, in one process and in several.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "this is all test code, including functions without `#[test]`"
)]

mod helper;
mod support;

mod cleaned;
mod deaths;
mod delivery;
mod documents;
mod ending;
mod liars;
mod memory;
mod privacy;
mod torture;
