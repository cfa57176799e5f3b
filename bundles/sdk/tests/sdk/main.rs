//! Tests of the parts of every bundle: rules, threads, cached models, the bus.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

mod common;
#[path = "common/on_bus.rs"]
mod on_bus;
#[path = "common/roads.rs"]
mod roads;

mod at_once;
mod bus;
mod checking;
mod kept;
mod parts;
mod threads;
