//! Messages of short-lived commands to the broker over `control.sock`: one JSON object per line.

use std::collections::BTreeMap;
use std::path::PathBuf;

use qcbus_document::FileKind;
use serde::{Deserialize, Serialize};

use crate::{Catalogue, Verdict, path_text};

/// A command's request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case")]
pub enum Request {
    /// Request the status.
    Status,
    /// Wait for a verdict on the file's current bytes.
    Wait {
        /// Absolute path of the file.
        #[serde(with = "path_text::one")]
        file: PathBuf,
        /// Maximum waiting time in milliseconds; `None` means no limit.
        timeout_ms: Option<u64>,
    },
    /// Wait for a verdict on the file's current bytes, and until every reporter has written its
    /// report. It is a separate request: a broker without it must not answer before the reports.
    WaitReported {
        /// Absolute path of the file.
        #[serde(with = "path_text::one")]
        file: PathBuf,
        /// Maximum waiting time in milliseconds; `None` means no limit.
        timeout_ms: Option<u64>,
    },
    /// On-demand check of any file. The response contains the result; the broker stores nothing.
    Check {
        /// Absolute path of the file.
        #[serde(with = "path_text::one")]
        file: PathBuf,
        /// The required check context.
        check_context: CheckContext,
    },
    /// Drain and stop.
    Down,
    /// Read the configuration and the bundle manifests again.
    Reload,
    /// Stop requiring a bundle that no manifest names: one that was started by hand and will not
    /// return.
    RemoveBundle {
        /// Its name.
        name: String,
    },
    /// Request the readiness of a bundle that was added or changed.
    Bundle {
        /// Its name.
        name: String,
    },
    /// Request the trials of a shadow.
    Trials {
        /// Its name.
        name: String,
    },
    /// Request the catalogues of the running bundles.
    Offers {
        /// Bundles to leave out, because the client knows them.
        without: Vec<String>,
    },
}

/// Response of the broker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "response", rename_all = "kebab-case")]
pub enum Response {
    /// Answer to `Status`.
    Status(Box<Status>),
    /// Answer to `Wait` and `WaitReported`.
    Verdict(FileVerdict),
    /// Answer to `Wait` and `WaitReported`: the time limit has expired.
    TimedOut,
    /// Answer to `WaitReported`: the time limit has expired, and reports on the verdict are
    /// missing.
    Unreported {
        /// The verdict.
        verdict: FileVerdict,
        /// The reporters with a missing report, each with the reason, for a person.
        reporters: Vec<String>,
    },
    /// Answer to `Wait`: the file, or one that it refers to, cannot be accessed. For instance, its
    /// disk does not respond.
    Unanswered {
        /// The reason, for a person.
        reason: String,
    },
    /// Answer to `Wait`: the file is not watched, with the reason.
    Unwatched {
        /// The reason, for a person.
        reason: String,
    },
    /// Answer to `Check`.
    Checked(Box<Checked>),
    /// Answer to `Check`: this broker would return a different result than the client's own check,
    /// or cannot rule that out. The client must check the file itself.
    Elsewhere {
        /// The reason, for a person.
        reason: String,
    },
    /// Answer to `Down`: all work is drained. For other requests: the broker stopped without an
    /// answer.
    Stopped,
    /// Answer to `Reload`: the changes, one per line; empty when there are none.
    Reloaded {
        /// The changes, for a person.
        changes: Vec<String>,
        /// Oddities of the current configuration and manifests, for a person.
        #[serde(default)]
        notices: Vec<String>,
    },
    /// Answer to `RemoveBundle`: the bundle is no longer required.
    Removed {
        /// The effect, for a person.
        what: String,
    },
    /// Answer to `Bundle`; empty when there is no bundle of this name.
    Bundle {
        /// Its readiness.
        bundle: Option<Box<BundleReadiness>>,
    },
    /// Answer to `Trials`.
    Trials {
        /// The numbers of each kind; `None` when there is no such shadow.
        counts: Option<TrialCounts>,
        /// Trials that would change a verdict, failed, or found anything: at most a thousand,
        /// largest change first.
        trials: Vec<Trial>,
    },
    /// Answer to `Offers`.
    Offers {
        /// The catalogues, sorted by name.
        offers: Vec<Offer>,
    },
    /// The request failed. The text also says which state remains in force.
    Failed {
        /// The reason, for a person.
        reason: String,
    },
}

/// Readiness of a bundle compared with its manifest.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct BundleReadiness {
    /// Its name.
    pub name: String,
    /// The command of the manifest in force; `None` if started by hand or part of the program.
    pub command: Option<String>,
    /// Value that changes when the files of this command or anything else in the manifest change.
    pub spec: u64,
    /// Readiness of the process of exactly this command.
    pub readiness: Readiness,
    /// The process that currently judges, possibly an older one; `None` when there is none.
    pub runs: Option<Runs>,
    /// Final output of a process that ended before it joined: the last lines, unchanged.
    #[serde(default)]
    pub said: Vec<String>,
}

