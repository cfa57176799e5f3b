//! The test case of a checker.

use qcbus_formats::xqar::{Checker, Issue, Level, Status};
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{is_blocked, issue_locations, path_for_people, reason};
use quick_junit::{NonSuccessKind, TestCase, TestCaseStatus};

use crate::suite::does_not_apply;
use crate::text::{counted, path, short};
use crate::{LONGEST_FINDING, MOST_FINDINGS};

/// Maximum number of characters of a message; hosts show it on one line.
const LONGEST_MESSAGE: usize = 200;

/// Returns the test case of a checker.
pub(crate) fn case(id: &str, class: &str, checker: &Checker, findings: &Findings<'_>) -> TestCase {
    let mut status = status(checker);
    let mut said = findings.lines(checker);
    if is_unanswered(checker) {
        said = format!("{}\n{said}", reason_of(checker));
    }
    // A reader of the document trims spaces around a text, so they are trimmed here too.
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

/// Returns a status that a host shows in red.
pub(crate) fn red(kind: NonSuccessKind, ty: &str, message: &str) -> TestCaseStatus {
    let mut status = TestCaseStatus::non_success(kind);
    status.set_type(ty).set_message(message);
    status
}

/// Checks whether the checker gave no answer. A checker without a status, as in ASAM's first result
/// format, is judged by its issues, as in the verdict.
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

/// Returns the shortened first error and the number of findings.
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

/// Text of the findings of one result.
pub(crate) struct Findings<'r>(pub(crate) &'r ResultMessage);

impl Findings<'_> {
    /// Returns the findings, one per line and the most severe first, and the number of further
    /// ones.
    fn lines(&self, checker: &Checker) -> String {
        let mut issues: Vec<&Issue> = checker.issues.iter().collect();
        issues.sort_by_key(|issue| issue.level);
        let said = issues.iter().take(MOST_FINDINGS);
        let mut lines: Vec<String> = said.map(|issue| self.line(issue)).collect();
        let more = issues.len().saturating_sub(MOST_FINDINGS);
        if more > 0 {
            lines.push(format!(
                "and {more} more; the result file contains all of them"
            ));
        }
        lines.join("\n")
    }

    /// Returns `path:row:col: level: text` as far as known. Without a row, the element follows.
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

    /// Returns the display path of another file (from the checked file's base) or of the checked
    /// file.
    fn shortened(&self, other: Option<&str>) -> String {
        let Some(other) = other else {
            return path(&self.0.display_path);
        };
        path(path_for_people(self.0, other))
    }
}
