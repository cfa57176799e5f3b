//! The text notation of compiled tables, documented in `docs/schema.md`.
//!
//! Each line has one statement. Types refer to each other by number (`s3` simple, `c7` complex).
//! Leading blanks have no meaning. Equal schemas give equal bytes.

mod line;
mod read;
mod write;

/// First line of every table file. The number increases when a statement changes its meaning.
pub(crate) const HEADER: &str = "qcbus-schema 1";

/// Reason why a table file cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("read the tables at line {line}: {what}")]
pub struct NotationError {
    /// Line from 1, or 0 for the file as a whole.
    pub line: usize,
    /// Description of the error.
    pub what: String,
}
