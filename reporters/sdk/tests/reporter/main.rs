//! Tests of the parts of every reporter.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

mod daemon;
mod sources;
