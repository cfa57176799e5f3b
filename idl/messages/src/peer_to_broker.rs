//! Messages from a bundle or reporter to the broker.

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Metadata, Param};
use serde::{Deserialize, Serialize};

use crate::{Catalogue, DocId, JobId, PeerReport};

/// How one checker has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckerEnd {
    /// Index into the catalogue.
    pub checker: u32,
    /// How.
    pub ending: Ending,
    /// The parameters that it used.
    pub params: Vec<Param>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
}

/// Bundle or reporter → broker. Messages for a job take effect only after its `JobDone`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum FromPeer {
    /// Catalogue of the bundle; the answer to the welcome.
    Catalogue(Box<Catalogue>),
    /// Request to publish a document again: a job needs it, and it has not arrived or was released.
    NeedDocument {
        /// Its number.
        doc: DocId,
    },
    /// Findings of one checker, in any number of batches.
    Issues {
        /// The job.
        job: JobId,
        /// Index into the catalogue.
        checker: u32,
        /// The findings; their ids are still 0.
        issues: Vec<Issue>,
    },
    /// Checkers have ended: requested ones, or others that blocked them. One message contains any
    /// number of them, because there are hundreds in a job.
    CheckersDone {
        /// The job.
        job: JobId,
        /// The checkers.
        ended: Vec<CheckerEnd>,
    },
    /// All demanded checkers of the bundle have ended.
    JobDone {
        /// The job.
        job: JobId,
        /// Time spent checking, in microseconds.
        micros: u64,
    },
    /// A reporter has finished a result.
    ResultDone {
        /// The job.
        job: JobId,
        /// Outcome of the report.
        report: PeerReport,
    },
    /// A reporter has withdrawn its reports about a deleted file, or cannot do so.
    WithdrawalDone {
        /// Absolute path of the file.
        input: String,
        /// Outcome of the withdrawal.
        report: PeerReport,
    },
    /// Still alive.
    Heartbeat {
        /// The job in progress.
        job: Option<JobId>,
        /// The checker that is running, by index into the catalogue.
        checker: Option<u32>,
    },
    /// The peer ends with all work done: the answer to `Drain`, or its own decision.
    Leaving,
}
