//! The text notation of compiled tables, documented in `docs/schema.md`.
//!
//! One statement per line; types refer to each other by number (`s3` simple, `c7` complex);
//! leading blanks are for the reader's eye. Equal schemas give equal bytes.

mod line;
mod read;
mod write;

/// First line of every table file; the number is raised when a statement changes its meaning.
pub(crate) const HEADER: &str = "qcbus-schema 1";

/// Why a table file cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("read the tables at line {line}: {what}")]
pub struct NotationError {
    /// Line from 1; 0 for the file as a whole.
    pub line: usize,
    /// What is wrong.
    pub what: String,
}
