//! Messages from the broker to one bundle or reporter.

use std::collections::BTreeMap;

use qcbus_document::FileKind;
use qcbus_formats::xqar::{Param, Results};
use serde::{Deserialize, Serialize};

use crate::{Digest, DocId, DocumentRole, JobId, MissingDocument, Verdict};

/// Broker → bundle or reporter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ToPeer {
    /// The session is open. A bundle answers with its catalogue; a reporter does not answer.
    Welcome {
        /// Broker generation that this session belongs to.
        generation: u64,
        /// Digest of the configuration in force.
        config: Digest,
    },
    /// The peer is refused; the text says why. The session ends.
    Refused {
        /// For a person: the reason and the fix.
        reason: String,
    },
    /// Check this file.
    Job(Job),
    /// Stop checking this job; later messages for it are ignored. Unknown jobs are ignored too.
    Cancel {
        /// The job.
        job: JobId,
    },
    /// Report this result.
    Result(Box<ResultMessage>),
    /// The file of a result was deleted: withdraw its reports.
    Withdrawn(Withdrawn),
    /// No further jobs: finish the current work, send `Leaving`, and exit.
    Drain,
}

/// Refusal reason of a stopping broker. A peer started by the broker ends without an error.
pub const IS_STOPPING: &str = "this broker is stopping";

/// A file to check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Job {
    /// Its number.
    pub job: JobId,
    /// The configuration of the check. A bundle without this configuration waits for it.
    pub config: Digest,
    /// Kind of file according to the root's name.
    pub kind: FileKind,
    /// The documents, the root first.
    pub documents: Vec<JobDocument>,
    /// Documents that the root refers to and that are missing.
    pub missing: Vec<MissingDocument>,
}

/// A document of a job.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobDocument {
    /// Id under which it was or will be published.
    pub doc: DocId,
    /// Its role in the job.
    pub role: DocumentRole,
    /// Absolute path. For a member of an archive: the archive's path, `!` and the member's name.
    pub path: String,
    /// Digest of the bytes on disk; for an image of several files, see the image's sources.
    pub digest: Digest,
    /// Byte offset of the element in the root's image that leads here, directly or through other
    /// documents; 0 for the root.
    pub referred_at: u32,
    /// Targets of its own references to maps and scenarios.
    pub links: Vec<Link>,
}

/// A resolved reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Link {
    /// Byte offset of the referring element in the image of its document.
    pub at: u32,
    /// Index of the target among the job's documents.
    pub to: u32,
}

/// A finished job, for reporters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultMessage {
    /// The job. It may be sent again after a crash, so writing must be idempotent.
    pub job: JobId,
    /// Absolute path of the checked file.
    pub input: String,
    /// Path for people, relative to the given or watched directory.
    pub display_path: String,
    /// Absolute path of the `.xqar`.
    pub xqar: String,
    /// The verdict.
    pub verdict: Verdict,
    /// Digest of the checked file's bytes.
    pub digest: Digest,
    /// Digest of the configuration.
    pub config: Digest,
    /// Root document, readable while it is on the bus.
    pub document: Option<DocId>,
    /// The pooled result.
    pub results: Results,
    /// Explanations of the violated rules, by rule UID, from the bundles' pages.
    pub rules: BTreeMap<String, String>,
    /// Parameters of this reporter from the configuration.
    pub params: Vec<Param>,
}

/// A deleted checked file, for reporters.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Withdrawn {
    /// Absolute path of the file, as in the result.
    pub input: String,
    /// Path for people, as in the result.
    pub display_path: String,
    /// Absolute path of the former `.xqar`.
    pub xqar: String,
    /// Parameters of this reporter from the configuration.
    pub params: Vec<Param>,
}

/// How a reporter processed a result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum PeerReport {
    /// The report is written and safe.
    Written,
    /// The report is not written, with the reason. The next broker tries again.
    Failed(String),
}
