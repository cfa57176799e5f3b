//! What a reporter crate offers to the program that runs it.

use crate::Reporter;

/// One reporter: a crate has a static of it, and the program's table names that static. This is all
/// that it takes: the command line, configurations and the broker know reporters by the table.
#[derive(Debug, Clone, Copy)]
pub struct Registration {
    /// What it is called on the command line: `sarif`.
    pub alias: &'static str,
    /// What it is called on the bus and in configurations: `qc-report-sarif`. A configuration may
    /// also say `sarif` and `SarifReport`.
    pub name: &'static str,
    /// What it writes, for the help: `NAME.sarif beside every result`.
    pub about: &'static str,
    /// Whether it is a page to look at, which nobody wants on a stream.
    pub is_page: bool,
    /// Makes one that has written nothing yet.
    pub make: fn(&Setting) -> Box<dyn Reporter>,
}

/// In what a reporter runs.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// Whether to colour what goes to `__stdout__` and `__stderr__`. Files are never coloured.
    pub color: bool,
    /// Whether what the one file for all already holds stays in it: for a daemon that is started
    /// again beside the same broker.
    pub keep: bool,
    /// Whether all results are known when [`Reporter::finish`] is called, and nobody looks before:
    /// files for all are then written once, and streams get one report.
    pub is_run: bool,
    /// What there is to read about rules.
    pub pages: Pages,
}

impl Setting {
    /// For a run of its own, without colours and pages.
    pub fn plain_run() -> Setting {
        Setting {
            color: false,
            keep: false,
            is_run: true,
            pages: |_, _| None,
        }
    }
}

/// The page of a rule, by its UID and the id of its checker; either may be empty.
pub type Pages = fn(uid: &str, checker: &str) -> Option<RulePage>;

/// What there is to read about a rule.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RulePage {
    /// The id of its checker.
    pub checker: String,
    /// What it is about, in a sentence.
    pub summary: String,
    /// All of the page, as Markdown.
    pub text: &'static str,
    /// Where the standard says it; empty when that is not known.
    pub link: String,
}
