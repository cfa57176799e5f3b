//! The case of a checker.

use qcbus_formats::xqar::{Checker, Issue, Level, Status};
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{is_blocked, issue_locations, path_for_people, reason};
use quick_junit::{NonSuccessKind, TestCase, TestCaseStatus};

use crate::suite::does_not_apply;
use crate::text::{counted, path, short};
use crate::{LONGEST_FINDING, MOST_FINDINGS};

/// How many characters of a text a message has: hosts show it on a line.
const LONGEST_MESSAGE: usize = 200;

/// The case of a checker.
pub(crate) fn case(id: &str, class: &str, checker: &Checker, findings: &Findings<'_>) -> TestCase {
    let mut status = status(checker);
    let mut said = findings.lines(checker);
    if is_unanswered(checker) {
        said = format!("{}\n{said}", reason_of(checker));
    }
    // Who reads the document back takes blanks around a text away.
    let said = said.trim();
    let is_red = matches!(status, TestCaseStatus::NonSuccess { .. });
    if is_red {
        status.set_description(said);
    }
    let mut case = TestCase::new(id, status);
    case.set_classname(class);
    if !is_red && !said.is_empty() {
        case.set_system_out(said);
    }
    case
}

/// A status that a host shows red.
pub(crate) fn red(kind: NonSuccessKind, ty: &str, message: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::non_success(kind);
    status.set_type(ty).set_message(message);
    status
}

/// Whether nobody knows what the checker would have found. One without a status, as ASAM's first form
/// has it, is taken at its issues, as the verdict takes it.
fn is_unanswered(checker: &Checker) -> bool {
    checker.status == Some(Status::Error)
}

fn status(checker: &Checker) -> TestCaseStatus {
    let mut issues = checker.issues.iter();
    let error = issues.find(|issue| issue.level == Level::Error);
    match error {
        _ if is_unanswered(checker) => {
            let message = short(&reason_of(checker), LONGEST_MESSAGE);
            red(NonSuccessKind::Error, "no answer", &message)
        }
        Some(error) => {
            let message = message(error, checker.issues.len());
            red(NonSuccessKind::Failure, &rule(error), &message)
        }
        None if checker.status != Some(Status::Skipped) && !is_blocked(checker) => {
            TestCaseStatus::success()
        }
        None => {
            let applies = !does_not_apply(checker);
            let mut status = TestCaseStatus::skipped();
            status
                .set_type(if applies { "blocked" } else { "not applicable" })
                .set_message(reason_of(checker));
            status
        }
    }
}

fn rule(issue: &Issue) -> String {
    match short(&issue.rule_uid, LONGEST_MESSAGE) {
        uid if uid.is_empty() => issue.level.as_str().to_owned(),
        uid => uid,
    }
}

/// The first error in short, and how many findings there are.
fn message(first: &Issue, findings: usize) -> String {
    let text = text_of(first, LONGEST_MESSAGE);
    match findings {
        0 | 1 => text,
        many => format!("{text} (1 of {})", counted(many, "finding")),
    }
}

fn text_of(issue: &Issue, most: usize) -> String {
    match short(&issue.description, most) {
        text if text.is_empty() => "(no description)".to_owned(),
        text => text,
    }
}

fn reason_of(checker: &Checker) -> String {
    short(&reason(checker), LONGEST_FINDING)
}

/// How findings of one result are said.
pub(crate) struct Findings<'r>(pub(crate) &'r ResultMessage);

impl Findings<'_> {
    /// The findings of a checker, one on a line, the worst first, and how many more there are.
    fn lines(&self, checker: &Checker) -> String {
        let mut issues: Vec<&Issue> = checker.issues.iter().collect();
        issues.sort_by_key(|issue| issue.level);
        let said = issues.iter().take(MOST_FINDINGS);
        let mut lines: Vec<String> = said.map(|issue| self.line(issue)).collect();
        let more = issues.len().saturating_sub(MOST_FINDINGS);
        if more > 0 {
            lines.push(format!("and {more} more; all are in the result file"));
        }
        lines.join("\n")
    }

    /// `path:row:col: level: text`, as far as known; without a row the element stands behind.
    fn line(&self, issue: &Issue) -> String {
        let place = issue_locations(issue).into_iter().next();
        let place = place.unwrap_or_default();
        let mut line = self.shortened(place.path.as_deref());
        for number in [place.row, place.row.and(place.column)].iter().flatten() {
            line.push_str(&format!(":{number}"));
        }
        let text = text_of(issue, LONGEST_FINDING);
        line.push_str(&format!(": {}: {text}", issue.level.as_str()));
        if let (None, Some(xpath)) = (place.row, &place.xpath) {
            line.push_str(&format!(" ({})", short(xpath, LONGEST_FINDING)));
        }
        line
    }

    /// Another file's path is relative to the same directory as that of the checked file.
    fn shortened(&self, other: Option<&str>) -> String {
        let Some(other) = other else {
            return path(&self.0.display_path);
        };
        path(path_for_people(self.0, other))
    }
}
