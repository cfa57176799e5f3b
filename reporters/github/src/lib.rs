//! Results as annotations of GitHub: workflow commands, which a runner reads from the log of a step.
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
//! * **The log has everything**, a line for each finding in a group for each file. A host takes
//!   [`MOST_ANNOTATIONS`] of each level from a step and drops the others without a word, so as many are
//!   chosen here, spread over files and rules, and a last notice says how many there are. That is 30 at
//!   most, below the 50 of a job. Reports in files of their own have these limits each: who prints
//!   several in one step loses some, so one report of all files (`OutputFile`) is what a step should
//!   print.
//! * **No answer is an error.** Checkers that failed, one error for each reason, and verdicts that are
//!   undetermined for other reasons. A checker without a status, as ASAM's first form of results has it,
//!   is taken at its issues, as the verdict takes it.
//! * **Text of others is no command.** A runner knows two forms: `::error::` at the begin of a line, after
//!   blanks, and the older `##[error]` anywhere in it. No line begins with text of others: findings
//!   begin with a path, in which a colon is written as `%3A`. Two `#` one after the other get a blank
//!   between them (`%23` in a path), also where only characters lie between that a comparison by the rules of
//!   a language may pass over. That each line is harmless by itself is why `::stop-commands::` is not
//!   used: a log that ends before its token would leave the rest of the step without commands, and what
//!   is copied from it would have no protection.
//! * Paths are those for people, from the directory that was given: run it from the root of the repository.
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

/// What this crate offers.
pub static REPORTER: Registration = Registration {
    alias: "github",
    name: NAME,
    about: "NAME.github.txt beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(Annotations, setting)),
};

/// How many annotations of one level GitHub takes from a step.
pub const MOST_ANNOTATIONS: usize = 10;

/// How many characters of a finding's text are said.
pub const LONGEST_TEXT: usize = 1000;
