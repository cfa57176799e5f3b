//! Tests of reading: XML, includes, references, modular scenarios, hostile files.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

mod corpus;
mod digests;
mod fuzz;
mod fuzzing;
mod gather;
mod hostile;
mod includes;
mod modular;
mod references;
mod well_formedness;
