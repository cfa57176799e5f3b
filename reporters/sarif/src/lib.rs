//! Results as SARIF 2.1.0, for code scanning at GitHub, editors and viewers.
//!
//! A report is one log with one run of the tool `qcbus`:
//!
//! * `results`: the findings, the most severe first. `ruleId` is the rule's UID. It names the rule
//!   in the standard and in `qcbus rule`, is suitable for searches, and does not change between
//!   releases. A finding without a UID uses the id of its checker. The location is always in the
//!   checked file, because the finding decides that file's verdict. For a finding in another file,
//!   it is the reference to that file. All other places are `relatedLocations`.
//! * `artifacts`: every checked file, also without findings, with its SHA-256, its verdict and its
//!   number of findings. So an accepted file differs from one that was not checked.
//! * `invocations`: `executionSuccessful` is false if a checker failed or a verdict is
//!   undetermined. Hosts show only findings and treat missing ones as fixed. So an error replaces
//!   the missing answer: the rule [`UNANSWERED`].
//!
//! Paths are relative to `%SRCROOT%`, the given or watched directory. GitHub requires this to be
//! the root of the repository. GitHub replaces the findings of an earlier upload of the same
//! category. To upload reports of several files one by one, give each its category. One file for
//! all results is better.
//!
//! Findings beyond the limits of GitHub are left out, the least severe first ([`MOST_RESULTS`],
//! [`MOST_PACKED_BYTES`]). `toolConfigurationNotifications` and the run's properties report this.
//! The order depends only on the findings, so the same ones are left out next time.
//!
//! Parameter: `OutputFile` (see [`Output`]).

mod artifact;
mod finding;
mod limits;
mod log;
mod report;
mod rules;
mod section;
mod text;
mod unanswered;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::{FormatReporter, Registration};

pub use limits::{MOST_PACKED_BYTES, MOST_PLACES, MOST_RESULTS, SHOWN_RESULTS};
pub use report::Sarif;
pub use section::Section;
pub use unanswered::UNANSWERED;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-sarif";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "sarif",
    name: NAME,
    about: "NAME.sarif beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(Sarif::new(setting.pages), setting)),
};
