//! Results as annotations of GitHub: workflow commands, which a runner reads from the log of a
//! step.
//!
//! ```text
//! maps/ring.xodr: accepted: no findings
//! ::group::maps/town.xodr: rejected: 2 errors, 1 warning
//! maps/town.xodr:12:5: error: the id "5" is taken [asam.net:xodr:1.4.0:ids.id_unique_in_class]
//! …
//! ::endgroup::
//! ::error file=maps/town.xodr,line=12,col=5,title=ids.id_unique_in_class::the id "5" is taken
//! …
//! ::notice title=qcbus::3 of 40 findings are annotated …
//! ```
//!
//! * **The log contains all findings**: a group for each file, with a line for each finding. A host
//!   takes [`MOST_ANNOTATIONS`] of each level from a step and silently drops the others. So this
//!   reporter selects that many of each level, spread over files and rules. A last notice gives the
//!   total. That is 30 at most, below the 50 of a job. If each report has its own file, these
//!   limits apply to each of them. Several of them in one step exceed the limits. A step should
//!   print one report of all files (`OutputFile`).
//! * **Missing answers are errors.** Failed checkers give one error for each reason. So do verdicts
//!   that are undetermined for other reasons. A checker without a status, as in ASAM's first result
//!   format, is judged by its issues, as in the verdict.
//! * **Untrusted text never becomes a command.** A runner knows two forms: `::error::` at the
//!   beginning of a line, after spaces, and the older `##[error]` anywhere in it. No line begins
//!   with untrusted text: findings begin with a path, in which a colon is written as `%3A`. Two `#`
//!   in sequence get a space between them (`%23` in a path). This also applies if only characters
//!   lie between them that a comparison by the rules of a language may ignore. Each line is
//!   harmless by itself, so `::stop-commands::` is not used. A log that ends before its token would
//!   disable commands for the rest of the step. Text copied from the log would be unprotected.
//! * Paths are display paths, relative to the given directory. Run the reporter from the root of
//!   the repository.
//!
//! Parameter: `OutputFile` (see [`Output`]).

mod choice;
mod command;
mod entry;
mod report;
mod section;

#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::{FormatReporter, Registration};

pub use entry::Entry;
pub use report::Annotations;
pub use section::Section;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-github";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "github",
    name: NAME,
    about: "NAME.github.txt beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(Annotations, setting)),
};

/// Maximum number of annotations of one level that GitHub takes from a step.
pub const MOST_ANNOTATIONS: usize = 10;

/// Maximum number of characters of a finding's text.
pub const LONGEST_TEXT: usize = 1000;
