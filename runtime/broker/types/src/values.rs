//! Types of the state machine.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_formats::manifest::May;
use qcbus_messages::control::FileVerdict;
use qcbus_messages::{
    Catalogue, Digest, DocumentRole, Job, JobDocument, JobId, MissingDocument, Role, Verdict,
};
use sha2::{Digest as _, Sha256};

use crate::outcome::TaskOutcome;
use crate::required_set::{Epoch, RequiredSet};

/// Session of a peer on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(pub u64);

/// One start of a child process. The number increases over all brokers of an instance. It consists
/// of the generation, the start number and, in the last [`SPEC_BITS`] bits, a digest of what was
/// started. Thus a broker knows whether a process of a former broker is still the wanted one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Launch(pub u64);

/// Number of bits that distinguish manifests.
const SPEC_BITS: u32 = 16;
/// Number of bits that count the starts of one broker. The generation is above them.
const START_BITS: u32 = 24;

impl Launch {
    /// Returns the first launch of a generation.
    pub fn first_of(generation: u64) -> Launch {
        Launch(generation << (START_BITS + SPEC_BITS))
    }

    /// Returns the next launch.
    pub fn next(self, spec: &ChildSpec) -> Launch {
        let start = (self.0 >> SPEC_BITS) + 1;
        Launch((start << SPEC_BITS) | spec.digest())
    }

    /// Checks whether it is a launch of exactly this command and version.
    pub fn is_of(self, spec: &ChildSpec) -> bool {
        self.started() == spec.digest()
    }

    /// Returns the digest of what was started, see [`ChildSpec::digest`].
    pub fn started(self) -> u64 {
        self.0 & ((1 << SPEC_BITS) - 1)
    }
}

/// Request id of a client of the control socket that waits for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId(pub u64);

impl RequestId {
    /// First request id of the trials of shadows. The request ids of clients count up from 1.
    pub const FIRST_OF_TRIALS: RequestId = RequestId(1 << 63);

    /// Checks whether the id belongs to a trial of the broker instead of a client.
    pub fn is_trial(self) -> bool {
        self.0 >= RequestId::FIRST_OF_TRIALS.0
    }
}

/// Values of `stat` that are sufficient to detect a change of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Stamp {
    /// Size in bytes.
    pub size: u64,
    /// Modification time in nanoseconds since 1970, negative for earlier times.
    pub mtime_ns: i128,
    /// Time of the last change of content or metadata. It is needed because the modification time can be set freely.
    pub ctime_ns: i128,
    /// Inode. It is needed because a rename can keep size and time.
    pub inode: u64,
}

impl Stamp {
    /// Checks whether only the change time differs. The bytes may be the same (new link to the
    /// file, changed rights). They may also differ (rewritten in place with the old time restored).
    pub fn differs_in_ctime_only(&self, other: &Stamp) -> bool {
        self.ctime_ns != other.ctime_ns
            && *self
                == Stamp {
                    ctime_ns: self.ctime_ns,
                    ..*other
                }
    }
}

/// A file that a verdict depends on, in the state in which it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Absolute path.
    pub path: Arc<Path>,
    /// State found at this path.
    pub content: Reading,
}

impl Input {
    /// Returns the digest of the bytes that were read, or `None`.
    pub fn digest(&self) -> Option<Digest> {
        self.content.read().map(|(_, digest)| digest)
    }
}

/// An output file of the broker that another process has removed or changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostOutput {
    /// The file that the output belongs to or is a copy of.
    pub file: Arc<Path>,
    /// Path of the output.
    pub output: Arc<Path>,
}

/// State found at the path of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// The file did not exist.
    Absent,
    /// The entry exists but could not be read, for example a directory.
    Unread(Stamp),
    /// The bytes were read, or the file names of a directory with relevant files.
    Read(Stamp, Digest),
}

impl Reading {
    /// Returns the stamp of the existing entry.
    pub fn stamp(&self) -> Option<Stamp> {
        match *self {
            Reading::Absent => None,
            Reading::Unread(stamp) | Reading::Read(stamp, _) => Some(stamp),
        }
    }

    /// Returns stamp and digest of the data that was read.
    pub fn read(&self) -> Option<(Stamp, Digest)> {
        match *self {
            Reading::Absent | Reading::Unread(_) => None,
            Reading::Read(stamp, digest) => Some((stamp, digest)),
        }
    }
}

/// Result of reading a file and its dependencies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PreparedJob {
    /// All files that the verdict depends on, the root first.
    pub inputs: Vec<Input>,
    /// Digest over all inputs, see [`qcbus_broker::intake`].
    pub basis: Digest,
    /// Whether a stamp is so young that the file may have changed unnoticed since.
    pub racy: bool,
    /// The published documents, the root first.
    pub documents: Vec<JobDocument>,
    /// Documents that could not be read.
    pub missing: Vec<MissingDocument>,
    /// Documents that the root rests on and that get their own verdicts.
    pub rests_on: Vec<Referenced>,
    /// Files that the root rests on and that get no verdict, because they are outside all watched directories.
    pub unwatched: Vec<Referenced>,
    /// Source bytes in total.
    pub bytes: u64,
}

