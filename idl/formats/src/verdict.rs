//! The verdict on a file, and the single rule to derive it from a result.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::pool::{BLOCKED, OWN_BUNDLE};
use crate::xqar::{Checker, CheckerBundle, Level, Results, Status};

/// Decision on how a file may be used. `Undetermined` is never `Accepted`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Every demanded checker ran or did not apply, and at least one ran. No issue kept is an
    /// error.
    Accepted,
    /// At least one of the issues kept is an error.
    Rejected,
    /// No error was found, but a demanded checker crashed, hung, was missing or was blocked, or
    /// none of them applied.
    Undetermined,
}

impl Verdict {
    /// Returns the verdict for a result. It is rejected if there is an error. It is undetermined if
    /// a checker's answer is missing or no checker examined the file. Otherwise it is accepted. For
    /// a checker without status, as other tools write it, only its issues count.
    pub fn of(results: &Results) -> Verdict {
        Verdict::of_those(results, |_| true)
    }

    /// Returns the verdict for a result without one of its checkers.
    pub fn without(results: &Results, checker: &str) -> Verdict {
        Verdict::of_those(results, |it| &*it.id != checker)
    }

    fn of_those(results: &Results, counts: impl Fn(&Checker) -> bool) -> Verdict {
        let checkers = results.bundles.iter().flat_map(|bundle| &bundle.checkers);
        let mut checkers = checkers.filter(|it| counts(it));
        let mut issues = checkers.clone().flat_map(|checker| &checker.issues);
        if issues.any(|issue| issue.level == Level::Error) {
            Verdict::Rejected
        } else if checkers.any(is_open) || !results.bundles.iter().any(has_looked) {
            Verdict::Undetermined
        } else {
            Verdict::Accepted
        }
    }

    /// Returns the contribution of one bundle to the verdict of others: rejected by an error,
    /// undetermined by a missing answer. Otherwise it adds accepted, even if it examined nothing.
    pub fn added_by(bundle: &CheckerBundle) -> Verdict {
        let mut issues = bundle.checkers.iter().flat_map(|checker| &checker.issues);
        if issues.any(|issue| issue.level == Level::Error) {
            Verdict::Rejected
        } else if bundle.checkers.iter().any(is_open) {
            Verdict::Undetermined
        } else {
            Verdict::Accepted
        }
    }

    /// Combines two verdicts; the worse one wins.
    #[must_use]
    pub fn and(self, other: Verdict) -> Verdict {
        match (self, other) {
            (Verdict::Rejected, _) | (_, Verdict::Rejected) => Verdict::Rejected,
            (Verdict::Undetermined, _) | (_, Verdict::Undetermined) => Verdict::Undetermined,
            (Verdict::Accepted, Verdict::Accepted) => Verdict::Accepted,
        }
    }

    /// Returns the word for reports and verdict files.
    pub fn as_str(self) -> &'static str {
        match self {
            Verdict::Accepted => "accepted",
            Verdict::Rejected => "rejected",
            Verdict::Undetermined => "undetermined",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// Checks whether a checker's answer is missing. ASAM's format calls a blocked checker `skipped`,
/// like one that does not apply; only its metadata distinguish them.
fn is_open(checker: &Checker) -> bool {
    checker.status == Some(Status::Error) || checker.metadata.iter().any(|fact| fact.key == BLOCKED)
}

/// Checks whether one of the bundle's checkers examined the file. Remarks of qcbus do not count.
pub(crate) fn has_looked(bundle: &CheckerBundle) -> bool {
    let looked = |checker: &Checker| matches!(checker.status, None | Some(Status::Completed));
    bundle.name != OWN_BUNDLE && bundle.checkers.iter().any(looked)
}

#[cfg(test)]
mod tests {
    use crate::xqar::{Issue, Metadata};

    use super::*;

    fn results(status: Option<Status>, level: Option<Level>, blocked: bool) -> Results {
        let issue = |level| Issue {
            id: 0,
            description: String::new(),
            level,
            rule_uid: String::new(),
            locations: Vec::new(),
            domain_info: Vec::new(),
        };
        let fact = Metadata {
            key: BLOCKED.to_owned(),
            ..Metadata::default()
        };
        let checker = Checker {
            status,
            issues: level.map(issue).into_iter().collect(),
            metadata: blocked.then_some(fact).into_iter().collect(),
            ..Checker::default()
        };
        let bundle = CheckerBundle {
            checkers: vec![checker],
            ..CheckerBundle::default()
        };
        Results {
            version: "1.0.0".into(),
            bundles: vec![bundle],
        }
    }

    #[test]
    fn verdict_follows_from_issues_and_statuses() {
        let of = |status, level| Verdict::of(&results(status, level, false));
        assert_eq!(of(Some(Status::Completed), None), Verdict::Accepted);
        assert_eq!(of(None, None), Verdict::Accepted);
        assert_eq!(of(Some(Status::Error), None), Verdict::Undetermined);
        assert_eq!(of(None, Some(Level::Warning)), Verdict::Accepted);
        assert_eq!(
            of(Some(Status::Error), Some(Level::Error)),
            Verdict::Rejected
        );
    }

    #[test]
    fn bundle_adds_only_its_errors_and_failures_to_verdict() {
        let adds = |status, level, blocked| {
            let results = results(status, level, blocked);
            Verdict::added_by(&results.bundles[0])
        };
        let done = Some(Status::Completed);
        assert_eq!(adds(done, Some(Level::Error), false), Verdict::Rejected);
        assert_eq!(adds(done, Some(Level::Warning), false), Verdict::Accepted);
        assert_eq!(
            adds(Some(Status::Error), None, false),
            Verdict::Undetermined
        );
        assert_eq!(
            adds(Some(Status::Skipped), None, true),
            Verdict::Undetermined
        );
        assert_eq!(adds(Some(Status::Skipped), None, false), Verdict::Accepted);
        let all = [Verdict::Accepted, Verdict::Undetermined, Verdict::Rejected];
        for (at, one) in all.into_iter().enumerate() {
            for (other_at, other) in all.into_iter().enumerate() {
                assert_eq!(one.and(other), all[at.max(other_at)]);
            }
        }
    }

    #[test]
    fn file_without_completed_check_is_undetermined() {
        let skipped = results(Some(Status::Skipped), None, false);
        assert_eq!(Verdict::of(&skipped), Verdict::Undetermined);
        assert_eq!(Verdict::of(&Results::default()), Verdict::Undetermined);
        let mut own = results(Some(Status::Completed), None, false);
        own.bundles[0].name = OWN_BUNDLE.to_owned();
        assert_eq!(Verdict::of(&own), Verdict::Undetermined);
        own.bundles.extend(skipped.bundles);
        own.bundles
            .extend(results(Some(Status::Completed), None, false).bundles);
        assert_eq!(
            Verdict::of(&own),
            Verdict::Accepted,
            "one bundle has checked the file"
        );
    }

    #[test]
    fn blocked_checker_leaves_verdict_undetermined() {
        let blocked = results(Some(Status::Skipped), None, true);
        assert_eq!(Verdict::of(&blocked), Verdict::Undetermined);
    }
}
