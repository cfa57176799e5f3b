//! Entries of one checked file.

use qcbus_formats::xqar::{Checker, CheckerBundle, Issue, Level};
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{
    IssueLocation, Silence, checkers, fingerprint, fingerprint_of, issue_locations, one_line,
    silences,
};

use crate::entry::{Entry, Lines, Location, Own, Severity};

/// Maximum number of characters of a description.
const LONGEST_TEXT: usize = 2000;

/// Largest line number that is written; readers use 32 bits.
const LARGEST_LINE: u64 = i32::MAX as u64;

/// Entries of one checked file in a report; empty if the file is accepted without findings.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Section {
    /// Entries, the most severe first, then in result order. Fingerprints have no numbers.
    pub(crate) entries: Vec<Entry>,
}

impl Section {
    pub(crate) fn of(result: &ResultMessage) -> Section {
        let mut entries = unanswered(result);
        for (bundle, checker) in checkers(result) {
            let issues = checker.issues.iter();
            entries.extend(issues.map(|issue| finding(result, bundle, checker, issue)));
        }
        entries.sort_by_key(|entry| entry.severity);
        Section { entries }
    }
}

/// Returns an entry for each reason of a missing answer.
fn unanswered(result: &ResultMessage) -> Vec<Entry> {
    let about = match result.verdict {
        Verdict::Undetermined => "the file is undetermined, not accepted",
        Verdict::Accepted | Verdict::Rejected => "the file was not checked by all checkers",
    };
    let said = |silence: Silence| {
        let name = silence
            .names
            .first()
            .map_or("qcbus/verdict", String::as_str);
        blocker(result, name, &format!("{about}: {silence}"))
    };
    silences(result).into_iter().map(said).collect()
}

fn checker_name(bundle: &CheckerBundle, checker: &Checker) -> String {
    short(&format!("{}/{}", bundle.name, checker.id))
}

fn blocker(result: &ResultMessage, name: &str, text: &str) -> Entry {
    Entry {
        description: short(text),
        check_name: short(name),
        fingerprint: fingerprint_of(&["no answer", &result.display_path, name]),
        severity: Severity::Blocker,
        location: place(result, None),
        qcbus: own(result),
    }
}

fn finding(
    result: &ResultMessage,
    bundle: &CheckerBundle,
    checker: &Checker,
    issue: &Issue,
) -> Entry {
    let main = issue_locations(issue).into_iter().next();
    let check_name = match short(&issue.rule_uid) {
        none if none.is_empty() => checker_name(bundle, checker),
        uid => uid,
    };
    let row = main.as_ref().and_then(|place| match place.path {
        None => place.row,
        Some(_) => place.referred_at.map(|(row, _)| row),
    });
    Entry {
        description: short(&described(issue, main.as_ref())),
        fingerprint: fingerprint(&result.display_path, &check_name, issue, main.as_ref()),
        check_name,
        severity: match issue.level {
            Level::Error => Severity::Major,
            Level::Warning => Severity::Minor,
            Level::Information => Severity::Info,
        },
        location: place(result, row),
        qcbus: own(result),
    }
}

/// Returns the text with the place in another file, or with the element if the line is unknown.
fn described(issue: &Issue, main: Option<&IssueLocation>) -> String {
    let text = match issue.description.trim() {
        "" => "(no description)",
        text => text,
    };
    match main {
        Some(IssueLocation {
            path: Some(path),
            row,
            ..
        }) => match row {
            Some(row) => format!("{text} (in {path}, line {row})"),
            None => format!("{text} (in {path})"),
        },
        Some(IssueLocation {
            row: None,
            xpath: Some(xpath),
            ..
        }) => format!("{text} ({xpath})"),
        _ => text.to_owned(),
    }
}

fn place(result: &ResultMessage, row: Option<u64>) -> Location {
    let path = shown::line(&result.display_path);
    Location {
        path: path.strip_prefix("./").unwrap_or(&path).to_owned(),
        lines: Lines {
            begin: row.unwrap_or(1).clamp(1, LARGEST_LINE),
        },
    }
}

fn own(result: &ResultMessage) -> Own {
    Own {
        path: result.input.clone(),
        verdict: result.verdict.as_str().to_owned(),
    }
}

/// Returns the text on one line, cut to the maximum length.
fn short(text: &str) -> String {
    let line = one_line(text);
    match line.char_indices().nth(LONGEST_TEXT) {
        Some((end, _)) => format!("{}…", line.get(..end).unwrap_or_default().trim_end()),
        None => line,
    }
}
