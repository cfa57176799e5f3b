//! Tests of the broker's end of the bus with peers that do not use this crate's [`Peer`](crate::Peer).

#[expect(dead_code, reason = "the integration tests use all of them")]
#[path = "../tests/bus/support.rs"]
mod support;

mod fuzz;
mod hostile;
mod rogue;
