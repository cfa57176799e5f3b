//! Section of a checked file in the log.

use qcbus_formats::xqar::{Checker, CheckerBundle, Issue, Level};
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{
    IssueLocation, Silence, checkers, is_blocked, issue_locations, path_for_people, silences,
};

use crate::command::tame;
use crate::{Entry, LONGEST_TEXT};

/// The summary and the entries of a checked file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// The verdict and the number of findings, for example `rejected: 2 errors, 1 warning`.
    pub summary: String,
    /// Entries of the file: first the reasons for an undetermined verdict, then the findings in
    /// file order.
    pub entries: Vec<Entry>,
}

impl Section {
    pub(crate) fn of(result: &ResultMessage) -> Section {
        let mut entries = unanswered(result);
        entries.extend(findings(result));
        Section {
            summary: summary(result),
            entries,
        }
    }
}

/// Returns the blocked checkers, whatever their status.
fn blocked(result: &ResultMessage) -> Vec<&Checker> {
    let checkers = checkers(result).map(|(_, checker)| checker);
    checkers.filter(|it| is_blocked(it)).collect()
}

fn summary(result: &ResultMessage) -> String {
    let issues = || checkers(result).flat_map(|(_, checker)| &checker.issues);
    let of = |level| issues().filter(|issue| issue.level == level).count();
    let counts = [
        (of(Level::Error), "error", "errors"),
        (of(Level::Warning), "warning", "warnings"),
        (of(Level::Information), "information", "information"),
    ];
    let said = counts.into_iter().filter(|&(count, ..)| count > 0);
    let said: Vec<String> = said
        .map(|(count, one, many)| format!("{count} {}", if count == 1 { one } else { many }))
        .collect();
    let mut summary = match said.as_slice() {
        [] => format!("{}: no findings", result.verdict),
        _ => format!("{}: {}", result.verdict, said.join(", ")),
    };
    let blocked = blocked(result).len();
    if blocked > 0 {
        summary.push_str(&format!("; {} could not run", number_of(blocked)));
    }
    summary
}

fn number_of(checkers: usize) -> String {
    let plural = if checkers == 1 { "" } else { "s" };
    format!("{checkers} checker{plural}")
}

/// Returns an entry for each reason of a missing answer.
fn unanswered(result: &ResultMessage) -> Vec<Entry> {
    let about = match result.verdict {
        Verdict::Undetermined => "the file is undetermined, not accepted",
        Verdict::Accepted | Verdict::Rejected => "the file was not checked by all checkers",
    };
    let entry = |silence: Silence| {
        let said = format!("{about}: {silence}");
        let rule = silence.names.first();
        let rule = rule.map_or("qcbus/verdict", String::as_str);
        of_the_file(result, &said, without_blanks(rule))
    };
    silences(result).into_iter().map(entry).collect()
}

fn of_the_file(result: &ResultMessage, text: &str, rule: String) -> Entry {
    Entry {
        level: Level::Error,
        path: shown::line(&result.display_path).into_owned(),
        row: None,
        column: None,
        text: tame(text, LONGEST_TEXT),
        rule,
    }
}

/// Returns the findings in file order. For another file, the place of the reference counts.
fn findings(result: &ResultMessage) -> Vec<Entry> {
    let mut entries = Vec::new();
    for (bundle, checker) in checkers(result) {
        for issue in &checker.issues {
            let place = issue_locations(issue).into_iter().next();
            let place = place.unwrap_or_default();
            let here = place.row.map(|row| (row, place.column.unwrap_or(0)));
            // The path of another file is relative to the same directory as the path of the checked
            // file.
            let (path, order) = match &place.path {
                None => (&*result.display_path, here),
                Some(path) => (path_for_people(result, path), place.referred_at),
            };
            let entry = Entry {
                level: issue.level,
                path: shown::line(path).into_owned(),
                row: place.row,
                column: place.row.and(place.column),
                text: text_of(issue, &place),
                rule: rule(bundle, checker, issue),
            };
            entries.push((order, entry));
        }
    }
    entries.sort_by_key(|&(order, _)| order);
    entries.into_iter().map(|(_, entry)| entry).collect()
}

/// Returns the text of the finding, followed by the element if the row is unknown.
fn text_of(issue: &Issue, place: &IssueLocation) -> String {
    let text = match tame(&issue.description, LONGEST_TEXT) {
        text if text.is_empty() => "(no description)".to_owned(),
        text => text,
    };
    match (place.row, &place.xpath) {
        (None, Some(xpath)) => format!("{text} ({})", tame(xpath, LONGEST_TEXT)),
        _ => text,
    }
}

fn rule(bundle: &CheckerBundle, checker: &Checker, issue: &Issue) -> String {
    match without_blanks(&issue.rule_uid) {
        uid if uid.is_empty() => checker_name(bundle, checker),
        uid => uid,
    }
}

fn checker_name(bundle: &CheckerBundle, checker: &Checker) -> String {
    without_blanks(&format!("{}/{}", bundle.name, checker.id))
}

/// Replaces all spaces in a name. So the name begins after the last space of a line.
fn without_blanks(name: &str) -> String {
    tame(name, LONGEST_TEXT).replace(' ', "_")
}
