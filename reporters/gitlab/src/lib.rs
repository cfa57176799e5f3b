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
//! * An error is `major`, a warning `minor`, information `info`. `critical` and `blocker` are left to
//!   what is worse than a faulty file: a file of which nobody knows. A checker that gave no answer is a
//!   `blocker`, and so is a file that is undetermined for another reason.
//! * `path` is relative to the directory that was given or watched, which GitLab wants to be the root of
//!   the repository. An entry is always about the checked file; what is wrong in another file stands at
//!   the reference to it and names the place. A finding without a line is at line 1.
//! * Of equal fingerprints GitLab shows one, so those that would be equal are numbered.
//! * `qcbus` is ours; GitLab passes over it. The format has no place for files without findings: an
//!   accepted file is one of which nothing is said.
//!
//! GitLab names no limit of entries, but a job's artifacts have a size, and pages with very many are
//! slow. The report holds the most severe [`MOST_ENTRIES`] and one more that says what was left out.
//! Entries are sorted by severity, then file by file.
//!
//! Parameter: `OutputFile` (see [`Output`]); GitLab takes one file per job, so one for all is best.

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

/// What this crate offers.
pub static REPORTER: Registration = Registration {
    alias: "gitlab",
    name: NAME,
    about: "NAME.codequality.json beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(CodeQuality, setting)),
};
