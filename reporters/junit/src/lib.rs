//! Results as JUnit, which most CI hosts draw.
//!
//! A test suite is a checked file, a test case one of its checkers:
//!
//! | what the checker did | its case |
//! |---|---|
//! | completed, nothing of level error | passed; other findings are in its `system-out` |
//! | found something of level error | `failure`; its message is the first of them, its text all findings |
//! | failed | `error` with the reason: nobody knows what it would have found |
//! | could not look, because of what others found | `skipped`, type `blocked`, with the reason |
//! | does not apply to the file | left out and counted |
//!
//! * **Blocked checkers are no errors of their own.** What blocked them is in the same result, and red
//!   there. A scenario without a version blocks a hundred checkers: a host that shows a hundred red cases
//!   hides the one that somebody has to mend. So that a verdict that is not an acceptance never looks green,
//!   a suite without a red case gets one, `verdict`, which is an `error` and says why.
//! * **Checkers that do not apply are left out**, because a host draws every case and these tell nobody
//!   anything: of 323 checkers, 125 are for other versions than that of an OpenDRIVE 1.4 file. Three hundred
//!   files, maps of several versions and scenarios, have 70,800 cases in 9.9 MB (0.75 MB packed) without
//!   them, and 91,800 in 15.3 MB with them. How many there are stands in the suite's property
//!   `qcbus.notApplicable` and its `system-out`. The parameter `Inapplicable` brings them back.
//! * **A checker without a status is taken at its issues**, as the verdict takes it: ASAM's first form of
//!   results has none.
//! * **The class of a case is `BUNDLE.PATH`**, with the file. Hosts tell cases apart by class and name
//!   alone (GitLab keeps one of each pair), and the same checker looks at every file.
//! * **The text of a case is bounded**: [`MOST_FINDINGS`] findings, the errors first, and how many more
//!   there are. All of them are in the `.xqar`.
//! * The document is valid against `junit-10.xsd`. There are no times, so equal results give equal bytes.
//!
//! Parameters: `OutputFile` (see [`Output`]) and `Inapplicable`: `counted` (default), or `listed` for a
//! skipped case, type `not applicable`, for each checker that does not apply.

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

/// What this crate offers.
pub static REPORTER: Registration = Registration {
    alias: "junit",
    name: NAME,
    about: "NAME.junit.xml beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(Suites, setting)),
};

/// How many findings one case says in full.
pub const MOST_FINDINGS: usize = 100;

/// How many characters of a finding's text are said.
pub const LONGEST_FINDING: usize = 500;
