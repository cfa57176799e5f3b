//! The words of the state machine.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use qcbus_document::FileKind;
use qcbus_formats::manifest::May;
use qcbus_messages::control::FileVerdict;
use qcbus_messages::{
    Catalogue, Digest, DocumentRole, Job, JobDocument, JobId, MissingDocument, Role, Verdict,
};

use sha2::{Digest as _, Sha256};

use super::outcome::TaskOutcome;
use super::required_set::{Epoch, RequiredSet};

/// A peer's session on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(pub u64);

/// One start of a child process. The number counts up over all brokers of an instance: the generation,
/// which of its starts, and in the last [`SPEC_BITS`] bits what was started, so that a broker knows
/// of a process that a former one has started whether it still is what is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Launch(pub u64);

/// Bits of a launch that tell manifests apart.
const SPEC_BITS: u32 = 16;
/// Bits that count the starts of one broker; above them is its generation.
const START_BITS: u32 = 24;

impl Launch {
    /// Where the launches of a generation begin.
    pub fn first_of(generation: u64) -> Launch {
        Launch(generation << (START_BITS + SPEC_BITS))
    }

    /// The launch that follows.
    pub fn next(self, spec: &ChildSpec) -> Launch {
        let start = (self.0 >> SPEC_BITS) + 1;
        Launch((start << SPEC_BITS) | spec.digest())
    }

    /// Whether it was one of this very command and version.
    pub fn is_of(self, spec: &ChildSpec) -> bool {
        self.started() == spec.digest()
    }

    /// What was started, as [`ChildSpec::digest`] has it.
    pub fn started(self) -> u64 {
        self.0 & ((1 << SPEC_BITS) - 1)
    }
}

/// A client of the control socket that waits for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId(pub u64);

/// What `stat` says of a file: enough to see that it has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Stamp {
    /// Size in bytes.
    pub size: u64,
    /// Modification time in nanoseconds since 1970; negative before.
    pub mtime_ns: i128,
    /// Time of the last change of anything, because the modification time can be set at will.
    pub ctime_ns: i128,
    /// Inode, because a rename can keep size and time.
    pub inode: u64,
}

impl Stamp {
    /// Whether only the time of change differs: the bytes may be the same (another link to the
    /// file, other rights) or not (rewritten in place, with the time put back).
    pub fn differs_in_ctime_only(&self, other: &Stamp) -> bool {
        self.ctime_ns != other.ctime_ns
            && *self
                == Stamp {
                    ctime_ns: self.ctime_ns,
                    ..*other
                }
    }
}

/// A file that a verdict depends on, as it was when it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Absolute path.
    pub path: Arc<Path>,
    /// What was found there.
    pub content: Reading,
}

impl Input {
    /// The digest of the bytes that were read, if any were.
    pub fn digest(&self) -> Option<Digest> {
        self.content.read().map(|(_, digest)| digest)
    }
}

/// A file that the broker has written for others, and that somebody has removed or changed since.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostOutput {
    /// The file that it is about, or of which it is a copy.
    pub file: Arc<Path>,
    /// Where it was.
    pub output: Arc<Path>,
}

/// What was found where a file was to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// It was looked for and not there.
    Absent,
    /// Something is there that could not be read: a directory, say.
    Unread(Stamp),
    /// Its bytes were read, or its names if it is a directory whose files count.
    Read(Stamp, Digest),
}

impl Reading {
    /// The stamp of what is there.
    pub fn stamp(&self) -> Option<Stamp> {
        match *self {
            Reading::Absent => None,
            Reading::Unread(stamp) | Reading::Read(stamp, _) => Some(stamp),
        }
    }

    /// Stamp and digest of what was read.
    pub fn read(&self) -> Option<(Stamp, Digest)> {
        match *self {
            Reading::Absent | Reading::Unread(_) => None,
            Reading::Read(stamp, digest) => Some((stamp, digest)),
        }
    }
}

