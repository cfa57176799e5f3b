//! Publication of results: result files, verdict files, the gate for accepted files, and the journal
//! that stores the state.
//!
//! `store` writes and withdraws the results of a job. `writers` are the threads that do so. `gate`
//! publishes accepted files. `outputs` watches the written files, because other processes may change
//! them. `directory_lock` excludes other brokers. `deliveries` reads results back for reporters.

pub mod deliveries;
pub mod directory_lock;
pub mod gate;
pub mod journal;
pub mod outputs;
pub mod result_paths;
pub mod store;
mod verdict_file;
#[cfg(test)]
mod writer_tests;
pub mod writers;
