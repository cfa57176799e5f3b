//! Tests of the on-demand check: `qcbus check` asks a running broker. Whatever happens to that
//! broker, the check has the same outcome as without a broker and leaves nothing behind.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

mod support;

#[path = "warm/bench.rs"]
mod bench;
#[path = "warm/failures.rs"]
mod failures;
#[path = "warm/leftovers.rs"]
mod leftovers;
#[path = "warm/others.rs"]
mod others;
#[path = "warm/same.rs"]
mod same;
