//! Tests of checker bundles.
//!
//! [`pages`] runs the examples of the rules' pages. [`mutate`] edits valid files and compares the findings with the expected ones. [`robust`] damages
//! files. [`corpus`] compares findings with those that other tools recorded. These are used only in
//! tests.

pub mod corpus;
pub mod mutate;
pub mod pages;
pub mod robust;

/// Writes a note about skipped or failed cases to stderr.
pub(crate) fn note(text: &str) {
    use std::io::Write as _;
    // The error is ignored, because the note is only an aid.
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Checks whether a rule has run and leaves the verdict open because no rule judges the version of
/// the file. `reason` is that of its ending.
pub(crate) fn leaves_open(reason: &str) -> bool {
    reason.starts_with(qcbus_sdk::UNKNOWN_VERSION)
}
