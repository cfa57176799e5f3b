//! Runs unchanged ASAM modules as bundles on the bus.
//!
//! An ASAM module is a program of ASAM's quality checker framework. It is started once for each
//! file, reads a configuration and writes a result file. The adapter has two kinds of processes.
//! The *bus process* is a bundle in the same sandbox as any other. The *runner* is started before
//! it. For each run it creates a private directory with the exact bytes of the documents and a
//! configuration. It runs the module there within limits, ends all of its processes and returns the
//! result file. The bus process judges the result in its sandbox.
//!
//! A module does not list its checkers. They are learned from a run over small valid files
//! (`learn`).

mod bundle;
mod channel;
mod configuration;
mod documents;
mod family;
mod fork_server;
mod host;
mod hosted;
mod learn;
mod look;
mod messages;
mod process;
mod program;
mod report;
mod results;
mod runner;
mod runners;
mod samples;
mod scratch;
mod staging;
pub mod warm;
mod written;

pub use fork_server::goes_where_it_is;
pub use host::run;
pub use hosted::usual_scratch;
pub use report::{ReportFile, ReportModule};
