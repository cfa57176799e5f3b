//! Section of one checked file.

use std::collections::BTreeMap;

use qcbus_formats::xqar::{Checker, Issue};
use qcbus_messages::{Digest, ResultMessage};

use crate::artifact::Paths;
use crate::finding::{finding, rule_id};
use crate::log::{Artifact, ArtifactProperties, Found, Notification, SarifResult, Severity};
use crate::text;
use crate::unanswered::{self, UNANSWERED};

/// Part of one checked file in a report.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    pub(crate) artifact: Artifact,
    /// Findings, the most severe first, otherwise in the order of the result. They have no indices
    /// and repeat numbers, because these depend on the other sections.
    pub(crate) findings: Vec<SarifResult>,
    pub(crate) notifications: Vec<Notification>,
    pub(crate) rules: BTreeMap<String, RuleNote>,
}

/// Data of a rule in a section; the rule's page has the rest.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct RuleNote {
    /// Id of the rule's checker.
    pub checker: String,
    /// Description of the rule.
    pub about: String,
}

impl Section {
    pub(crate) fn of(result: &ResultMessage) -> Section {
        let paths = Paths::of(result);
        let reasons = unanswered::reasons(result);
        let mut findings = Vec::new();
        let mut rules = BTreeMap::new();
        if !reasons.is_empty() {
            findings.push(unanswered::finding(result, &paths, &reasons));
            rules.insert(UNANSWERED.to_owned(), unanswered_rule());
        }
        for (checker, issue) in issues(result) {
            let id = rule_id(checker, issue);
            rules
                .entry(id)
                .or_insert_with(|| note(result, checker, issue));
            findings.push(finding(&result.display_path, &paths, checker, issue));
        }
        findings.sort_by_key(|finding| finding.level);
        Section {
            artifact: artifact(result, &paths, &findings, reasons.is_empty()),
            findings,
            notifications: reasons
                .iter()
                .map(|reason| unanswered::notification(result, &paths, reason))
                .collect(),
            rules,
        }
    }
}

fn issues(result: &ResultMessage) -> impl Iterator<Item = (&Checker, &Issue)> {
    let bundles = result.results.bundles.iter();
    let checkers = bundles.flat_map(|bundle| &bundle.checkers);
    checkers.flat_map(|checker| checker.issues.iter().map(move |issue| (checker, issue)))
}

fn note(result: &ResultMessage, checker: &Checker, issue: &Issue) -> RuleNote {
    let about = match result.rules.get(&issue.rule_uid) {
        Some(about) => about.as_str(),
        None => &checker.description,
    };
    RuleNote {
        checker: text::name(&checker.id),
        about: text::description(about),
    }
}

fn unanswered_rule() -> RuleNote {
    RuleNote {
        checker: String::new(),
        about: unanswered::ABOUT.to_owned(),
    }
}

fn artifact(
    result: &ResultMessage,
    paths: &Paths,
    findings: &[SarifResult],
    answered: bool,
) -> Artifact {
    let known = (result.digest != Digest::default()).then(|| result.digest.to_string());
    let hashes = known.map(|digest| ("sha-256".to_owned(), digest));
    Artifact {
        location: paths.checked(),
        roles: vec!["analysisTarget".to_owned()],
        hashes: hashes.into_iter().collect(),
        properties: ArtifactProperties {
            verdict: result.verdict.as_str().to_owned(),
            path: result.input.clone(),
            found: Found::of(findings),
            answered,
        },
    }
}

impl Found {
    pub(crate) fn of<'f>(findings: impl IntoIterator<Item = &'f SarifResult>) -> Found {
        let mut found = Found::default();
        for finding in findings {
            match finding.level {
                Severity::Error => found.error += 1,
                Severity::Warning => found.warning += 1,
                Severity::Note => found.note += 1,
            }
        }
        found
    }

    pub(crate) fn plus(self, other: Found) -> Found {
        Found {
            error: self.error.saturating_add(other.error),
            warning: self.warning.saturating_add(other.warning),
            note: self.note.saturating_add(other.note),
        }
    }

    pub(crate) fn minus(self, other: Found) -> Found {
        Found {
            error: self.error.saturating_sub(other.error),
            warning: self.warning.saturating_sub(other.warning),
            note: self.note.saturating_sub(other.note),
        }
    }

    pub(crate) fn total(self) -> u64 {
        let severe = self.error.saturating_add(self.warning);
        severe.saturating_add(self.note)
    }
}
