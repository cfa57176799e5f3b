//! One-shot modules of ASAM's quality checker framework as bundles on the bus, unchanged.
//!
//! Such a module is a program that is started once for every file, reads a configuration, and writes a result file.
//! The adapter is two kinds of processes. The *bus process* is a bundle like any other, confined like any other. The
//! *office*, started before that, gives every run a private directory with the very bytes of the documents and a
//! configuration, runs the module there within limits, ends everything that it leaves, and hands back what it wrote.
//! What a result says is read and judged by the bus process, behind its fence.
//!
//! Which checkers a module has it does not tell: they are learned from a run over small valid files ([`learn`]).

mod bundle;
mod channel;
mod configuration;
mod documents;
mod family;
mod fork_server;
mod host;
mod hosted;
mod learn;
mod messages;
mod pending;
mod process;
mod program;
mod report;
mod results;
mod runner;
mod runners;
mod samples;
mod scratch;
pub mod warm;
mod written;

pub use fork_server::goes_where_it_is;
pub use host::run;
pub use hosted::{Hosted, Limits, usual_scratch};
pub use program::Program;
pub use report::{ReportFile, ReportModule};
