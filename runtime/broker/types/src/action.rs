//! Actions that the state machine requests.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::control::Response;
use qcbus_messages::{JobId, ToPeer};

use crate::notice::Notice;
use crate::required_set::Member;
use crate::values::{
    ChildSpec, Delivery, FinishedJob, Judged, Launch, RequestId, SessionId, Stamp,
};

/// An action that the state machine requests.
#[derive(Debug)]
pub enum Action {
    /// Read the file and its dependencies, and publish the images.
    Prepare {
        /// The job.
        job: JobId,
        /// The file.
        path: Arc<Path>,
        /// Time since the file arrived or was last requested. No data that is read may be older.
        waited: Duration,
    },
    /// Release the documents of a job except the root, because no bundle reads them any more.
    ReleaseParts {
        /// The job.
        job: JobId,
    },
    /// Release the documents of a job.
    Release {
        /// The job.
        job: JobId,
    },
    /// Publish a document again.
    PublishAgain {
        /// The job that needs it.
        job: JobId,
        /// The document.
        doc: qcbus_messages::DocId,
    },
    /// Send a message to a peer.
    Send {
        /// The session of the peer.
        session: SessionId,
        /// The message.
        message: ToPeer,
    },
    /// Open a session.
    Accept {
        /// The session.
        session: SessionId,
    },
    /// Reject a peer.
    Refuse {
        /// The session.
        session: SessionId,
        /// The reason as a text for the user.
        reason: String,
    },
    /// Close a session.
    Disconnect {
        /// The session.
        session: SessionId,
    },
    /// Start a child.
    Spawn {
        /// Identifier of this start.
        launch: Launch,
        /// Specification of the child.
        spec: ChildSpec,
    },
    /// Kill a child that does not respond.
    Kill {
        /// Start of the child.
        launch: Launch,
    },
    /// Kill stale children: former brokers of this instance started them, and they have not joined this one.
    KillStaleChildren {
        /// Starts of the children that have joined.
        joined: BTreeSet<Launch>,
    },
    /// Pool the findings, write the result and record it.
    Store(Box<FinishedJob>),
    /// Pool the findings of an on-demand check.
    Pool(Box<FinishedJob>),
    /// Remove the result of a file that was removed.
    Withdraw {
        /// The file.
        path: Arc<Path>,
        /// Reporters that have reported the file and must withdraw their report.
        reporters: Vec<String>,
    },
    /// Tell a reporter that a file was removed.
    Void {
        /// The reporter's session.
        session: SessionId,
        /// The reporter.
        reporter: String,
        /// The file.
        path: Arc<Path>,
    },
    /// Record that a reporter has withdrawn its report of a file that was removed.
    Voided {
        /// The reporter.
        reporter: String,
        /// The file.
        path: Arc<Path>,
    },
    /// Record that a file was checked and found unchanged.
    Restamp {
        /// The file.
        path: Arc<Path>,
        /// Its verdict with new stamps.
        judged: Arc<Judged>,
    },
    /// Send a result to a reporter.
    Deliver {
        /// The session of the reporter.
        session: SessionId,
        /// The name of the reporter.
        reporter: String,
        /// The result.
        delivery: Delivery,
    },
    /// Record that a reporter has received a result.
    Delivered {
        /// The name of the reporter.
        reporter: String,
        /// The file.
        path: Arc<Path>,
        /// The job.
        job: JobId,
    },
    /// Answer a client.
    Answer {
        /// Request id of the client.
        request_id: RequestId,
        /// The answer.
        response: Response,
    },
    /// Record that a bundle is required. This happens before any verdict of this bundle.
    Enrol(Member),
    /// Record that a bundle is no longer required.
    Strike {
        /// The name of the bundle.
        name: String,
    },
    /// Watch these paths for changes even if no check of them was requested.
    Depend {
        /// The paths, each with the stamp under which it was read.
        files: Vec<(Arc<Path>, Option<Stamp>)>,
    },
    /// Stop watching these paths, because no verdict depends on them any more.
    Undepend {
        /// The paths.
        paths: Vec<Arc<Path>>,
    },
    /// Withdraw the file from the gate at once, with every file that rests on it. A file that its
    /// acceptance rests on has changed.
    CloseGate {
        /// The file.
        path: Arc<Path>,
    },
    /// Publish the file again, because its acceptance is still valid.
    OpenGate {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
    },
    /// Tell all listeners that a verdict is valid.
    Judged {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
        /// `false` if the verdict was already valid before.
        fresh: bool,
    },
    /// Delete the findings of a shadow, in one file or in all files.
    ForgetTrials {
        /// The shadow.
        shadow: String,
        /// The file; `None` for all.
        file: Option<Arc<Path>>,
    },
    /// Show a message to the user.
    Notice(Notice),
    /// Leave the loop, because everything is drained.
    Stop,
}

impl Action {
    /// Returns the action that kills a process that has not joined. Such a process has no work to finish.
    pub fn kill_unjoined(launch: Launch) -> Action {
        Action::Kill { launch }
    }
}
