//! What short-lived commands say to the broker over `control.sock`: one JSON object per line.

use std::collections::BTreeMap;
use std::path::PathBuf;

use qcbus_document::FileKind;
use serde::{Deserialize, Serialize};

use crate::{Catalogue, Verdict, path_text};

/// A command's request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case")]
pub enum Request {
    /// How are things?
    Status,
    /// Answer when the file's present bytes have a verdict.
    Wait {
        /// Absolute path of the file.
        #[serde(with = "path_text::one")]
        file: PathBuf,
        /// Give up after this many milliseconds; never, when absent.
        timeout_ms: Option<u64>,
    },
    /// Answer when the file's present bytes have a verdict, and every reporter has said that its report of it is
    /// written. A request of its own: a broker that does not know it must not answer without the reports.
    WaitReported {
        /// Absolute path of the file.
        #[serde(with = "path_text::one")]
        file: PathBuf,
        /// Give up after this many milliseconds; never, when absent.
        timeout_ms: Option<u64>,
    },
    /// Check a file for me, watched or not, and give me the result; nothing of it is kept.
    Check {
        /// Absolute path of the file.
        #[serde(with = "path_text::one")]
        file: PathBuf,
        /// Under what.
        check_context: CheckContext,
    },
    /// Drain and stop.
    Down,
    /// Read the configuration and the bundle manifests again.
    Reload,
    /// Demand a bundle no longer that no manifest names: one that joined by hand and is gone for
    /// good.
    RemoveBundle {
        /// Its name.
        name: String,
    },
    /// How does this bundle stand that I have added or changed?
    Bundle {
        /// Its name.
        name: String,
    },
    /// What has this shadow found?
    Trials {
        /// Its name.
        name: String,
    },
    /// What do the bundles offer that are there?
    Offers {
        /// All but these, which whoever asks knows.
        without: Vec<String>,
    },
}

/// The broker's answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "response", rename_all = "kebab-case")]
pub enum Response {
    /// Answer to `Status`.
    Status(Box<Status>),
    /// Answer to `Wait` and `WaitReported`.
    Verdict(FileVerdict),
    /// Answer to `Wait` and `WaitReported`: the time is over.
    TimedOut,
    /// Answer to `WaitReported`: the time is over, there is a verdict, and reports are missing.
    Unreported {
        /// The verdict.
        verdict: FileVerdict,
        /// The reporters that have not written theirs, each with why, for a person.
        reporters: Vec<String>,
    },
    /// Answer to `Wait`: the file cannot be looked at, or one that it refers to; it lies on a disk that does not answer,
    /// for instance.
    Unanswered {
        /// For a person.
        reason: String,
    },
    /// Answer to `Wait`: nobody watches this file, and why.
    Unwatched {
        /// For a person.
        reason: String,
    },
    /// Answer to `Check`.
    Checked(Box<Checked>),
    /// Answer to `Check`: this broker would not find what whoever asks would find, or cannot say; he is to check the
    /// file himself.
    Elsewhere {
        /// For a person.
        reason: String,
    },
    /// Answer to `Down`, sent when everything has been drained; to any other request, the broker stopped before it had
    /// an answer.
    Stopped,
    /// Answer to `Reload`: what changed, line by line; nothing when nothing did.
    Reloaded {
        /// For a person.
        changes: Vec<String>,
        /// What is odd about the configuration and the manifests now in force, for a person.
        #[serde(default)]
        notices: Vec<String>,
    },
    /// Answer to `RemoveBundle`: it is not demanded any more.
    Removed {
        /// What that means, for a person.
        what: String,
    },
    /// Answer to `Bundle`; nothing when there is none of this name.
    Bundle {
        /// How it stands.
        bundle: Option<Box<BundleReadiness>>,
    },
    /// Answer to `Trials`.
    Trials {
        /// How many there are of each kind; nothing when there is no such shadow.
        counts: Option<TrialCounts>,
        /// Those that would change a verdict, failed, or found anything: at most a thousand, what changes most first.
        trials: Vec<Trial>,
    },
    /// Answer to `Offers`.
    Offers {
        /// By name.
        offers: Vec<Offer>,
    },
    /// The request could not be carried out, and what stays in force.
    Failed {
        /// For a person.
        reason: String,
    },
}

