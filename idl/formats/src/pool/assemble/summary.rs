//! Summaries, computed from the actual content of the result.

use std::fmt;
use std::sync::LazyLock;

use super::super::{CheckerOutcome, Counts};
use crate::Text;
use crate::xqar::{Checker, Status};

/// Returns text such as `23 checkers: 20 completed, 2 skipped, 1 error; 5 issues.`
pub(super) fn of_bundle(checkers: &[Checker]) -> String {
    let count = |status| checkers.iter().filter(|c| c.status == Some(status)).count();
    let issues: usize = checkers.iter().map(|checker| checker.issues.len()).sum();
    format!(
        "{}: {} completed, {} skipped, {} error; {}.",
        number(checkers.len(), "checker"),
        count(Status::Completed),
        count(Status::Skipped),
        count(Status::Error),
        number(issues, "issue"),
    )
}

/// Returns text such as `Skipped: the file is OpenDRIVE 1.4. 0 issues.`
pub(super) fn of_checker(outcome: &CheckerOutcome, removed: Counts) -> Text {
    let status = outcome.status();
    // Most of the hundreds of checkers per file have this summary, so its text is shared.
    if status == Status::Completed && outcome.issues.is_empty() && removed.total() == 0 {
        static NONE: LazyLock<Text> = LazyLock::new(|| Text::from("0 issues."));
        return NONE.clone();
    }
    let word = match status {
        Status::Completed => "Completed",
        Status::Skipped => "Skipped",
        Status::Error => "Error",
    };
    let reason = outcome.reason().trim();
    let issues = number(outcome.issues.len(), "issue");
    let mut summary = String::with_capacity(word.len() + reason.len() + issues.len() + 8);
    if !(reason.is_empty() && status == Status::Completed) {
        summary.push_str(word);
        if !reason.is_empty() {
            summary.push_str(": ");
            summary.push_str(reason);
        }
        let ends = !reason.is_empty() && reason.ends_with(['.', '?', '!']);
        summary.push_str(if ends { " " } else { ". " });
    }
    summary.push_str(&issues);
    if removed.total() > 0 {
        summary.push_str(&format!(
            ", {} more removed by the configuration",
            removed.total()
        ));
    }
    summary.push('.');
    summary.into()
}

/// Returns text such as `1 issue` or `2 issues`.
fn number(count: usize, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}

impl fmt::Display for Counts {
    /// Writes text such as `2 errors and 1 warning`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |count: u64, word: &str| match count {
            0 => None,
            1 => Some(format!("1 {word}")),
            n => Some(format!("{n} {word}s")),
        };
        let parts = [
            plural(self.errors, "error"),
            plural(self.warnings, "warning"),
            plural(self.information, "information issue"),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        match &parts[..] {
            [] => f.write_str("no issues"),
            [one] => f.write_str(one),
            [front @ .., last] => write!(f, "{} and {last}", front.join(", ")),
        }
    }
}
