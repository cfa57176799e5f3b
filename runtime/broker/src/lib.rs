//! The broker: watches, reads, publishes, collects, judges, and keeps its word when anything dies.
//!
//! `core` decides and does nothing; `engine` does and decides nothing. Everything else is a pair
//! of hands: `watch` sees files, `intake` reads and publishes them, `store` and `writers` put
//! results on the disk, `journal` remembers, `directory_lock` keeps others out, `supervise` starts
//! and kills, `control` answers commands, `reload` reads configuration and manifests, `memory`
//! gives back what was taken, `probes` look at files that may never answer.

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
