//! The warm check: `qcbus check` asks a broker that runs. Whatever that broker is, and whatever becomes of it
//! meanwhile, the check says what it says without one, and leaves nothing there.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot go on fails where it stands"
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
