//! Warm runs: one Python interpreter imports a checker module once and forks a process for each job.
//!
//! Importing is most of what a one-shot module costs for a small file. [`recognise`] reads the command of a manifest and
//! says what Python program a shell would run for it; a [`Server`] is an interpreter that has executed the imports with which
//! that program begins; [`Server::spawn`] forks it, and the fork executes the program from its first line, as `__main__`,
//! with arguments, environment, directory and streams of its own. Nothing that a job does is seen by the next.
//!
//! A warm run must be a plain one, only sooner. What cannot be known to be so is not done: [`WhyCold`] says why, and the
//! caller runs the command plainly.

mod command;
mod entry;
mod server;
mod stamps;
mod wire;

pub use entry::{Entry, recognise};
pub use server::{Limits, Run, Server, SpawnError};

/// Why a program is run plainly: a sentence for people, after "not kept warm: ".
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct WhyCold(String);

impl WhyCold {
    pub(crate) fn new(why: impl Into<String>) -> WhyCold {
        WhyCold(why.into())
    }
}
