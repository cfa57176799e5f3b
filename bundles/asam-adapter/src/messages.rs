//! Requests of a bus process to a runner, and their answers.

use std::path::PathBuf;

use qcbus_formats::config::Config;
use qcbus_messages::path_text;
use serde::{Deserialize, Serialize};

/// Maximum size of a message in bytes: the documents of a job with all files that they refer to.
pub(crate) const MOST: u64 = 8 << 30;

/// Request to run the module once.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    /// Documents, with the checked file first.
    pub files: Vec<Document>,
    /// Configuration in force.
    pub config: Option<Config>,
    /// Names under which the module may look for its section of a configuration.
    pub applications: Vec<String>,
    /// Parameters of a report module, or `None` for a checker module. Its only file is a result.
    pub report: Option<Vec<(String, String)>>,
}

/// A file of a job.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Document {
    /// Original path of the file.
    #[serde(with = "path_text::one")]
    pub path: PathBuf,
    pub bytes: Bytes,
    /// Original path of a packed file. `path` is then the path that it would have without packing.
    pub packed: Option<PathBuf>,
}

/// Location of the bytes of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Bytes {
    /// In the body of the message, after the bytes of the files before. The value is their number.
    Here(u64),
    /// On disk at the file's path, with this SHA-256. The image does not contain these bytes,
    /// because the file is packed or in another encoding.
    OnDisk([u8; 32]),
}

/// Outcome of a request. The body of the message is the result file, or the output of a report
/// module.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum Answer {
    Ran(Ran),
    /// The module was not started.
    Not(String),
    /// The program differs from the learned one. The value is a text for the user.
    Changed(String),
}

/// A run that has ended.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Ran {
    /// Reason why the run is rejected, to be read after the name of the module.
    pub fault: Option<String>,
    /// Final output of the run.
    pub said: String,
    /// Name of the section from which the run took its result path, or `None` if it wrote no
    /// result.
    pub application: Option<String>,
    /// File that was given to the run.
    pub input: String,
    /// Original path of the input file, if it is packed.
    pub packed: Option<String>,
    /// Directory that replaces `real` in the run.
    pub staged: String,
    /// Original directory of all documents.
    pub real: String,
    /// Private directory. It contains all other files of the run.
    pub room: String,
    /// Files written by a report module with their lengths, in the order of the body.
    pub reports: Vec<(String, u64)>,
}
