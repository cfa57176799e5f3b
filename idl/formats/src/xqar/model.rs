//! The content of a result file (`.xqar`), as ASAM's quality checker framework models it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Text;
use crate::location::OtherPlace;

/// Severity of an issue. The number is the one written to files; a smaller number is worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Level 1: the file violates a mandatory rule.
    Error = 1,
    /// Level 2: the file violates a recommendation, or something looks wrong.
    Warning = 2,
    /// Level 3: useful information.
    Information = 3,
}

impl Level {
    /// Returns the level of a number as written to files.
    pub fn from_number(number: u8) -> Option<Level> {
        match number {
            1 => Some(Level::Error),
            2 => Some(Level::Warning),
            3 => Some(Level::Information),
            _ => None,
        }
    }

    /// Returns the level of a word, in any letter case, or of a number.
    pub fn from_word(text: &str) -> Option<Level> {
        match text.trim().to_ascii_lowercase().as_str() {
            "error" | "1" => Some(Level::Error),
            "warning" | "warn" | "2" => Some(Level::Warning),
            "information" | "info" | "3" => Some(Level::Information),
            _ => None,
        }
    }

    /// Returns the word for it.
    pub fn as_str(self) -> &'static str {
        match self {
            Level::Error => "error",
            Level::Warning => "warning",
            Level::Information => "information",
        }
    }
}

impl Status {
    /// Returns the word for it, as written to files.
    pub fn as_str(self) -> &'static str {
        match self {
            Status::Completed => "completed",
            Status::Skipped => "skipped",
            Status::Error => "error",
        }
    }
}

/// How a checker ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// It ran to its end.
    Completed,
    /// It did not apply: version, kind of file or a precondition.
    Skipped,
    /// It did not run as required: crash, deadline, panic, missing.
    Error,
}

/// A whole result file: `CheckerResults`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Results {
    /// Version of the result format.
    pub version: String,
    /// Results by bundle, in configuration order.
    pub bundles: Vec<CheckerBundle>,
}

/// Findings of one bundle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CheckerBundle {
    /// Name, such as `xodrBundle`.
    pub name: String,
    /// Version of the bundle.
    pub version: String,
    /// Date of the build, `YYYY-MM-DD`.
    pub build_date: String,
    /// What the bundle checks.
    pub description: String,
    /// Numbers of its checkers by status.
    pub summary: String,
    /// Effective parameters, including `InputFile`.
    pub params: Vec<Param>,
    /// Its checkers, in order.
    pub checkers: Vec<Checker>,
}

/// A named value.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Param {
    /// Name; never empty.
    pub name: String,
    /// Value, as text.
    pub value: String,
}

/// Findings of one checker.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Checker {
    /// Identifier, such as `check_asam_xodr_xml_root_tag_is_opendrive`.
    pub id: Text,
    /// What it checks.
    pub description: Text,
    /// The reason why it was skipped or failed, and its number of issues.
    pub summary: Text,
    /// How it ended; files written by other tools may omit it.
    pub status: Option<Status>,
    /// Effective parameters.
    pub params: Vec<Param>,
    /// Its findings.
    pub issues: Vec<Issue>,
    /// The rule UIDs that it checks.
    pub addressed_rules: Arc<[Text]>,
    /// Further facts, such as the run time.
    pub metadata: Vec<Metadata>,
}

/// A further fact about a checker's run.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Metadata {
    /// Name of the fact.
    pub key: String,
    /// Its value.
    pub value: String,
    /// Meaning of the fact.
    pub description: String,
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Issue {
    /// Running number over a whole result. Pooling assigns it; it is 0 before.
    pub id: u64,
    /// The finding and the allowed state.
    pub description: String,
    /// Severity.
    pub level: Level,
    /// The violated rule.
    pub rule_uid: String,
    /// The places of the issue, each with its own description.
    pub locations: Vec<Locations>,
    /// Facts without an element in the format, such as road positions.
    pub domain_info: Vec<DomainInfo>,
}

/// One place, described in one or several ways. For a place in another file, they lead to the
/// reference in the checked file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Locations {
    /// Explanation of this place.
    pub description: String,
    /// The actual place, when it is in another file than the checked one.
    pub elsewhere: Option<OtherPlace>,
    /// The descriptions of the place, in the order of the file.
    pub places: Vec<Location>,
}

/// One way to describe a place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Location {
    /// A place in the text of the checked file.
    File {
        /// Line, from 1.
        row: u64,
        /// Column in characters, from 1.
        column: u64,
        /// Offset in bytes from the start of the file as stored on disk, if known.
        offset: Option<u64>,
    },
    /// An element or attribute of the checked file.
    Xml {
        /// An XPath 1.0 expression that selects it.
        xpath: String,
    },
    /// A point in the inertial coordinate system, in metres.
    Inertial {
        /// East.
        x: f64,
        /// North.
        y: f64,
        /// Up.
        z: f64,
    },
    /// A point in a road's coordinates, in metres.
    Road {
        /// `@id` of the road.
        road_id: String,
        /// Coordinate along the reference line.
        s: f64,
        /// Coordinate across the reference line; left is positive.
        t: f64,
    },
    /// A point in time, in seconds.
    Time {
        /// Seconds from the start.
        time: f64,
    },
    /// A message of a trace.
    Message {
        /// Number of the message.
        index: u64,
        /// Channel, if known.
        channel: Option<String>,
        /// Field of the message, if known.
        field: Option<String>,
        /// Time of the message in seconds, if known.
        time: Option<f64>,
    },
}

/// A `DomainSpecificInfo`: a name and a tree of elements.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct DomainInfo {
    /// Name, such as `qcbus.location`.
    pub name: String,
    /// The elements inside.
    pub content: Vec<InfoElement>,
}

/// One element inside a [`DomainInfo`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InfoElement {
    /// Tag.
    pub name: String,
    /// Attributes in order.
    pub attributes: Vec<(String, String)>,
    /// Text before the first child.
    pub text: String,
    /// Elements inside.
    #[serde(deserialize_with = "bounded_children")]
    pub children: Vec<InfoElement>,
}

/// Maximum depth of a tree that is read or decoded; every later step recurses. A whole result as
/// JSON then stays within the 128 levels that serde_json allows.
pub(crate) const MAX_INFO_DEPTH: usize = 48;

/// Decodes the children of an [`InfoElement`]. Messages come from untrusted processes. A tree of a
/// hundred thousand levels would overflow the decoder's stack.
fn bounded_children<'de, D>(deserializer: D) -> Result<Vec<InfoElement>, D::Error>
where
    D: serde::Deserializer<'de>,
{
    thread_local! {
        static DEPTH: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
    }
    struct Level;
    impl Drop for Level {
        fn drop(&mut self) {
            DEPTH.with(|depth| depth.set(depth.get().saturating_sub(1)));
        }
    }
    let depth = DEPTH.with(|depth| depth.replace(depth.get() + 1));
    let _level = Level;
    if depth >= MAX_INFO_DEPTH {
        let text = format!("domain specific elements are nested deeper than {MAX_INFO_DEPTH}");
        return Err(serde::de::Error::custom(text));
    }
    Vec::deserialize(deserializer)
}