/// Readiness of the process that a bundle's manifest requires.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "readiness", rename_all = "kebab-case")]
pub enum Readiness {
    /// It has joined and sent its catalogue, and receives jobs from now on.
    Ready,
    /// It is starting, and no error has occurred so far.
    Coming {
        /// Whether it has sent its hello; its catalogue is still missing.
        joined: bool,
    },
    /// Its start failed; the broker tries again.
    Failing {
        /// The reason, for a person.
        why: String,
    },
}

impl Default for Readiness {
    fn default() -> Readiness {
        Readiness::Coming { joined: false }
    }
}

/// A bundle process that judges.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Runs {
    /// Its version.
    pub version: String,
    /// Its process id.
    pub pid: u32,
    /// Number of its checkers.
    pub checkers: u64,
    /// The root files that it accepts.
    pub kinds: Vec<FileKind>,
    /// Number of its checkers that the configuration in force requests.
    pub demanded: u64,
    /// Whether it runs as a shadow, with no effect on any verdict.
    #[serde(default)]
    pub shadow: bool,
}

/// Progress of a shadow's trials, and their outcomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TrialCounts {
    /// Files that it was asked to check.
    pub tried: u64,
    /// Files that wait for it.
    pub waiting: u64,
    /// Files that are not rejected, and would be rejected.
    pub would_reject: u64,
    /// Files that are accepted, and would be undetermined.
    pub would_leave_open: u64,
    /// Files that are undetermined because no bundle judges them, and would be accepted.
    pub would_accept: u64,
    /// Files for which it could not give an answer.
    pub failed: u64,
}

/// A shadow's answer for a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trial {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub file: PathBuf,
    /// The actual verdict.
    pub verdict: Verdict,
    /// The verdict if the shadow also judged.
    pub would: Verdict,
    /// Issues of level error.
    pub errors: u64,
    /// Issues of level warning.
    pub warnings: u64,
    /// Issues of level information.
    pub information: u64,
    /// Its checkers that did not end properly, with reasons.
    pub why: Vec<String>,
    /// The reason for a missing answer, if it gave none.
    pub failure: Option<String>,
    /// Path of its result; empty when there is none.
    #[serde(with = "path_text::one")]
    pub result: PathBuf,
}

/// Catalogue of a running bundle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Offer {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Its catalogue.
    pub catalogue: Catalogue,
}

/// Check context of a file. The same program with an equal context gives the same result.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CheckContext {
    /// Digest of the configuration, the form of results, and all limits.
    pub general: String,
    /// The bundles that must check the file, each with a digest of its start settings.
    pub bundles: BTreeMap<String, String>,
}

/// Result of an on-demand check, for the client.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checked {
    /// The verdict; there is no result file.
    pub verdict: FileVerdict,
    /// The content for the result file.
    pub result: String,
    /// The files that this one depends on; they are not part of the verdict.
    pub rests_on: Vec<Referenced>,
}

/// A file that another one depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Referenced {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub file: PathBuf,
    /// SHA-256 of the bytes that were read.
    pub digest: String,
}

/// The verdict on one file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileVerdict {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub file: PathBuf,
    /// The verdict.
    pub verdict: Verdict,
    /// SHA-256 of the judged bytes.
    pub digest: String,
    /// Path of the result; empty when there is none.
    #[serde(with = "path_text::one")]
    pub xqar: PathBuf,
    /// Issues of level error.
    pub errors: u64,
    /// Issues of level warning.
    pub warnings: u64,
    /// Issues of level information.
    pub information: u64,
    /// For undetermined: the checkers that did not end properly, with reasons. Otherwise empty.
    pub why: Vec<String>,
}

/// The state of a broker, as `qcbus status --json` prints it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Status {
    /// Name of the instance.
    pub instance: String,
    /// Version of the broker.
    pub version: String,
    /// Process id.
    pub pid: u32,
    /// Number of this start.
    pub generation: u64,
    /// Seconds since the start.
    pub uptime_s: u64,
    /// Watched directories.
    #[serde(with = "path_text::many")]
    pub watching: Vec<PathBuf>,
    /// `notify` or `poll`, and the reason if it differs from the requested mode.
    pub watch_mode: String,
    /// Output directory of results.
    #[serde(with = "path_text::one")]
    pub out: PathBuf,
    /// Directory of data that must survive a restart.
    #[serde(default)]
    pub state: Option<PathBuf>,
    /// The watched directory of bundle manifests.
    #[serde(default)]
    pub bundles_d: Option<PathBuf>,
    /// Target of published accepted files, if any.
    #[serde(default)]
    pub gate: Option<GateStatus>,
    /// Digest of the configuration in force.
    pub config: String,
    /// Files by state.
    pub files: FileCounts,
    /// The queue.
    pub queue: QueueStatus,
    /// Bundles and reporters.
    pub peers: Vec<PeerStatus>,
    /// Counter of changes of the required bundles and of the demanded checkers.
    pub epoch: u64,
    /// Paths in the watched directories that cannot be accessed now; the first hundred.
    #[serde(default)]
    pub unseen: Vec<Unseen>,
    /// Files being written to, which are judged when they no longer change; the first hundred.
    #[serde(default)]
    pub unfinished: Vec<Unfinished>,
    /// Current failures that keep the broker from its work, for a person.
    #[serde(default)]
    pub troubles: Vec<String>,
    /// Message that the program on disk differs from the running one, with the fix, for a person.
    #[serde(default)]
    pub replaced: Option<String>,
    /// Directory of the private directories of one-shot ASAM modules; set after its first check.
    #[serde(default)]
    pub scratch: Option<ScratchStatus>,
    /// Notices for a person, newest last.
    pub notices: Vec<NoticeStatus>,
}

