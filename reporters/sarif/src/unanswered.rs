//! What keeps a verdict open.

use qcbus_messages::{ResultMessage, Verdict};
use qcbus_reporter_sdk::{fingerprint_of, silences};

use crate::artifact::Paths;
use crate::finding::{plain, whole_file};
use crate::log::{FindingProperties, Fingerprints, Notification, SarifResult, Severity};
use crate::text;

/// The rule under which it is said that checkers gave no answer.
pub const UNANSWERED: &str = "qcbus.dev:qcbus:1.0.0:check.unanswered";

/// What that rule is about.
pub(crate) const ABOUT: &str = "A checker that should have looked at the file gave no answer, so \
    nobody knows what it would have found; findings of it that are gone are not mended.";

/// Why an answer is missing, a sentence for each reason; none when all is answered.
pub(crate) fn reasons(result: &ResultMessage) -> Vec<String> {
    let silences = silences(result).into_iter();
    silences
        .map(|silence| text::name(&silence.to_string()))
        .collect()
}

/// A reason for whoever looks at how the tool ran.
pub(crate) fn notification(result: &ResultMessage, paths: &Paths, reason: &str) -> Notification {
    let (path, verdict) = (&result.display_path, result.verdict);
    Notification {
        level: Severity::Error,
        message: plain(&text::message(&format!("{path} ({verdict}): {reason}"))),
        locations: vec![whole_file(paths.checked())],
    }
}

/// All reasons for whoever looks at findings only.
pub(crate) fn finding(result: &ResultMessage, paths: &Paths, reasons: &[String]) -> SarifResult {
    let said = match result.verdict {
        Verdict::Undetermined => "The file is undetermined, not accepted: ",
        Verdict::Accepted | Verdict::Rejected => "The file was not looked at by all: ",
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
