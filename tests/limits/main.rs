//! Few resources and many clients. A test here raises a limit of its own process.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

#[path = "../support/mod.rs"]
mod support;

mod control;
mod memory;
