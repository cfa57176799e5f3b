//! Everything that can happen to the broker.

use std::path::Path;
use std::sync::Arc;

use qcbus_messages::{Digest, FromPeer, Hello, JobId};

use super::on_demand::{OnDemand, OnDemandOutcome};
use super::types::{
    ChildEnd, ChildSpec, Demand, Launch, LostOutput, PrepareFailure, PreparedJob, RequestId,
    SessionId, Stamp, StoreOutcome,
};
use super::waits::Until;

/// Everything that can happen to the broker.
#[derive(Debug)]
pub enum Event {
    /// A file is there and quiet: new, changed, or seen in a scan.
    Settled {
        /// Absolute path.
        path: Arc<Path>,
        /// What `stat` says.
        stamp: Stamp,
    },
    /// A file was seen in the first look at everything, and may still be written to: it is there,
    /// and [`Event::Settled`] follows.
    Present {
        /// Absolute path.
        path: Arc<Path>,
    },
    /// A file that has no verdict of its own is there and quiet: verdicts may depend on it.
    Touched {
        /// Absolute path.
        path: Arc<Path>,
        /// What `stat` says.
        stamp: Stamp,
    },
    /// A file has gone.
    Vanished {
        /// Absolute path.
        path: Arc<Path>,
    },
    /// Somebody has removed or changed results, or copies behind the gate.
    OutputsLost {
        /// Which.
        lost: Vec<LostOutput>,
    },
    /// The first scan is complete.
    Scanned,
    /// Reading a file is over.
    Prepared {
        /// The job.
        job: JobId,
        /// What it gave.
        result: Result<Box<PreparedJob>, PrepareFailure>,
    },
    /// Storing a result is over.
    Stored {
        /// The job.
        job: JobId,
        /// What it gave.
        outcome: StoreOutcome,
    },
    /// A file whose acceptance stands after all is behind the gate again, or held back there.
    Opened {
        /// Its path.
        path: Arc<Path>,
    },
    /// That a file has gone is in the journal, with who is to take back a report about it.
    Withdrawn {
        /// Its path.
        path: Arc<Path>,
    },
    /// A peer says hello.
    Hello {
        /// Its session.
        session: SessionId,
        /// Its words.
        hello: Hello,
    },
    /// A peer says something.
    Message {
        /// Its session.
        session: SessionId,
        /// Its words.
        message: FromPeer,
    },
    /// A peer sends what is no message.
    Garbage {
        /// Its session.
        session: SessionId,
        /// What is wrong.
        what: String,
    },
    /// A peer's process is dead.
    Gone {
        /// Its session.
        session: SessionId,
    },
    /// A result could not be read back for a reporter.
    Undeliverable {
        /// The reporter's session.
        session: SessionId,
        /// The job.
        job: JobId,
        /// Why.
        why: String,
    },
    /// A child could not be started or has ended.
    Exited {
        /// Which start.
        launch: Launch,
        /// How.
        end: ChildEnd,
    },
    /// A configuration is in force from now on.
    Configured {
        /// Its digest.
        digest: Digest,
        /// What it demands.
        demand: Arc<dyn Demand>,
    },
    /// The children that should run from now on.
    Children {
        /// All of them.
        specs: Vec<ChildSpec>,
    },
    /// A file is being written to.
    Unfinished {
        /// The file.
        path: Arc<Path>,
        /// What it is at this moment.
        stamp: Option<Stamp>,
    },
    /// A client waits for a verdict.
    Wait {
        /// The client.
        request_id: RequestId,
        /// The file.
        path: Arc<Path>,
        /// What `stat` says of it now, if it is there and at rest. Otherwise an event will tell.
        stamp: Option<Stamp>,
        /// Why nobody will ever check it, if so.
        unwatched: Option<String>,
        /// What for, and when to give up.
        until: Until,
    },
    /// A client wants a file checked for itself alone.
    Check {
        /// The file.
        path: Arc<Path>,
        /// Who wants it, and by whom.
        on_demand: OnDemand,
    },
    /// What was found for an errand is pooled.
    Pooled {
        /// The job.
        job: JobId,
        /// What it gave.
        outcome: OnDemandOutcome,
    },
    /// A client that waited has left without its answer.
    ClientLeft {
        /// The client.
        request_id: RequestId,
    },
    /// Somebody wants a bundle off the roster that is there by joining.
    RemoveBundle {
        /// The client.
        request_id: RequestId,
        /// The bundle.
        name: String,
    },
    /// Stop taking files, finish what is there, stop.
    Drain,
    /// Time has passed.
    Tick,
}
