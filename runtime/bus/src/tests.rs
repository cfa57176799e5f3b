//! Tests of the broker's end of the bus with peers that do not use this crate's [`Peer`](crate::Peer).

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "this is all test code, including functions without `#[test]`"
)]

#[expect(dead_code, reason = "the integration tests use all of them")]
#[path = "../tests/bus/support.rs"]
mod support;

mod fuzz;
mod hostile;
mod rogue;
