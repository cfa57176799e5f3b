//! Reasons for an undetermined verdict.

use qcbus_messages::{ResultMessage, Verdict};
use qcbus_reporter_sdk::{fingerprint_of, silences};

use crate::artifact::Paths;
use crate::finding::{plain, whole_file};
use crate::log::{FindingProperties, Fingerprints, Notification, SarifResult, Severity};
use crate::text;

/// Rule that reports checkers without an answer.
pub const UNANSWERED: &str = "qcbus.dev:qcbus:1.0.0:check.unanswered";

/// Description of that rule.
pub(crate) const ABOUT: &str = "A checker that should have checked the file gave no answer, so its findings are \
                                unknown; missing findings of this checker are not fixed.";

/// Returns a sentence for each reason of a missing answer; empty if all checkers answered.
pub(crate) fn reasons(result: &ResultMessage) -> Vec<String> {
    let silences = silences(result).into_iter();
    silences
        .map(|silence| text::name(&silence.to_string()))
        .collect()
}

/// Returns a reason as a notification about the run of the tool.
pub(crate) fn notification(result: &ResultMessage, paths: &Paths, reason: &str) -> Notification {
    let (path, verdict) = (&result.display_path, result.verdict);
    Notification {
        level: Severity::Error,
        message: plain(&text::message(&format!("{path} ({verdict}): {reason}"))),
        locations: vec![whole_file(paths.checked())],
    }
}

/// Returns all reasons as one finding, for readers that show only findings.
pub(crate) fn finding(result: &ResultMessage, paths: &Paths, reasons: &[String]) -> SarifResult {
    let said = match result.verdict {
        Verdict::Undetermined => "The file is undetermined, not accepted: ",
        Verdict::Accepted | Verdict::Rejected => "The file was not checked by all checkers: ",
    };
    let hash = fingerprint_of(&[UNANSWERED, &result.display_path]);
    SarifResult {
        rule_id: UNANSWERED.to_owned(),
        rule_index: None,
        level: Severity::Error,
        message: plain(&text::message(&format!("{said}{}", reasons.join("; ")))),
        locations: vec![whole_file(paths.checked())],
        related_locations: Vec::new(),
        partial_fingerprints: Fingerprints {
            primary_location_line_hash: hash,
        },
        properties: FindingProperties::default(),
    }
}