/// How a bundle stands, of which a manifest says what is wanted.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct BundleReadiness {
    /// Its name.
    pub name: String,
    /// The command of the manifest that is in force; nothing when it was started by hand or comes with the program.
    pub command: Option<String>,
    /// Tells the files that this command runs, and all else of the manifest, from former ones.
    pub spec: u64,
    /// How the process of this very command stands.
    pub readiness: Readiness,
    /// Who judges at the moment, be it an older process; nothing when nobody does.
    pub runs: Option<Runs>,
    /// The last lines that a process of it has said before it ended without having joined, as it said them.
    #[serde(default)]
    pub said: Vec<String>,
}

/// How the process stands that is wanted of a bundle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "readiness", rename_all = "kebab-case")]
pub enum Readiness {
    /// It has joined, has said what it checks, and is asked from now on.
    Ready,
    /// It is being started, and nothing has gone wrong so far.
    Coming {
        /// It has said hello, and not yet what it checks.
        joined: bool,
    },
    /// It was started in vain; the broker tries again.
    Failing {
        /// Why, for a person.
        why: String,
    },
}

impl Default for Readiness {
    fn default() -> Readiness {
        Readiness::Coming { joined: false }
    }
}

/// A process of a bundle that judges.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Runs {
    /// Its version.
    pub version: String,
    /// Its process.
    pub pid: u32,
    /// How many checkers it offers.
    pub checkers: u64,
    /// The root files that it takes.
    pub kinds: Vec<FileKind>,
    /// How many of its checkers are asked under the configuration in force.
    pub demanded: u64,
    /// It has no weight in any verdict.
    #[serde(default)]
    pub shadow: bool,
}

/// How far a shadow is with its trials, and what they come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TrialCounts {
    /// Files that it has been asked about.
    pub tried: u64,
    /// Files that wait for it.
    pub waiting: u64,
    /// Files that are not rejected, and would be.
    pub would_reject: u64,
    /// Files that are accepted, and would be undetermined.
    pub would_leave_open: u64,
    /// Files that are undetermined because nobody judges them, and would be accepted.
    pub would_accept: u64,
    /// Files about which it could not say anything.
    pub failed: u64,
}

/// What a shadow said of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trial {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub file: PathBuf,
    /// The verdict on it.
    pub verdict: Verdict,
    /// The verdict that it would have if the shadow judged, too.
    pub would: Verdict,
    /// Issues of level error.
    pub errors: u64,
    /// Issues of level warning.
    pub warnings: u64,
    /// Issues of level information.
    pub information: u64,
    /// Its checkers that did not end well and why.
    pub why: Vec<String>,
    /// Why it said nothing, if it did not.
    pub failure: Option<String>,
    /// Where its result lies; empty when there is none.
    #[serde(with = "path_text::one")]
    pub result: PathBuf,
}

/// What a bundle offers that is there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Offer {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// What it checks.
    pub catalogue: Catalogue,
}

/// Under what a file is checked. A broker of the same program that works under equal terms finds the same.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CheckContext {
    /// Digest over the configuration, the form of results, and all limits.
    pub general: String,
    /// The bundles that are to look at the file, each with a digest over how it is started.
    pub bundles: BTreeMap<String, String>,
}

/// A result that was made for whoever asked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checked {
    /// The verdict; there is no result file.
    pub verdict: FileVerdict,
    /// The result, as its file is to have it.
    pub result: String,
    /// The files that this one rests on, which the verdict knows nothing of.
    pub rests_on: Vec<Referenced>,
}

