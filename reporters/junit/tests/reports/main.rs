//! Tests of the JUnit of whole reports.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

mod common;

mod reports;
mod schema;
