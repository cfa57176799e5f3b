//! Tests of the OpenDRIVE rules.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

mod corpus;
mod coverage;
mod mutation;
mod pages;
mod robust;
mod seeded;
mod templates;
mod text;
mod tricky;
