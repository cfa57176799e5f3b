//! The broker: watches and reads files, publishes them, collects findings and decides verdicts,
//! even when processes fail.
//!
//! `core` decides and performs no action. `engine` performs actions and decides nothing. `watch`
//! detects changes. `intake` reads and publishes files. `store` and `writers` put results on the
//! disk. `journal` stores the state. `directory_lock` excludes other brokers. `supervise` starts
//! and kills children. `control` answers commands. `reload` reads configuration and manifests.
//! `memory` returns free memory. `probes` access files that may never answer.

mod check_context;
pub mod control;
mod core;
pub mod deliveries;
mod demand;
mod descendants;
mod descriptors;
mod directory_lock;
mod engine;
mod environment;
mod final_output;
mod gate;
mod intake;
pub mod journal;
mod launches;
pub mod memory;
mod options;
mod outputs;
mod own_program;
mod probes;
pub mod reload;
mod result_paths;
#[cfg(test)]
mod simulation;
mod stages;
mod stale_children;
mod stamp;
mod state_identity;
mod store;
mod supervise;
mod verdict_file;
pub mod watch;
#[cfg(test)]
mod writer_tests;
mod writers;

pub use check_context::check_context;
pub use core::{ChildSpec, Delivery, Judged, Notice, Restart, Settings};
pub use demand::InForce;
pub use directory_lock::LockError;
pub use engine::{Announcement, Broker, OperatorSignal, StartError, Told};
pub use gate::{GateError, Outside};
pub use options::Options;
pub use own_program::OwnProgram;
pub use result_paths::ResultPaths;
pub use store::GivenResults;
