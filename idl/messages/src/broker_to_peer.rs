//! What the broker says to one bundle or reporter.

use std::collections::BTreeMap;

use qcbus_document::FileKind;
use qcbus_formats::xqar::{Param, Results};
use serde::{Deserialize, Serialize};

use crate::{Digest, DocId, DocumentRole, JobId, MissingDocument, Verdict};

/// Broker → bundle or reporter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ToPeer {
    /// The session is open. A bundle answers with its catalogue, a reporter with nothing.
    Welcome {
        /// Broker generation that this session belongs to.
        generation: u64,
        /// Digest of the configuration in force.
        config: Digest,
    },
    /// The peer may not take part; the text says why. The session ends.
    Refused {
        /// For a person: what does not fit, and what to do.
        reason: String,
    },
    /// Check this.
    Job(Job),
    /// Stop checking this; nothing sent for it counts any more. Unknown jobs are ignored.
    Cancel {
        /// The job.
        job: JobId,
    },
    /// Report this.
    Result(Box<ResultMessage>),
    /// The file of a result has gone: take back what was reported about it.
    Withdrawn(Withdrawn),
    /// No further jobs: finish what is there, say `Leaving`, and go.
    Drain,
}

/// Why a broker refuses who comes while it goes: nobody's fault, and of no interest to who was started by it.
pub const IS_STOPPING: &str = "this broker is stopping";

/// One file to check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Job {
    /// Its number.
    pub job: JobId,
    /// The configuration to check under. A bundle that has not seen it yet waits for it.
    pub config: Digest,
    /// What the root's name promises.
    pub kind: FileKind,
    /// The documents, the root first.
    pub documents: Vec<JobDocument>,
    /// What the root refers to and could not be had.
    pub missing: Vec<MissingDocument>,
}

/// A document of a job.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobDocument {
    /// Under which it was or will be published.
    pub doc: DocId,
    /// What it is to the job.
    pub role: DocumentRole,
    /// Absolute path; for a member of an archive, the archive's path, `!` and the member's name.
    pub path: String,
    /// Digest of the bytes on disk; for an image of several files, see the image's sources.
    pub digest: Digest,
    /// Byte offset of the element in the root's image that leads here, perhaps through other
    /// documents; 0 for the root.
    pub referred_at: u32,
    /// Where its own references to maps and scenarios lead.
    pub links: Vec<Link>,
}

/// A reference that was followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Link {
    /// Byte offset of the referring element in the image of the document that refers.
    pub at: u32,
    /// The document that is meant, by its place among the job's documents.
    pub to: u32,
}

/// A finished job, for reporters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultMessage {
    /// The job: the same job may be sent again after a crash, so writing must be idempotent.
    pub job: JobId,
    /// Absolute path of the checked file.
    pub input: String,
    /// Path for people, relative to the directory given or watched.
    pub display_path: String,
    /// Absolute path of the `.xqar`.
    pub xqar: String,
    /// The verdict.
    pub verdict: Verdict,
    /// Digest of the checked file's bytes.
    pub digest: Digest,
    /// Digest of the configuration.
    pub config: Digest,
    /// Root document, readable as long as it stays on the bus.
    pub document: Option<DocId>,
    /// The pooled result.
    pub results: Results,
    /// What the rules that were broken are about, by rule UID, from the bundles' pages.
    pub rules: BTreeMap<String, String>,
    /// Parameters for this reporter from the configuration.
    pub params: Vec<Param>,
}

/// A checked file that has gone, for reporters.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Withdrawn {
    /// Absolute path of the file, as in the result.
    pub input: String,
    /// Path for people, as in the result.
    pub display_path: String,
    /// Absolute path where the `.xqar` was.
    pub xqar: String,
    /// Parameters for this reporter from the configuration.
    pub params: Vec<Param>,
}

/// What a reporter did with a result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum PeerReport {
    /// Written and safe.
    Written,
    /// Not written, with the reason; tried again by the next broker.
    Failed(String),
}
