//! How a peer introduces itself.

use qcbus_document::FileKind;
use qcbus_formats::Text;
use qcbus_formats::pool::RuleUids;
use qcbus_formats::xqar::Level;
use serde::{Deserialize, Serialize};

/// Which side of the checking a peer is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// It checks documents and streams issues.
    Bundle,
    /// It receives results.
    Reporter,
}

/// The first words of a peer, repeated until it is welcomed. Small: it must fit one slot.
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
    /// Given by whoever started the process (`--launch`), so that a supervisor knows its own.
    pub launch: Option<u64>,
    /// How many jobs or results it takes at once.
    pub capacity: u16,
    /// How many threads it works with, for people who look at its status.
    pub threads: u16,
}

/// What a bundle can do; sent after the welcome, before its first job.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Catalogue {
    /// The bundle's short name, such as `xodr`; a configuration may use it for the name.
    pub alias: String,
    /// What the bundle checks.
    pub description: String,
    /// Date of the build, `YYYY-MM-DD`.
    pub build_date: String,
    /// Root files that it takes.
    pub kinds: Vec<FileKind>,
    /// Its checkers in the order of the result.
    pub checkers: Vec<CheckerInfo>,
}

/// One checker of a bundle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckerInfo {
    /// Identifier, unique in the bundle.
    pub id: Text,
    /// What it checks, in a sentence.
    pub description: Text,
    /// The rules that it answers for.
    pub rule_uids: RuleUids,
    /// Root files that it applies to.
    pub kinds: Vec<FileKind>,
    /// Whether it runs when no configuration asks for it.
    pub default_on: bool,
    /// Severity of its issues when it leaves nothing else to say.
    pub level: Level,
    /// Parameters that it reads.
    pub params: Vec<ParamInfo>,
}

/// A parameter of a checker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParamInfo {
    /// Name.
    pub name: String,
    /// Value unless the configuration says otherwise.
    pub default: String,
    /// Meaning and unit.
    pub description: String,
}
