//! Checkers whose answer is missing.

use std::collections::BTreeMap;
use std::fmt;

use qcbus_formats::xqar::{Checker, Status};
use qcbus_messages::{ResultMessage, Verdict};

use crate::{checkers, is_blocked, one_line, reason};

/// Maximum number of checkers that are named; the others are counted.
const MOST_NAMES: usize = 5;

/// Reason why part of a file was not checked, and the affected checkers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Silence {
    /// Reason on one line.
    pub reason: String,
    /// `bundle/checker` of each checker without an answer; empty if there was no checker to ask.
    pub names: Vec<String>,
}

/// Returns the missing answers of a result, one entry for each reason, or none if all checkers
/// answered. A dead bundle can leave hundreds of checkers without an answer.
///
/// Checkers that do not apply have answered. So have checkers without a status, as in ASAM's first
/// result format. A checker blocked by findings of others counts only if these are not errors,
/// because an error decides the verdict anyway.
pub fn silences(result: &ResultMessage) -> Vec<Silence> {
    let mut silences = grouped(result, |it| it.status == Some(Status::Error));
    if result.verdict == Verdict::Undetermined {
        let blocked = |it: &Checker| is_blocked(it) && it.status != Some(Status::Error);
        silences.extend(grouped(result, blocked));
        if silences.is_empty() {
            silences.push(Silence {
                reason: "no checker has checked the file".to_owned(),
                names: Vec::new(),
            });
        }
    }
    silences
}

fn grouped(result: &ResultMessage, is_meant: impl Fn(&Checker) -> bool) -> Vec<Silence> {
    let mut groups: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (bundle, checker) in checkers(result).filter(|(_, checker)| is_meant(checker)) {
        let names = groups.entry(reason(checker)).or_default();
        names.push(one_line(&format!("{}/{}", bundle.name, checker.id)));
    }
    let each = groups.into_iter();
    each.map(|(reason, names)| Silence { reason, names })
        .collect()
}

impl fmt::Display for Silence {
    /// Writes for example `3 checkers gave no answer (a/x, a/y, a/z): it died`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.names.len();
        if count == 0 {
            return f.write_str(&self.reason);
        }
        let named: Vec<&str> = self
            .names
            .iter()
            .take(MOST_NAMES)
            .map(String::as_str)
            .collect();
        let plural = if count == 1 { "" } else { "s" };
        write!(
            f,
            "{count} checker{plural} gave no answer ({}",
            named.join(", ")
        )?;
        match count.saturating_sub(MOST_NAMES) {
            0 => write!(f, "): {}", self.reason),
            more => write!(f, ", {more} more): {}", self.reason),
        }
    }
}

#[cfg(test)]
mod tests {
    use qcbus_formats::pool::BLOCKED;
    use qcbus_formats::xqar::{CheckerBundle, Metadata};

    use super::*;
    use crate::responder::samples::result;

    fn checker(id: usize, status: Option<Status>, summary: &str) -> Checker {
        Checker {
            id: format!("c{id}").into(),
            status,
            summary: summary.into(),
            ..Checker::default()
        }
    }

    fn said(verdict: Verdict, checkers: Vec<Checker>) -> Vec<String> {
        let mut result = result(1, "a.xodr");
        result.verdict = verdict;
        result.results.bundles = vec![CheckerBundle {
            name: "b".into(),
            checkers,
            ..CheckerBundle::default()
        }];
        silences(&result).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn checkers_with_same_reason_are_reported_together() {
        let mut all: Vec<Checker> = (0..7)
            .map(|id| checker(id, Some(Status::Error), "Error: it died. 0 issues."))
            .collect();
        all.push(checker(7, Some(Status::Error), ""));
        all.push(checker(8, Some(Status::Completed), ""));
        all.push(checker(9, None, ""));
        assert_eq!(
            said(Verdict::Undetermined, all),
            [
                "7 checkers gave no answer (b/c0, b/c1, b/c2, b/c3, b/c4, 2 more): it died.",
                "1 checker gave no answer (b/c7): no reason given",
            ]
        );
    }

    #[test]
    fn blocked_checkers_are_reported_when_no_error_decides() {
        let mut blocked = checker(0, Some(Status::Skipped), "`c1` failed.");
        blocked.metadata.push(Metadata {
            key: BLOCKED.into(),
            ..Metadata::default()
        });
        let skipped = checker(1, Some(Status::Skipped), "does not apply");
        let both = vec![blocked, skipped];
        assert_eq!(
            said(Verdict::Undetermined, both.clone()),
            ["1 checker gave no answer (b/c0): `c1` failed."]
        );
        assert!(said(Verdict::Rejected, both).is_empty());
        assert!(said(Verdict::Accepted, Vec::new()).is_empty());
        assert_eq!(
            said(Verdict::Undetermined, Vec::new()),
            ["no checker has checked the file"]
        );
    }
}