/// A file that another one rests on.
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
    /// SHA-256 of the bytes that it is about.
    pub digest: String,
    /// Where the result lies; empty when there is none.
    #[serde(with = "path_text::one")]
    pub xqar: PathBuf,
    /// Issues of level error.
    pub errors: u64,
    /// Issues of level warning.
    pub warnings: u64,
    /// Issues of level information.
    pub information: u64,
    /// For undetermined: the checkers that did not end well and why. Otherwise empty.
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
    /// `notify` or `poll`, and why when it is not what was asked for.
    pub watch_mode: String,
    /// Where results go.
    #[serde(with = "path_text::one")]
    pub out: PathBuf,
    /// Where it keeps what must survive a restart.
    #[serde(default)]
    pub state: Option<PathBuf>,
    /// The directory of bundle manifests that it watches.
    #[serde(default)]
    pub bundles_d: Option<PathBuf>,
    /// Where accepted files are published, if anywhere.
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
    /// Counts up with every change of who must judge, or of what is demanded of them.
    pub epoch: u64,
    /// What lies in the watched directories and cannot be looked at now; the first hundred.
    #[serde(default)]
    pub unseen: Vec<Unseen>,
    /// What is being written to, and is not judged before it has settled; the first hundred.
    #[serde(default)]
    pub unfinished: Vec<Unfinished>,
    /// What keeps the broker from its work at this moment, for a person.
    #[serde(default)]
    pub troubles: Vec<String>,
    /// That the program on the disk is another by now than the one that runs, and what to do: for a person.
    #[serde(default)]
    pub replaced: Option<String>,
    /// Where one-shot modules of ASAM's framework have their private directories, as soon as it was looked at.
    #[serde(default)]
    pub scratch: Option<ScratchStatus>,
    /// Things a person should look at, newest last.
    pub notices: Vec<NoticeStatus>,
}

/// Where one-shot modules of ASAM's framework have their private directories.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ScratchStatus {
    /// The directory, which is made when it is missing.
    #[serde(with = "path_text::one")]
    pub directory: PathBuf,
    /// Why nothing can be written there, for a person.
    pub why: Option<String>,
}

/// Something that a person should look at.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct NoticeStatus {
    /// What kind of thing happened, for programs: `ended`, `killed`, `no-room` and so on.
    pub kind: String,
    /// The bundle or reporter that it is about.
    pub about: Option<String>,
    /// For a person.
    pub text: String,
    /// Seconds since it last happened.
    #[serde(default)]
    pub ago_s: u64,
}

/// Something in a watched or given directory that could not be looked at, so that nothing is known
/// of what lies there.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Unseen {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub path: PathBuf,
    /// Why, for a person.
    pub why: String,
}

impl std::fmt::Display for Unseen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "not looked at: {}: {}",
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
    /// Why it is not judged yet, for a person.
    pub why: String,
}

impl std::fmt::Display for Unfinished {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let path = path_text::to_text(&self.path);
        write!(f, "not judged yet: {path}: {}", self.why)
    }
}

/// What lies behind the gate, and what does not.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct GateStatus {
    /// The directory.
    #[serde(with = "path_text::one")]
    pub directory: PathBuf,
    /// Accepted files that are published.
    pub published: u64,
    /// Accepted files that are not, because of something that they depend on.
    pub held_back: u64,
    /// The first of them.
    pub examples: Vec<HeldBack>,
}

/// A file that is accepted and not published.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HeldBack {
    /// Absolute path.
    #[serde(with = "path_text::one")]
    pub file: PathBuf,
    /// Why: for a person.
    pub why: String,
}

/// How many files are in which state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct FileCounts {
    /// Known and present.
    pub total: u64,
    /// With a verdict for their present bytes.
    pub judged: u64,
    /// Verdict accepted.
    pub accepted: u64,
    /// Verdict rejected.
    pub rejected: u64,
    /// Verdict undetermined.
    pub undetermined: u64,
}

/// How much waits and how fast it goes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct QueueStatus {
    /// Files that wait to be checked.
    pub waiting: u64,
    /// Files that wait to be checked again in the background, because a bundle joined or the
    /// configuration changed.
    pub background: u64,
    /// Files that are being checked.
    pub active: u64,
    /// Seconds that the oldest has waited.
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
    /// Checkers that it offers.
    pub checkers: u64,
    /// Jobs that it is working on.
    pub active: u64,
    /// Threads that it works with, as it says itself.
    #[serde(default)]
    pub threads: u64,
    /// Jobs or results done since it joined.
    pub done: u64,
    /// Times that it was started again.
    pub restarts: u64,
    /// Of a reporter, reports that are not written or not taken back.
    #[serde(default)]
    pub unreported: u64,
    /// Remarks: why it is down, that it is slow.
    pub note: String,
    /// How far it is confined; nothing where nobody can tell, and for reporters.
    #[serde(default)]
    pub sandbox: Option<SandboxStatus>,
    /// Of a shadow, how its trials stand.
    #[serde(default)]
    pub trials: Option<TrialCounts>,
}

/// How far a bundle is confined, as the broker sees it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SandboxStatus {
    /// `confined`, `partly` or `open`.
    pub state: String,
    /// Why not wholly; empty when it is.
    pub why: String,
}
