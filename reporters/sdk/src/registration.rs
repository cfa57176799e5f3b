//! Registration of a reporter crate in the program that runs it.

use crate::Reporter;

/// One reporter: a crate has a static of this type, and the program's table names it. The command
/// line, configurations and the broker need only the table.
#[derive(Debug, Clone, Copy)]
pub struct Registration {
    /// Name on the command line: `sarif`.
    pub alias: &'static str,
    /// Name on the bus and in configurations: `qc-report-sarif`. A configuration may also use
    /// `sarif` and `SarifReport`.
    pub name: &'static str,
    /// Description of the output for the help: `NAME.sarif beside every result`.
    pub about: &'static str,
    /// Whether the output is a page for a browser, which is not suitable for a stream.
    pub is_page: bool,
    /// Creates a reporter that has not written anything.
    pub make: fn(&Setting) -> Box<dyn Reporter>,
}

/// Environment in which a reporter runs.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// Whether to colour the output on `__stdout__` and `__stderr__`. Files are never coloured.
    pub color: bool,
    /// Whether the shared file keeps its earlier content. A daemon needs this when it is restarted
    /// beside the same broker.
    pub keep: bool,
    /// Whether all results are known at [`Reporter::finish`] and no reader needs the files before.
    /// Then shared files are written once, and streams get one report.
    pub is_run: bool,
    /// Source of the rule pages.
    pub pages: Pages,
}

/// Function that returns a rule's page by UID and checker id; either may be empty.
pub type Pages = fn(uid: &str, checker: &str) -> Option<RulePage>;

/// Page about a rule.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RulePage {
    /// Id of the rule's checker.
    pub checker: String,
    /// Description of the rule in one sentence.
    pub summary: String,
    /// The whole page as Markdown.
    pub text: &'static str,
    /// Link to the rule in the standard; empty if it is unknown.
    pub link: String,
}
