//! Results as SARIF 2.1.0, for code scanning at GitHub, editors and viewers.
//!
//! A report is one log with one run of the tool `qcbus`:
//!
//! * `results`: the findings, the most severe first. `ruleId` is the rule's UID, which names the rule
//!   in the standard, in `qcbus rule` and for whoever searches for it, and which no release changes; a
//!   finding without one goes by its checker. The location is always in the checked file, whose verdict
//!   it decides: for what is wrong in another file it is the reference to that file. All other places
//!   are `relatedLocations`.
//! * `artifacts`: every checked file, also without findings, with its SHA-256, its verdict and what was
//!   found, so that an accepted file can be told from one that was not looked at.
//! * `invocations`: `executionSuccessful` is false as soon as a checker failed or a verdict is
//!   undetermined. Hosts show findings only, and take those that are gone for mended, so there is
//!   an error in place of the answer, too: the rule [`UNANSWERED`].
//!
//! Paths are relative to `%SRCROOT%`, the directory that was given or watched. GitHub wants that to be
//! the root of the repository, and replaces the findings of an earlier upload of the same category: to
//! upload reports of several files one by one, give each its category, or better use one file for all.
//!
//! What is more than GitHub takes is left out from the least severe on ([`MOST_RESULTS`],
//! [`MOST_PACKED_BYTES`]) and said in `toolConfigurationNotifications` and in the run's properties. The
//! order depends on nothing but the findings, so the same are left out again next time.
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

/// What this crate offers.
pub static REPORTER: Registration = Registration {
    alias: "sarif",
    name: NAME,
    about: "NAME.sarif beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(Sarif::new(setting.pages), setting)),
};
