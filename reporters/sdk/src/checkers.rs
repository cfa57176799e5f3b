//! State of the checkers in a result, apart from their findings.

use qcbus_formats::pool::{BLOCKED, NOT_LISTED};
use qcbus_formats::xqar::{Checker, CheckerBundle, Status};
use qcbus_messages::ResultMessage;

use crate::one_line;

/// Returns the checkers of a result with their bundles, in the order of the result.
pub fn checkers(result: &ResultMessage) -> impl Iterator<Item = (&CheckerBundle, &Checker)> {
    let bundles = result.results.bundles.iter();
    bundles.flat_map(|bundle| bundle.checkers.iter().map(move |checker| (bundle, checker)))
}

/// Checks whether a checker was blocked: it depends on other checkers that found errors or failed.
pub fn is_blocked(checker: &Checker) -> bool {
    checker.metadata.iter().any(|fact| fact.key == BLOCKED)
}

/// Checks whether a checker was skipped as inapplicable to the file. That is an answer.
pub fn is_inapplicable(checker: &Checker) -> bool {
    checker.status == Some(Status::Skipped) && !is_blocked(checker)
}

/// Returns the number of unlisted findings. Each checker lists a limited number and counts the
/// rest.
pub fn not_listed(result: &ResultMessage) -> u64 {
    let facts = checkers(result).flat_map(|(_, checker)| &checker.metadata);
    let counts = facts.filter(|fact| fact.key == NOT_LISTED);
    counts
        .filter_map(|fact| fact.value.parse::<u64>().ok())
        .fold(0, u64::saturating_add)
}

/// Checks whether a checker gave no answer because it failed or was blocked.
pub fn is_open(checker: &Checker) -> bool {
    checker.status == Some(Status::Error) || is_blocked(checker)
}

/// Returns the reason for a checker's status on one line: its summary without the status, which is
/// shown elsewhere, and without the count appended by pooling and ASAM's framework.
pub fn reason(checker: &Checker) -> String {
    let line = one_line(&checker.summary);
    let bare = ["Skipped: ", "Error: ", "Skipped. ", "Error. "]
        .into_iter()
        .find_map(|status| line.strip_prefix(status))
        .unwrap_or(&line);
    let counts = ["issue(s) are found.", "issues.", "issue."];
    let counted = counts.into_iter().find_map(|it| bare.strip_suffix(it));
    let without_count = counted.and_then(|start| {
        let start = start.strip_suffix(' ')?;
        let rest = start.trim_end_matches(|c: char| c.is_ascii_digit());
        (rest.len() < start.len()).then(|| rest.trim_end())
    });
    match without_count.unwrap_or(bare) {
        "" => "no reason given".to_owned(),
        reason => reason.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_count_is_stripped_from_reason() {
        for (summary, text) in [
            ("Too old. 0 issue(s) are found.", "Too old."),
            ("0 issue(s) are found.", "no reason given"),
            ("Too old.", "Too old."),
            ("Skipped: too old. 0 issues.", "too old."),
            ("Error: it died. 1 issue.", "it died."),
            ("Error: this is an issue.", "this is an issue."),
            ("", "no reason given"),
        ] {
            let checker = Checker {
                status: Some(Status::Error),
                summary: summary.into(),
                ..Checker::default()
            };
            assert_eq!(reason(&checker), text);
        }
    }
}
