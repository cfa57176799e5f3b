//! Results as a code quality report of GitLab: a JSON array of Code Climate issues.
//!
//! ```json
//! [{
//!   "description": "…", "check_name": "asam.net:xodr:1.4.0:road.lane.link_order",
//!   "fingerprint": "…", "severity": "major",
//!   "location": {"path": "maps/a.xodr", "lines": {"begin": 12}},
//!   "qcbus": {"path": "/farm/maps/a.xodr", "verdict": "rejected"}
//! }]
//! ```
//!
//! * An error is `major`, a warning `minor`, information `info`. `critical` and `blocker` are
//!   reserved for something worse than a faulty file: a file with unknown state. A checker without
//!   an answer is a `blocker`. A file that is undetermined for another reason is also a `blocker`.
//! * `path` is relative to the given or watched directory. GitLab requires this to be the root of
//!   the repository. An entry is always about the checked file. A finding in another file stands at
//!   the reference to that file and names the place. A finding without a line is at line 1.
//! * GitLab shows only one of several equal fingerprints, so equal fingerprints are numbered.
//! * `qcbus` is an extension, and GitLab ignores it. The format cannot list files without findings:
//!   an accepted file without findings does not appear.
//!
//! GitLab documents no limit of entries, but the artifacts of a job have a maximum size. Pages with
//! very many entries are slow. The report holds the most severe [`MOST_ENTRIES`] and one more about
//! the entries that were left out. Entries are sorted by severity, then by file.
//!
//! Parameter: `OutputFile` (see [`Output`]). GitLab takes one file per job, so use one file for all
//! results.

mod entry;
mod report;
mod section;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::{FormatReporter, Registration};

pub use report::{CodeQuality, MOST_ENTRIES};
pub use section::Section;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-gitlab";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "gitlab",
    name: NAME,
    about: "NAME.codequality.json beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(CodeQuality, setting)),
};
