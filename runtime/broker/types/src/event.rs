//! Events that the broker handles.

use std::path::Path;
use std::sync::Arc;

use qcbus_messages::{Digest, FromPeer, Hello, JobId};

use crate::requests::Until;
use crate::requests::{OnDemand, OnDemandOutcome};
use crate::values::{
    ChildEnd, ChildSpec, Demand, Launch, LostOutput, PrepareFailure, PreparedJob, RequestId,
    SessionId, Stamp, StoreOutcome,
};

/// An event that the broker handles.
#[derive(Debug)]
pub enum Event {
    /// A file exists and has settled: it is new, changed or was seen in a scan.
    Settled {
        /// Absolute path.
        path: Arc<Path>,
        /// Its stamp from `stat`.
        stamp: Stamp,
    },
    /// The first scan has found a file, which may still be written to. [`Event::Settled`] follows.
    Present {
        /// Absolute path.
        path: Arc<Path>,
    },
    /// A file without a verdict of its own exists and has settled. Verdicts may depend on it.
    Touched {
        /// Absolute path.
        path: Arc<Path>,
        /// Its stamp from `stat`.
        stamp: Stamp,
    },
    /// A file was removed.
    Vanished {
        /// Absolute path.
        path: Arc<Path>,
    },
    /// Another process has removed or changed results, or copies behind the gate.
    OutputsLost {
        /// The lost outputs.
        lost: Vec<LostOutput>,
    },
    /// The first scan is complete.
    Scanned,
    /// A file was read.
    Prepared {
        /// The job.
        job: JobId,
        /// Result of reading.
        result: Result<Box<PreparedJob>, PrepareFailure>,
    },
    /// The storing of a result has ended.
    Stored {
        /// The job.
        job: JobId,
        /// Outcome of storing.
        outcome: StoreOutcome,
    },
    /// A file with a confirmed acceptance is behind the gate again, or was held back there.
    Opened {
        /// Its path.
        path: Arc<Path>,
    },
    /// The journal has recorded that a file was removed, and the reporters that must withdraw their report.
    Withdrawn {
        /// Its path.
        path: Arc<Path>,
    },
    /// A peer sends its hello.
    Hello {
        /// Its session.
        session: SessionId,
        /// Content of the hello.
        hello: Hello,
    },
    /// A peer sends a message.
    Message {
        /// Its session.
        session: SessionId,
        /// The message.
        message: FromPeer,
    },
    /// A peer sends an invalid message.
    Garbage {
        /// Its session.
        session: SessionId,
        /// Description of the fault.
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
        /// The job of the result.
        job: JobId,
        /// The reason.
        why: String,
    },
    /// A child could not be started or has ended.
    Exited {
        /// Identifier of the start.
        launch: Launch,
        /// How it ended.
        end: ChildEnd,
    },
    /// A new configuration is in force.
    Configured {
        /// Its digest.
        digest: Digest,
        /// Demand of the configuration.
        demand: Arc<dyn Demand>,
    },
    /// The list of children that must run has changed.
    Children {
        /// All children.
        specs: Vec<ChildSpec>,
    },
    /// A file is being written to.
    Unfinished {
        /// The file.
        path: Arc<Path>,
        /// Its stamp at this moment.
        stamp: Option<Stamp>,
    },
    /// A client waits for a verdict.
    Wait {
        /// Request id of the client.
        request_id: RequestId,
        /// The file.
        path: Arc<Path>,
        /// Its stamp from `stat` if it exists and has settled. Otherwise an event follows.
        stamp: Option<Stamp>,
        /// Reason why the file will never be checked, or `None`.
        unwatched: Option<String>,
        /// Goal and timeout of the wait.
        until: Until,
    },
    /// A client requests an on-demand check of a file.
    Check {
        /// The file.
        path: Arc<Path>,
        /// The client, and the bundles that must check the file.
        on_demand: OnDemand,
    },
    /// The findings of an on-demand check are pooled.
    Pooled {
        /// The job.
        job: JobId,
        /// The outcome.
        outcome: OnDemandOutcome,
    },
    /// A waiting client has disconnected before its answer.
    ClientLeft {
        /// Request id of the client.
        request_id: RequestId,
    },
    /// A client wants to remove a joined bundle from the registry.
    RemoveBundle {
        /// Request id of the client.
        request_id: RequestId,
        /// The bundle.
        name: String,
    },
    /// The broker must accept no new files, finish its jobs and stop.
    Drain,
    /// Time has passed.
    Tick,
}
