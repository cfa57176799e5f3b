//! Tests of the rules for modular scenarios.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

mod archives;
mod cases;
mod combined;
mod pages;
mod readme;
mod robust;
mod templates;