/// What reading a file and its dependencies gave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PreparedJob {
    /// Everything the verdict depends on, the root first.
    pub inputs: Vec<Input>,
    /// Digest over all inputs, see [`crate::intake`].
    pub basis: Digest,
    /// Whether some stamp is so young that the file may have changed unnoticed since.
    pub racy: bool,
    /// The published documents, the root first.
    pub documents: Vec<JobDocument>,
    /// What could not be had.
    pub missing: Vec<MissingDocument>,
    /// Those of the documents that the root rests on and that get verdicts of their own.
    pub rests_on: Vec<Referenced>,
    /// Those that the root rests on and that nobody judges, because they lie outside of all that is watched.
    pub unwatched: Vec<Referenced>,
    /// Source bytes in total.
    pub bytes: u64,
}

/// A file with a verdict of its own that another file rests on: its map, a catalog that it takes entries from,
/// a scenario that it is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Referenced {
    /// Absolute path, under which it is judged.
    pub path: Arc<Path>,
    /// Digest of the bytes that were read.
    pub digest: Digest,
    /// What it is to the file that rests on it.
    pub role: DocumentRole,
    /// Byte offset of the referring element in the image of that file.
    pub referred_at: u32,
}

/// A file that a verdict rests on, with the verdict on it that was counted in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RestsOn {
    /// Absolute path, under which it is judged.
    pub path: Arc<Path>,
    /// Digest of the bytes that were read.
    pub digest: Digest,
    /// The verdict on these bytes; `None` while there was none.
    pub verdict: Option<Verdict>,
    /// Errors found in it, without those of the files that it rests on.
    pub errors: u64,
}

impl PreparedJob {
    /// Stamp and digest of the root.
    pub fn root(&self) -> Option<(Stamp, Digest)> {
        self.inputs.first().and_then(|input| input.content.read())
    }
}

/// Why a file could not be prepared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PrepareFailure {
    /// It is no longer there.
    Vanished,
    /// It is there and cannot be checked; the reason is for a person.
    Unreadable(String),
    /// Something that passes kept it, or what it refers to, from being read: no descriptors, a disk that
    /// did not answer. Worth other tries, with growing pauses; the reason is for a person.
    Moment(String),
    /// No room for its image now; worth another try later.
    NoRoom(String),
    /// As many documents as the bus carries are in use; worth another try at once.
    Busy,
}

/// A verdict as the files table remembers it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Judged {
    /// The job that gave it.
    pub job: JobId,
    /// The verdict: the worst of its own and of the files that it rests on.
    pub verdict: Verdict,
    /// The verdict without the files that it rests on.
    pub own: Verdict,
    /// Errors without the findings about files that it rests on.
    pub own_errors: u64,
    /// The files that it rests on; `None` in a journal from before this was recorded.
    pub rests_on: Option<Vec<RestsOn>>,
    /// Digest of the root's bytes.
    pub digest: Digest,
    /// Digest over all inputs.
    pub basis: Digest,
    /// Configuration it was given under.
    pub config: Digest,
    /// Those who had to judge, and did.
    pub required_set: Arc<RequiredSet>,
    /// The epoch in which they were called.
    pub epoch: Epoch,
    /// Everything it depends on.
    pub inputs: Vec<Input>,
    /// Whether the stamps in `inputs` are too young to be trusted alone.
    pub racy: bool,
    /// Issues by level: errors, warnings, information.
    pub counts: [u64; 3],
    /// For undetermined: which checkers failed and why.
    pub why: Vec<String>,
    /// Where the result lies; `None` when it could not be written anywhere.
    pub xqar: Option<PathBuf>,
}

impl Judged {
    /// Whether the verdict is an acceptance.
    pub fn is_accepted(&self) -> bool {
        self.verdict == Verdict::Accepted
    }

    /// Whether there is a result.
    pub fn is_written(&self) -> bool {
        self.xqar.is_some()
    }
}

/// What a reporter has said of a file, as far as the broker knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reported {
    /// It has the result of this job.
    Of(JobId),
    /// The file had gone, and the report is not known to have been taken back.
    OfGone,
}

