//! Tests of schemas: the compiler, the shipped tables, the check of documents.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test that cannot continue panics"
)]

mod support;

mod check;
mod compiler;
mod patterns;
mod tables;
mod typing;
mod user_schemas;
mod verdicts;