/// Directory of the private directories of one-shot ASAM modules.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ScratchStatus {
    /// The directory; it is created when it is missing.
    #[serde(with = "path_text::one")]
    pub directory: PathBuf,
    /// The reason why it is not writable, for a person.
    pub why: Option<String>,
}

/// A notice for a person.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct NoticeStatus {
    /// Kind of event, for programs: `ended`, `killed`, `no-room` and so on.
    pub kind: String,
    /// The bundle or reporter concerned.
    pub about: Option<String>,
    /// Text for a person.
    pub text: String,
    /// Seconds since its last occurrence.
    #[serde(default)]
    pub ago_s: u64,
}

/// A path in a watched or given directory that could not be accessed, so that its content is
/// unknown.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Unseen {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub path: PathBuf,
    /// The reason, for a person.
    pub why: String,
}

impl std::fmt::Display for Unseen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "not scanned: {}: {}",
            path_text::to_text(&self.path),
            self.why
        )
    }
}

/// A file that is being written to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unfinished {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub path: PathBuf,
    /// The reason why it is not judged yet, for a person.
    pub why: String,
}

impl std::fmt::Display for Unfinished {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let path = path_text::to_text(&self.path);
        write!(f, "not judged yet: {path}: {}", self.why)
    }
}

/// Files published behind the gate, and files held back.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct GateStatus {
    /// The directory.
    #[serde(with = "path_text::one")]
    pub directory: PathBuf,
    /// Accepted files that are published.
    pub published: u64,
    /// Accepted files that are not published because of a dependency.
    pub held_back: u64,
    /// The first files held back.
    pub examples: Vec<HeldBack>,
}

/// A file that is accepted but not published.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HeldBack {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub file: PathBuf,
    /// The reason, for a person.
    pub why: String,
}

/// Numbers of files by state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct FileCounts {
    /// Known and existing files.
    pub total: u64,
    /// Files with a verdict for their current bytes.
    pub judged: u64,
    /// Files with the verdict accepted.
    pub accepted: u64,
    /// Files with the verdict rejected.
    pub rejected: u64,
    /// Files with the verdict undetermined.
    pub undetermined: u64,
}

/// Length and speed of the queue.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct QueueStatus {
    /// Files that wait to be checked.
    pub waiting: u64,
    /// Files that wait to be checked again in the background, because a bundle joined or the
    /// configuration changed.
    pub background: u64,
    /// Files that are being checked.
    pub active: u64,
    /// Waiting time of the oldest file, in seconds.
    pub oldest_waiting_s: f64,
    /// Verdicts per second over the last ten seconds.
    pub rate: f64,
    /// Seconds until the queue is empty at this rate.
    pub estimated_s: Option<f64>,
}

/// One bundle or reporter.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PeerStatus {
    /// Name.
    pub name: String,
    /// `bundle` or `reporter`.
    pub role: String,
    /// Version.
    pub version: String,
    /// Process id.
    pub pid: u32,
    /// `starting`, `ready`, `busy`, `silent`, `draining`, `down` or `gave up`.
    pub state: String,
    /// Number of its checkers.
    pub checkers: u64,
    /// Jobs in progress.
    pub active: u64,
    /// Number of its worker threads, as reported by itself.
    #[serde(default)]
    pub threads: u64,
    /// Jobs or results done since it joined.
    pub done: u64,
    /// Times that it was started again.
    pub restarts: u64,
    /// For a reporter: number of reports that are not written or not withdrawn.
    #[serde(default)]
    pub unreported: u64,
    /// Remarks, such as why it is down, or that it is slow.
    pub note: String,
    /// Its sandbox state; `None` if unknown, and for reporters.
    #[serde(default)]
    pub sandbox: Option<SandboxStatus>,
    /// For a shadow: progress of its trials.
    #[serde(default)]
    pub trials: Option<TrialCounts>,
}

/// Sandbox state of a bundle, as seen by the broker.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SandboxStatus {
    /// `confined`, `partly` or `open`.
    pub state: String,
    /// The reason why it is not fully sandboxed; empty when it is.
    pub why: String,
}
