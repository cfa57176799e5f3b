//! Registration of a peer.

use qcbus_document::FileKind;
use qcbus_formats::Text;
use qcbus_formats::pool::RuleUids;
use qcbus_formats::xqar::Level;
use serde::{Deserialize, Serialize};

/// Role of a peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// It checks documents and streams issues.
    Bundle,
    /// It receives results.
    Reporter,
}

/// First message of a peer, repeated until it is welcomed. It must fit one slot.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// [`crate::PROTOCOL_VERSION`] of the peer.
    pub protocol: u32,
    /// Bundle or reporter.
    pub role: Role,
    /// Name, such as `xodrBundle` or `qc-report-text`; at most 64 bytes of `[A-Za-z0-9._-]`.
    pub name: String,
    /// Version of the peer.
    pub version: String,
    /// A random number, new for every process.
    pub incarnation: u64,
    /// Process id.
    pub pid: u32,
    /// Number from the start of the process (`--launch`), by which a supervisor recognises it.
    pub launch: Option<u64>,
    /// Maximum number of jobs or results at once.
    pub capacity: u16,
    /// Number of worker threads, shown in the status.
    pub threads: u16,
}

/// Capabilities of a bundle, sent after the welcome and before its first job.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Catalogue {
    /// The bundle's short name, such as `xodr`. A configuration may use it instead of the name.
    pub alias: String,
    /// What the bundle checks.
    pub description: String,
    /// Date of the build, `YYYY-MM-DD`.
    pub build_date: String,
    /// Root files that it accepts.
    pub kinds: Vec<FileKind>,
    /// Its checkers in the order of the result.
    pub checkers: Vec<CheckerInfo>,
}

/// One checker of a bundle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckerInfo {
    /// Identifier, unique in the bundle.
    pub id: Text,
    /// Subject of the check, in a sentence.
    pub description: Text,
    /// The rules that it checks.
    pub rule_uids: RuleUids,
    /// Root files that it applies to.
    pub kinds: Vec<FileKind>,
    /// Whether it runs when no configuration requests it.
    pub default_on: bool,
    /// Default severity of its issues.
    pub level: Level,
    /// Parameters that it reads.
    pub params: Vec<ParamInfo>,
}

/// A parameter of a checker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParamInfo {
    /// Name.
    pub name: String,
    /// Value if the configuration does not set it.
    pub default: String,
    /// Meaning and unit.
    pub description: String,
}
