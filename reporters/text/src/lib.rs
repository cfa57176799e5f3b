//! Results as text, in the manner of a compiler: what was found, where, the line of the file with
//! a caret, the rule, why it matters, and at the end the verdict with what ran and what did not.
//!
//! [`render`] is a pure function, so that `qcbus check` prints the very text that the report
//! files hold.
//!
//! Parameters: `OutputFile` (see [`Output`]; in one file, each report is under a line
//! `==== PATH ====`) and `LineWidth` in characters (40 to 1000, default 100).

mod issue;
mod paint;
mod report;
mod snippet;
mod summary;
mod wrap;

pub use report::DEFAULT_WIDTH;

use qcbus_formats::xqar::{Checker, CheckerBundle, Issue};
use qcbus_messages::ResultMessage;
#[cfg(doc)]
use qcbus_reporter_sdk::Output;
use qcbus_reporter_sdk::{FormReporter, IssueLocation, Registration, Sources, issue_locations};

use paint::Paint;

/// The reporter's name on the bus and in configurations.
pub const NAME: &str = "qc-report-text";

/// What this crate offers.
pub static REPORTER: Registration = Registration {
    alias: "text",
    name: NAME,
    about: "NAME.txt beside every result",
    make: |setting| Box::new(FormReporter::new(report::Full, setting)),
};

/// How to render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Columns to stay within where text can be wrapped or cut.
    pub width: usize,
    /// Whether to colour with ANSI escape sequences. The caller knows the terminal and `NO_COLOR`.
    pub color: bool,
    /// How many checkers that were skipped for one reason are named; the rest are counted.
    pub skipped_names: usize,
    /// Whether those that do not apply to the file are listed with the reason, and not only counted.
    pub inapplicable: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            width: DEFAULT_WIDTH,
            color: false,
            skipped_names: usize::MAX,
            inapplicable: true,
        }
    }
}

/// An issue with what is around it: one entry of a report.
pub(crate) struct Entry<'r> {
    pub(crate) bundle: &'r CheckerBundle,
    pub(crate) checker: &'r Checker,
    pub(crate) issue: &'r Issue,
    pub(crate) places: Vec<IssueLocation>,
}

/// The report of one result: its issues in the order of their places, then the verdict and the
/// summary. Ends with a line feed; equal input gives equal text.
pub fn render(result: &ResultMessage, options: &Options, sources: &dyn Sources) -> String {
    let paint = Paint::new(options.color);
    let mut entries = entries(result);
    entries.sort_by_key(order);
    let mut explained = std::collections::BTreeSet::new();
    let mut out = String::new();
    for entry in &entries {
        // Why a rule exists is said once per report, not under each of a hundred issues.
        let why = result.rules.get(&entry.issue.rule_uid);
        let why = why.filter(|_| explained.insert(entry.issue.rule_uid.as_str()));
        let view = issue::View {
            result,
            sources,
            paint,
            width: options.width,
        };
        view.write(&mut out, entry, why.map(String::as_str));
        out.push('\n');
    }
    summary::write(&mut out, result, paint, options);
    out
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

/// Issues are read along the file; what is in other files goes by where it is referred to, what
/// qcbus says about the check itself comes last. The sort is stable: ties stay in result order.
fn order(entry: &Entry<'_>) -> (bool, u64, u64) {
    let own = entry.bundle.name == qcbus_formats::pool::OWN_BUNDLE;
    let place = entry.places.first();
    let at = place.map_or((0, 0), |place| {
        let here = (place.row.unwrap_or(0), place.column.unwrap_or(0));
        match place.path {
            Some(_) => place.referred_at.unwrap_or((0, 0)),
            None => here,
        }
    });
    (own, at.0, at.1)
}
