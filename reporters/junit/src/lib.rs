//! Results as JUnit, which most CI hosts can display.
//!
//! A test suite is a checked file, a test case one of its checkers:
//!
//! | state of the checker | its case |
//! |---|---|
//! | completed, no finding of level error | passed; other findings are in its `system-out` |
//! | at least one finding of level error | `failure`; its message is the first of them, its text all findings |
//! | failed | `error` with the reason; its findings are unknown |
//! | blocked by findings of other checkers | `skipped`, type `blocked`, with the reason |
//! | does not apply to the file | left out and counted |
//!
//! * **Blocked checkers are not errors.** The finding that blocked them is in the same result, and
//!   red there. A scenario without a version blocks a hundred checkers. A host that shows a hundred
//!   red cases hides the one that must be fixed. A verdict other than accepted must never look
//!   green. So a suite without a red case gets the case `verdict`, which is an `error` and gives
//!   the reason.
//! * **Checkers that do not apply are left out**, because a host draws every case and these have no
//!   information. Of 323 checkers, 125 are for other versions than that of an OpenDRIVE 1.4 file.
//!   Example: three hundred files, maps of several versions and scenarios. They have 70,800 cases
//!   in 9.9 MB (0.75 MB packed) without these checkers, and 91,800 in 15.3 MB with them. The
//!   suite's property `qcbus.notApplicable` and its `system-out` give their number. The parameter
//!   `Inapplicable` adds them again.
//! * **A checker without a status is judged by its issues**, as in the verdict: ASAM's first result
//!   format has no status.
//! * **The class of a case is `BUNDLE.PATH`**, with the file. Hosts identify cases by class and
//!   name alone (GitLab keeps one of each pair), and the same checker checks every file.
//! * **The text of a case is bounded**: [`MOST_FINDINGS`] findings, the errors first, and the
//!   number of further findings. All of them are in the `.xqar`.
//! * The document is valid against `junit-10.xsd`. It has no times, so equal results give equal
//!   bytes.
//!
//! Parameters: `OutputFile` (see [`Output`]) and `Inapplicable`: `counted` (default), or `listed`
//! for a skipped case, type `not applicable`, for each checker that does not apply.

mod case;
mod report;
mod suite;
mod text;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::{FormatReporter, Registration};

pub use report::Suites;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-junit";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "junit",
    name: NAME,
    about: "NAME.junit.xml beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(Suites, setting)),
};

/// Maximum number of findings that one case lists in full.
pub const MOST_FINDINGS: usize = 100;

/// Maximum number of characters of a finding's text.
pub const LONGEST_FINDING: usize = 500;
