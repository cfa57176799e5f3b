//! Results as text in the style of a compiler: the finding, its place, the source line with a
//! caret, the rule and its reason. At the end are the verdict and the state of the checkers.
//!
//! [`render`] is a pure function, so `qcbus check` prints exactly the text of the report files.
//!
//! Parameters: `OutputFile` (see [`Output`]; in a shared file, each report is under a line
//! `==== PATH ====`) and `LineWidth` in characters (40 to 1000, default 100).

mod alike;
mod concise;
mod issue;
mod paint;
mod report;
mod snippet;
mod summary;
mod wrap;

pub use concise::{Folding, concise};
pub use report::DEFAULT_WIDTH;

use qcbus_formats::xqar::{Checker, CheckerBundle, Issue, Level};
use qcbus_messages::ResultMessage;
#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::{FormatReporter, IssueLocation, Registration, Sources, issue_locations};

use paint::Paint;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-text";

/// Registration of this reporter.
pub static REPORTER: Registration = Registration {
    alias: "text",
    name: NAME,
    about: "NAME.txt beside every result",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(report::Full, setting)),
};

/// Registration of the concise form with one finding per line, which editors and CI read.
pub static CONCISE: Registration = Registration {
    alias: "concise",
    name: "qc-report-concise",
    about: "NAME.concise.txt beside every result: a line for each finding",
    is_page: false,
    make: |setting| Box::new(FormatReporter::new(report::Concise, setting)),
};

/// Options for rendering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Maximum number of columns for text that can be wrapped or cut.
    pub width: usize,
    /// Whether to use ANSI colours. The caller knows the terminal and `NO_COLOR`.
    pub color: bool,
    /// Maximum number of named checkers that were skipped for one reason; the others are counted.
    pub skipped_names: usize,
    /// Maximum number of named checkers that failed for one reason; the others are counted.
    pub failed_names: usize,
    /// Whether each issue gives its rule's UID and its checker in full.
    pub full_names: bool,
    /// Whether inapplicable checkers are listed with the reason and not only counted.
    pub inapplicable: bool,
    /// Whether only the first of several findings is shown that differ only in numbers and places.
    pub merges: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            width: DEFAULT_WIDTH,
            color: false,
            skipped_names: usize::MAX,
            failed_names: usize::MAX,
            full_names: true,
            inapplicable: true,
            merges: false,
        }
    }
}

/// Number of findings up to which all places have source lines, if the options merge findings.
const MOST_IN_FULL: usize = 6;

/// An entry of a report: an issue with its context.
pub(crate) struct Entry<'r> {
    pub(crate) bundle: &'r CheckerBundle,
    pub(crate) checker: &'r Checker,
    pub(crate) issue: &'r Issue,
    pub(crate) places: Vec<IssueLocation>,
}

/// Returns the report of one result: its issues in the order of their places, then the verdict and
/// the summary. It ends with a line feed. Equal input gives equal text.
pub fn render(result: &ResultMessage, options: &Options, sources: &dyn Sources) -> String {
    let mut out = findings(result, options, sources);
    summary::write(&mut out, result, Paint::new(options.color), options);
    out
}

/// Returns the findings without the verdict and its reasons. It is empty if there are no findings.
pub fn findings(result: &ResultMessage, options: &Options, sources: &dyn Sources) -> String {
    let paint = Paint::new(options.color);
    let mut explained = std::collections::BTreeSet::new();
    let mut out = String::new();
    let entries = sorted(result);
    let alike = match options.merges {
        true => alike::notes(&entries),
        false => vec![Some(String::new()); entries.len()],
    };
    let shown = alike.iter().flatten().count();
    let compact = options.merges && shown > MOST_IN_FULL;
    for (entry, alike) in entries.iter().zip(alike) {
        let Some(alike) = alike else {
            continue;
        };
        // The reason for a rule appears once per report and not under each of a hundred issues.
        let why = result.rules.get(&entry.issue.rule_uid);
        let why = why.filter(|_| explained.insert(entry.issue.rule_uid.as_str()));
        let view = issue::View {
            result,
            sources,
            paint,
            width: options.width,
            full_names: options.full_names,
            merges: options.merges,
            compact,
        };
        view.write(&mut out, entry, why.map(String::as_str), &alike);
        out.push('\n');
    }
    out
}

/// Returns lines for people about the checkers that failed and, with `blocked`, the blocked
/// checkers. It is empty if there are none.
pub fn not_looked(result: &ResultMessage, options: &Options, blocked: bool) -> String {
    summary::not_looked(result, options, blocked)
}

/// Returns all issues in reading order.
fn sorted(result: &ResultMessage) -> Vec<Entry<'_>> {
    let mut entries = entries(result);
    entries.sort_by_key(order);
    entries
}

fn entries(result: &ResultMessage) -> Vec<Entry<'_>> {
    let bundles = result.results.bundles.iter();
    let checkers = bundles.flat_map(|bundle| bundle.checkers.iter().map(move |c| (bundle, c)));
    let issues = checkers.flat_map(|(bundle, checker)| {
        let entry = move |issue| Entry {
            bundle,
            checker,
            issue,
            places: issue_locations(issue),
        };
        checker.issues.iter().map(entry)
    });
    issues.collect()
}

/// Returns the sort key of an entry. Levels that cause a rejection come first; within a level,
/// issues are in file order. An issue in another file uses the place of the reference. Issues from
/// qcbus about the check itself come last. The sort is stable: ties stay in result order.
fn order(entry: &Entry<'_>) -> (Level, bool, u64, u64) {
    let own = entry.bundle.name == qcbus_formats::pool::OWN_BUNDLE;
    let place = entry.places.first();
    let at = place.map_or((0, 0), |place| {
        let here = (place.row.unwrap_or(0), place.column.unwrap_or(0));
        match place.path {
            Some(_) => place.referred_at.unwrap_or((0, 0)),
            None => here,
        }
    });
    (entry.issue.level, own, at.0, at.1)
}
