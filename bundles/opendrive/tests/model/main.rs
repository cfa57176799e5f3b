//! Tests of the model of a road network.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that cannot continue panics, and a skipped test is reported"
)]

mod common;

mod curves;
mod golden_points;
mod hostile;
mod lanes;
mod links;
mod real_maps;
