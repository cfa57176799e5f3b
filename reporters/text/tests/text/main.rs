//! Tests of the text of reports.

#![expect(clippy::unwrap_used, reason = "a test that cannot continue panics")]

mod concise;
mod once;
mod reports;
