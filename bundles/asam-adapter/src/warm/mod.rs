//! Forked runs: one Python interpreter imports a checker module once and forks a process for each
//! job.
//!
//! For a small file most of the time of an ASAM module is spent on imports. [`recognise`] finds the
//! Python program that a shell would run for the command of a manifest. A [`Server`] is an
//! interpreter that has executed the first imports of that program. [`Server::spawn`] forks it. The
//! fork executes the program from its first line as `__main__`, with its own arguments,
//! environment, directory and streams. A job cannot affect the next one.
//!
//! A forked run must give the same results as a plain run. If this is not certain, [`WhyCold`] says
//! why, and the caller runs the command plainly.

mod command;
mod entry;
mod server;
mod stamps;
mod wire;

pub use entry::{Entry, recognise};
pub(crate) use server::die_with;
pub use server::{Limits, Run, Server, SpawnError};

/// Reason why a program is run plainly: a sentence for users, after "not kept warm: ".
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct WhyCold(String);

impl WhyCold {
    pub(crate) fn new(why: impl Into<String>) -> WhyCold {
        WhyCold(why.into())
    }
}
