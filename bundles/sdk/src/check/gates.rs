//! Gates in front of a checker: parameters, preconditions, version.

use qcbus_formats::pool::Ending;

use super::checker_group::CheckerGroup;
use super::{Outcome, RuleState};
use crate::plan::Entry;
use crate::{Backport, Checker, Values, Version};

/// Admission of a checker, with a note if its rule is not normative for the version.
pub(super) struct Pass<'r> {
    pub values: &'r Values,
    pub not_normative: Option<String>,
}

impl<'r> CheckerGroup<'r> {
    /// Checks parameters, preconditions and version, in this order.
    pub(super) fn gate(&self, index: usize) -> Result<Pass<'r>, Outcome> {
        let plan = self.work.plan;
        let (checker, entry) = (&plan.checkers[index], &plan.entries[index]);
        let fails = |reason: &String| Outcome::failed(reason.clone());
        let values = entry.values.as_ref().map_err(fails)?;
        let with_params = |mut outcome: Outcome| {
            outcome.params = values.listed();
            outcome
        };
        self.preconditions(entry).map_err(with_params)?;
        let not_normative = self.version_gate(checker).map_err(with_params)?;
        Ok(Pass {
            values,
            not_normative,
        })
    }

    /// Checks whether every precondition of the checker has run and found no error. If a
    /// precondition does not apply, the checker does not apply either. Any other cause blocks it.
    fn preconditions(&self, entry: &Entry) -> Result<(), Outcome> {
        let fails = |reason: &String| Outcome::failed(reason.clone());
        let after = entry.after.as_ref().map_err(fails)?;
        let mut stopped: Option<String> = None;
        let mut by = Vec::new();
        for &index in after {
            let rule_state = self.standings[index].unwrap_or(RuleState::Waits);
            let Some(what) = rule_state.in_the_way() else {
                continue;
            };
            let id = &self.work.plan.checkers[index].id;
            stopped.get_or_insert_with(|| format!("`{id}` {what}"));
            if rule_state.is_stop() {
                by.push(id.clone());
            }
        }
        let Some(reason) = stopped else {
            return Ok(());
        };
        Err(Outcome::without_run(if by.is_empty() {
            Ending::NotApplicable { reason }
        } else {
            Ending::Blocked { by, reason }
        }))
    }

    /// Checks whether the checker applies to the document's version. Returns the note of a
    /// backport.
    fn version_gate(&self, checker: &Checker) -> Result<Option<String>, Outcome> {
        let fails = |reason: &String| Outcome::failed(reason.clone());
        let skips = |reason: String| Outcome::without_run(Ending::NotApplicable { reason });
        let range = checker.range.as_ref().map_err(fails)?;
        if range.is_everything() {
            return Ok(None);
        }
        let standard = self.work.plan.bundle.standard;
        let Some(version) = self.work.subject.version() else {
            let reason =
                format!("the rule applies to {standard} {range}; the file states no valid version");
            // The document lacks the version, so applicability is unknown.
            return Err(Outcome::without_run(Ending::Blocked {
                by: Vec::new(),
                reason,
            }));
        };
        let backported = range.is_before(version) && reaches_back(checker.facts.backport, version)?;
        let separate = checker.facts.backport.is_separate();
        let alike = matches!(checker.facts.backport, Backport::Alike { .. });
        match (checker.is_backport, range.contains(version), backported) {
            (false, true, _) => Ok(None),
            (true, _, true) if alike => Ok(None),
            (true, _, true) => Ok(Some(note(standard, version, range))),
            (false, _, true) if !separate => Ok(Some(note(standard, version, range))),
            (true, true, _) => Err(skips(format!(
                "the rule itself applies to {standard} {version}"
            ))),
            _ => Err(skips(format!(
                "the rule applies to {standard} {range}; the file has version {version}"
            ))),
        }
    }
}

fn note(standard: &str, version: Version, range: &crate::VersionRange) -> String {
    format!(" ({standard} {version} does not demand this: the rule applies to {range})")
}

fn reaches_back(backport: Backport, version: Version) -> Result<bool, Outcome> {
    match backport {
        Backport::None => Ok(false),
        Backport::Lower { since: "" }
        | Backport::Separate { since: "" }
        | Backport::Alike { since: "" } => Ok(true),
        Backport::Lower { since } | Backport::Separate { since } | Backport::Alike { since } => {
            let wrong = |error: crate::VersionError| Outcome::failed(error.to_string());
            Ok(since.parse::<Version>().map_err(wrong)? <= version)
        }
    }
}
