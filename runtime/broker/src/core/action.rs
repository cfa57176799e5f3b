//! Everything that the state machine wants done.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::control::Response;
use qcbus_messages::{JobId, ToPeer};

use super::notice::Notice;
use super::required_set::Member;
use super::types::{ChildSpec, Delivery, FinishedJob, Judged, Launch, RequestId, SessionId, Stamp};

/// Everything that the state machine wants done.
#[derive(Debug)]
pub enum Action {
    /// Read the file and its dependencies, publish the images.
    Prepare {
        /// The job.
        job: JobId,
        /// The file.
        path: Arc<Path>,
        /// How long ago it came or was last asked for: nothing that is read may be older.
        waited: Duration,
    },
    /// Let go of a job's documents apart from the root: nobody reads them any more.
    ReleaseParts {
        /// The job.
        job: JobId,
    },
    /// Let go of a job's documents.
    Release {
        /// The job.
        job: JobId,
    },
    /// Publish a document once more.
    PublishAgain {
        /// The job that needs it.
        job: JobId,
        /// The document.
        doc: qcbus_messages::DocId,
    },
    /// Say something to a peer.
    Send {
        /// Its session.
        session: SessionId,
        /// The words.
        message: ToPeer,
    },
    /// Open a session.
    Accept {
        /// The session.
        session: SessionId,
    },
    /// Turn a peer away.
    Refuse {
        /// The session.
        session: SessionId,
        /// For a person.
        reason: String,
    },
    /// Close a session.
    Disconnect {
        /// The session.
        session: SessionId,
    },
    /// Start a child.
    Spawn {
        /// Which start.
        launch: Launch,
        /// What to start.
        spec: ChildSpec,
    },
    /// Kill a child that does not answer.
    Kill {
        /// Which start.
        launch: Launch,
    },
    /// Kill what former brokers of this instance started and what has not come to this one.
    KillStaleChildren {
        /// The starts of those that have joined.
        joined: BTreeSet<Launch>,
    },
    /// Pool, write, record.
    Store(Box<FinishedJob>),
    /// Pool what was found for an errand.
    Pool(Box<FinishedJob>),
    /// Remove the result of a file that has gone.
    Withdraw {
        /// The file.
        path: Arc<Path>,
        /// Who has reported about it and is to take that back.
        reporters: Vec<String>,
    },
    /// Tell a reporter that a file has gone.
    Void {
        /// The reporter's session.
        session: SessionId,
        /// The reporter.
        reporter: String,
        /// The file.
        path: Arc<Path>,
    },
    /// Remember that a reporter has taken back what it said of a file that has gone.
    Voided {
        /// The reporter.
        reporter: String,
        /// The file.
        path: Arc<Path>,
    },
    /// Remember that a file was looked at and found unchanged.
    Restamp {
        /// The file.
        path: Arc<Path>,
        /// Its verdict with fresh stamps.
        judged: Arc<Judged>,
    },
    /// Send a result to a reporter.
    Deliver {
        /// Its session.
        session: SessionId,
        /// Its name.
        reporter: String,
        /// The result.
        delivery: Delivery,
    },
    /// Remember that a reporter has a result.
    Delivered {
        /// Its name.
        reporter: String,
        /// The file.
        path: Arc<Path>,
        /// The job.
        job: JobId,
    },
    /// Answer a client.
    Answer {
        /// The client.
        request_id: RequestId,
        /// The answer.
        response: Response,
    },
    /// Remember that a bundle must judge, before any verdict that it takes part in.
    Enrol(Member),
    /// Remember that a bundle need not judge any more.
    Strike {
        /// Its name.
        name: String,
    },
    /// Watch these paths for changes though nobody asked for a check of them.
    Depend {
        /// The paths, each with the stamp under which it was read.
        files: Vec<(Arc<Path>, Option<Stamp>)>,
    },
    /// No verdict depends on these any more.
    Undepend {
        /// The paths.
        paths: Vec<Arc<Path>>,
    },
    /// Something that an acceptance rests on is not what it was: the file goes from behind the
    /// gate, at once, with everything that rests on it.
    CloseGate {
        /// The file.
        path: Arc<Path>,
    },
    /// The acceptance stands after all.
    OpenGate {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
    },
    /// A verdict stands: tell whoever listens.
    Judged {
        /// The file.
        path: Arc<Path>,
        /// Its verdict.
        judged: Arc<Judged>,
        /// `false` when the verdict stood already.
        fresh: bool,
    },
    /// What a shadow has found, in one file or in all, is to be forgotten.
    ForgetTrials {
        /// The shadow.
        shadow: String,
        /// The file; `None` for all.
        file: Option<Arc<Path>>,
    },
    /// Something that a person should read.
    Notice(Notice),
    /// Everything is drained: leave the loop.
    Stop,
}

impl Action {
    /// Kill a process that has not joined: there is nothing that it could finish.
    pub(super) fn kill_unjoined(launch: Launch) -> Action {
        Action::Kill { launch }
    }
}