/// A file with its own verdict that another file rests on: its map, a used catalog, or a scenario in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Referenced {
    /// Absolute path, under which it is judged.
    pub path: Arc<Path>,
    /// Digest of the bytes that were read.
    pub digest: Digest,
    /// Its role for the file that rests on it.
    pub role: DocumentRole,
    /// Byte offset of the referring element in the image of the referring file.
    pub referred_at: u32,
}

/// A file that a verdict rests on, with its verdict that was used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RestsOn {
    /// Absolute path, under which it is judged.
    pub path: Arc<Path>,
    /// Digest of the bytes that were read.
    pub digest: Digest,
    /// The verdict on these bytes. `None` if there was none.
    pub verdict: Option<Verdict>,
    /// Number of errors found in it, without those of the files that it rests on.
    pub errors: u64,
}

impl PreparedJob {
    /// Returns stamp and digest of the root.
    pub fn root(&self) -> Option<(Stamp, Digest)> {
        self.inputs.first().and_then(|input| input.content.read())
    }
}

/// Reason why a file could not be prepared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PrepareFailure {
    /// The file does not exist any more.
    Vanished,
    /// The file exists and cannot be checked. The reason is for the user.
    Unreadable(String),
    /// A temporary failure prevented reading the file or its dependencies: no descriptors, or a
    /// disk that did not respond. It is retried with growing pauses. The reason is for the user.
    Moment(String),
    /// There is no room for its image now. It is retried later.
    NoRoom(String),
    /// The bus carries its maximum number of documents. The file is retried at once.
    Busy,
}

/// A verdict as stored in the files table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Judged {
    /// The job of the verdict.
    pub job: JobId,
    /// The verdict: the worst of its own and those of the files that it rests on.
    pub verdict: Verdict,
    /// The verdict without the files that it rests on.
    pub own: Verdict,
    /// Number of errors without those of files that it rests on.
    pub own_errors: u64,
    /// The files that it rests on. `None` in a journal that does not record them yet.
    pub rests_on: Option<Vec<RestsOn>>,
    /// Digest of the root's bytes.
    pub digest: Digest,
    /// Digest over all inputs.
    pub basis: Digest,
    /// Configuration of the verdict.
    pub config: Digest,
    /// Required set that has judged.
    pub required_set: Arc<RequiredSet>,
    /// Epoch in which the required bundles were fixed.
    pub epoch: Epoch,
    /// All files that it depends on.
    pub inputs: Vec<Input>,
    /// Whether the stamps in `inputs` are too young to prove that the files are unchanged.
    pub racy: bool,
    /// Number of issues by level: errors, warnings, information.
    pub counts: [u64; 3],
    /// Failed checkers and their reasons for an undetermined verdict.
    pub why: Vec<String>,
    /// Path of the result. `None` if it could not be written.
    pub xqar: Option<PathBuf>,
}

impl Judged {
    /// Checks whether the verdict is an acceptance.
    pub fn is_accepted(&self) -> bool {
        self.verdict == Verdict::Accepted
    }

    /// Checks whether a result exists.
    pub fn is_written(&self) -> bool {
        self.xqar.is_some()
    }
}

/// State of a reporter for a file, as far as the broker knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reported {
    /// The reporter has the result of this job.
    Of(JobId),
    /// The file was removed, and the withdrawal of the report is not confirmed.
    OfGone,
}

/// A job with completed checks, ready to be pooled and stored.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedJob {
    /// Number of the job.
    pub job: JobId,
    /// The file.
    pub path: Arc<Path>,
    /// Its kind.
    pub kind: FileKind,
    /// Configuration of the job.
    pub config: Digest,
    /// The data that was read. `None` if the file could not be read.
    pub prepared: Option<Arc<PreparedJob>>,
    /// Reason why the file could not be read.
    pub unreadable: Option<String>,
    /// Outcome of each bundle.
    pub bundles: Vec<TaskOutcome>,
    /// The files that it rests on, each with its verdict.
    pub rests_on: Vec<(Referenced, RestsOn)>,
    /// Required set that has judged.
    pub required_set: Arc<RequiredSet>,
    /// Epoch in which the required bundles were fixed. In a later epoch the job must not be stored.
    pub epoch: Epoch,
    /// Time since the job was taken from the queue.
    pub elapsed: Duration,
}

