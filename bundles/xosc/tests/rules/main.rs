//! Tests of the OpenSCENARIO rules.

#![expect(clippy::unwrap_used, reason = "a test that cannot continue panics")]

mod corpus;
mod coverage;
mod expressions;
mod mutation;
mod pages;
mod robust;
mod seeded;
mod templates;
