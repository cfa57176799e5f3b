//! The broker: watches and reads files, publishes them, collects findings and decides verdicts,
//! even when processes fail.
//!
//! This crate joins the other crates of the broker. `main_loop` turns inputs into events for the state
//! machine (crate `qcbus-state`) and executes its actions. It decides nothing itself. `intake` reads
//! and publishes files. `check_context` describes a run, so that another one can take its answers.
//! `memory` returns free memory.

pub mod backend;
mod check_context;
mod descriptors;
mod intake;
mod main_loop;
pub mod memory;
mod options;
mod state_identity;

pub use check_context::check_context;
pub use intake::Intake;
pub use main_loop::{Announcement, Broker, OperatorSignal, Source, StartError, Told, Turn};
pub use options::Options;
