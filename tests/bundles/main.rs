//! Bundles on a running broker: added, replaced, killed, misbehaving, hosted.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

#[path = "../support/mod.rs"]
mod support;

mod cli;
mod confined;
mod environment;
mod hosted;
mod impostors;
mod killed;
mod own_bundles;
mod registry;
mod replaced;
mod shadows;
mod zoo;
