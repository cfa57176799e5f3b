//! Tests of the file formats: configurations, manifests, results, pooling.

#![expect(clippy::unwrap_used, reason = "a test that cannot continue panics")]

#[path = "../../fuzz/bodies.rs"]
mod bodies;
mod common;

mod config;
mod manifest;
mod pool;
mod python;
mod round_trip;
mod same_fault;
mod seeded_fuzz;
mod xqar;
