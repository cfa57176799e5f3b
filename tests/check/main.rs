//! Checks on demand: the command line, its outputs, and checks with and without a broker.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

#[path = "../support/mod.rs"]
mod support;

mod asam;
mod command_line;
mod demanded;
mod esmini;
mod farm;
mod hosted_real;
mod hostile;
mod levels;
mod modular;
mod output;
mod own_schemas;
mod pages;
mod references;
mod same_fault;
mod timeline;
mod warm;