/// A job whose checking is over, ready to be pooled and stored.
#[derive(Debug, Clone, PartialEq)]
pub struct FinishedJob {
    /// Its number.
    pub job: JobId,
    /// The file.
    pub path: Arc<Path>,
    /// Its kind.
    pub kind: FileKind,
    /// Configuration.
    pub config: Digest,
    /// What was read; `None` when it could not be.
    pub prepared: Option<Arc<PreparedJob>>,
    /// Why it could not be read.
    pub unreadable: Option<String>,
    /// By bundle.
    pub bundles: Vec<TaskOutcome>,
    /// The files that it rests on, each with the verdict on it.
    pub rests_on: Vec<(Referenced, RestsOn)>,
    /// Those who had to judge, and did.
    pub required_set: Arc<RequiredSet>,
    /// The epoch in which they were called: in a later one the job is not to be stored.
    pub epoch: Epoch,
    /// Time since the job was taken from the queue.
    pub elapsed: Duration,
}

/// What storing a result gave.
#[derive(Debug, Clone, PartialEq)]
pub enum StoreOutcome {
    /// Written and in the journal.
    Stored(Box<Judged>),
    /// The file has changed since it was read; nothing was written.
    Stale,
    /// Others must judge it by now; nothing was written.
    Outdated,
    /// It could not be written; worth another try.
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
    /// The name under which it will say hello.
    pub name: String,
    /// Bundle or reporter.
    pub role: Role,
    /// Version from the manifest, if it says one; a change makes an upgrade.
    pub version: Option<String>,
    /// Program and arguments; the bus options are appended.
    pub command: Vec<String>,
    /// When to start it again.
    pub restart: Restart,
    /// What it may do although it is confined.
    pub may: May,
    /// The files that the command of a manifest runs, as they were when it was read. What comes with the
    /// program has none.
    pub programs: Vec<(PathBuf, Option<Stamp>)>,
    /// It is a bundle that looks at files and has no weight in any verdict.
    pub shadow: bool,
    /// It may take long until it says hello: it runs programs before that.
    pub slow_start: bool,
}

impl ChildSpec {
    /// Whether it is a bundle that must judge.
    pub fn judges(&self) -> bool {
        self.role == Role::Bundle && !self.shadow
    }

    /// Tells command, version and programs from others, in as many bits as a launch has for it.
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

/// How a child process has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChildEnd {
    /// There is no such program, or it cannot be run: for a person.
    NotStarted(String),
    /// With exit status 0.
    Done(String),
    /// With another status or by a signal.
    Failed(String),
}

impl ChildEnd {
    /// How, for a person.
    pub fn how(&self) -> &str {
        match self {
            ChildEnd::NotStarted(how) | ChildEnd::Done(how) | ChildEnd::Failed(how) => how,
        }
    }
}

/// When a child is started again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// Never.
    Never,
    /// When it ended with an error or a signal.
    OnFailure,
    /// Whenever it ended without having been asked to.
    Always,
}

/// What a configuration demands, as far as the state machine must know.
pub trait Demand: Send + Sync + std::fmt::Debug {
    /// Whether this bundle is to check anything at all.
    fn wants_bundle(&self, name: &str, alias: &str) -> bool;
    /// The indexes of the catalogue's checkers that are to run on a file of this kind.
    fn checkers(&self, name: &str, catalogue: &Catalogue, kind: FileKind) -> Vec<u32>;
    /// Bundles demanded by name, whether they have been seen or not.
    fn named(&self) -> Vec<String>;
    /// Whether `name` (as in [`Demand::named`]) means this bundle.
    fn means(&self, named: &str, name: &str, alias: &str) -> bool;
}

/// A verdict as a client is told.
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

/// The job as a bundle is told.
pub fn job_message(job: JobId, config: Digest, kind: FileKind, prepared: &PreparedJob) -> Job {
    Job {
        job,
        config,
        kind,
        documents: prepared.documents.clone(),
        missing: prepared.missing.clone(),
    }
}

#[cfg(test)]
#[path = "types_tests.rs"]
mod tests;
