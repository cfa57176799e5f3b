//! What a bundle or reporter says to the broker.

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

/// Bundle or reporter → broker. Nothing said for a job counts before its `JobDone`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum FromPeer {
    /// What the bundle can do; the answer to the welcome.
    Catalogue(Box<Catalogue>),
    /// A document that a job needs has not arrived or was let go; please publish it again.
    NeedDocument {
        /// Its number.
        doc: DocId,
    },
    /// Findings of one checker; any number of batches.
    Issues {
        /// The job.
        job: JobId,
        /// Index into the catalogue.
        checker: u32,
        /// The findings, ids still 0.
        issues: Vec<Issue>,
    },
    /// Checkers have ended: demanded ones, or others besides that kept them from looking. Any number at
    /// once: there are hundreds in a job.
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
    /// A reporter is through with a result.
    ResultDone {
        /// The job.
        job: JobId,
        /// What came of it.
        report: PeerReport,
    },
    /// A reporter has taken back what it reported about a file that has gone, or cannot.
    WithdrawalDone {
        /// Absolute path of the file.
        input: String,
        /// What came of it.
        report: PeerReport,
    },
    /// Still alive.
    Heartbeat {
        /// What it is working on.
        job: Option<JobId>,
        /// The checker that is running, by index into the catalogue.
        checker: Option<u32>,
    },
    /// Going, all work done: the answer to `Drain`, or of its own will.
    Leaving,
}
