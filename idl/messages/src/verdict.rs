//! The verdict on a file.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What a farm may do with a file. `Undetermined` is never `Accepted`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Every demanded checker ran or did not apply, and none of the issues kept is an error.
    Accepted,
    /// At least one of the issues kept is an error.
    Rejected,
    /// A demanded checker crashed, hung, was cut off or was absent, and no error was found.
    Undetermined,
}

impl Verdict {
    /// The word written to reports and verdict files.
    pub fn as_str(self) -> &'static str {
        match self {
            Verdict::Accepted => "accepted",
            Verdict::Rejected => "rejected",
            Verdict::Undetermined => "undetermined",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}