/// Outcome of storing a result.
#[derive(Debug, Clone, PartialEq)]
pub enum StoreOutcome {
    /// The result is written and recorded in the journal.
    Stored(Box<Judged>),
    /// The file has changed since it was read.
    Stale {
        /// Whether a result of the earlier bytes may be in its place, because writing it failed midway.
        half_written: bool,
    },
    /// The required bundles have changed. No result was written.
    Outdated,
    /// The result could not be written. Storing is retried.
    Failed(String),
}

/// A result for a reporter.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// The job.
    pub job: JobId,
    /// The file.
    pub path: Arc<Path>,
    /// Its verdict.
    pub judged: Arc<Judged>,
}

/// A child process that the broker keeps running.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ChildSpec {
    /// Name in its hello.
    pub name: String,
    /// Bundle or reporter.
    pub role: Role,
    /// Version in the manifest, if any. A change causes an upgrade.
    pub version: Option<String>,
    /// Program and arguments. The bus options are appended.
    pub command: Vec<String>,
    /// Condition for a restart.
    pub restart: Restart,
    /// Permissions beyond the sandbox.
    pub may: May,
    /// Files that the command of a manifest runs, with their stamps when the manifest was read.
    /// Empty for children that belong to the program.
    pub programs: Vec<(PathBuf, Option<Stamp>)>,
    /// The bundle is a shadow: it checks files and has no weight in any verdict.
    pub shadow: bool,
    /// The child may take long until its hello, because it runs other programs first.
    pub slow_start: bool,
}

impl ChildSpec {
    /// Checks whether it is a required bundle.
    pub fn judges(&self) -> bool {
        self.role == Role::Bundle && !self.shadow
    }

    /// Returns a digest of command, version and programs, with as many bits as a launch can hold.
    pub fn digest(&self) -> u64 {
        let mut hash = Sha256::new();
        hash.update(format!("{:?}{:?}", self.version, self.command));
        hash.update(if self.shadow { "shadow" } else { "" });
        if self.may != May::default() {
            hash.update(format!("{:?}", self.may));
        }
        if !self.programs.is_empty() {
            hash.update(format!("{:?}", self.programs));
        }
        let digest = hash.finalize();
        let first = digest.iter().take(8);
        first.fold(0, |number, byte| (number << 8) + u64::from(*byte)) >> (u64::BITS - SPEC_BITS)
    }
}

/// End of a child process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChildEnd {
    /// The program does not exist or cannot be run. The reason is for the user.
    NotStarted(String),
    /// It ended with exit status 0.
    Done(String),
    /// It ended with another status or by a signal.
    Failed(String),
}

impl ChildEnd {
    /// Returns the description of the end for the user.
    pub fn how(&self) -> &str {
        match self {
            ChildEnd::NotStarted(how) | ChildEnd::Done(how) | ChildEnd::Failed(how) => how,
        }
    }
}

/// Condition for the restart of a child.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// The child is never restarted.
    Never,
    /// The child is restarted after an error or a signal.
    OnFailure,
    /// The child is restarted whenever it ended without a request.
    Always,
}

/// Demand of a configuration, as far as the state machine needs it.
pub trait Demand: Send + Sync + std::fmt::Debug {
    /// Checks whether this bundle must check files at all.
    fn wants_bundle(&self, name: &str, alias: &str) -> bool;
    /// Returns the indexes of the catalogue's checkers that must run on a file of this kind.
    fn checkers(&self, name: &str, catalogue: &Catalogue, kind: FileKind) -> Vec<u32>;
    /// Returns the bundles that are demanded by name, whether or not they were ever seen.
    fn named(&self) -> Vec<String>;
    /// Checks whether `name` (as in [`Demand::named`]) refers to this bundle.
    fn means(&self, named: &str, name: &str, alias: &str) -> bool;
}

/// Returns a verdict in the form for clients.
pub fn file_verdict(path: &Path, judged: &Judged) -> FileVerdict {
    FileVerdict {
        file: path.to_path_buf(),
        verdict: judged.verdict,
        digest: judged.digest.to_string(),
        xqar: judged.xqar.clone().unwrap_or_default(),
        errors: judged.counts[0],
        warnings: judged.counts[1],
        information: judged.counts[2],
        why: judged.why.clone(),
    }
}

/// Returns the job in the form for bundles.
pub fn job_message(job: JobId, config: Digest, kind: FileKind, prepared: &PreparedJob) -> Job {
    Job {
        job,
        config,
        kind,
        documents: prepared.documents.clone(),
        missing: prepared.missing.clone(),
    }
}

/// Returns the SHA-256 digest of the bytes of a file.
pub fn digest_of(bytes: &[u8]) -> Digest {
    Digest(Sha256::digest(bytes).into())
}

/// Checks whether a path contains `..`. References keep it only after a symbolic link or a missing
/// directory. The text of such a path does not show its target.
pub fn leads_upwards(path: &Path) -> bool {
    path.components().any(|part| part == Component::ParentDir)
}

#[cfg(test)]
#[path = "values_tests.rs"]
mod tests;
