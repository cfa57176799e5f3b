//! What a bus process asks of an office, and what that answers.

use std::path::PathBuf;

use qcbus_formats::config::Config;
use qcbus_messages::path_text;
use serde::{Deserialize, Serialize};

/// Largest message, in bytes: the documents of a job with everything that they refer to.
pub(crate) const MOST: u64 = 8 << 30;

/// Run the module once.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    /// The documents, the one that is checked first.
    pub files: Vec<Document>,
    /// The configuration in force.
    pub config: Option<Config>,
    /// The names by which the module may look for its section of a configuration.
    pub applications: Vec<String>,
    /// It is a report module, with these parameters: its one file is a result.
    pub report: Option<Vec<(String, String)>>,
}

/// A file of a job.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Document {
    /// Where it really is.
    #[serde(with = "path_text::one")]
    pub path: PathBuf,
    pub bytes: Bytes,
    /// Where it really is packed, when `path` is only where it would be if it were not.
    pub packed: Option<PathBuf>,
}

/// Where the bytes of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Bytes {
    /// In the body of the message, so many, behind those of the files before.
    Here(u64),
    /// Still at their path, with this SHA-256: an image does not have them, because they are packed or in another
    /// encoding.
    OnDisk([u8; 32]),
}

/// What came of it. The body of the message is the result file, or what a report module has written.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum Answer {
    Ran(Ran),
    /// The module was not started.
    Not(String),
    /// The program is not the one that was learned, for a person.
    Changed(String),
}

/// A run that has ended.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Ran {
    /// Why nothing of it counts, reads on after the name of the module.
    pub fault: Option<String>,
    /// What it printed last.
    pub said: String,
    /// The name in whose section it found where to write its result. `None`: it wrote none.
    pub application: Option<String>,
    /// The file that it was given.
    pub input: String,
    /// Where that one is packed, if it is.
    pub packed: Option<String>,
    /// The directory that stands for `real`.
    pub staged: String,
    /// The directory in which all documents lie, in truth.
    pub real: String,
    /// The private directory, in which everything else is.
    pub room: String,
    /// The files that a report module has written, each with its length, in the order of the body.
    pub reports: Vec<(String, u64)>,
}
