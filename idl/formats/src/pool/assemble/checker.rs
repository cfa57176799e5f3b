//! Processing of a single checker.

use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::Arc;

use super::super::{BLOCKED, CheckerOutcome, Counts, Ending, is_rule_uid};
use super::summary;
use crate::Text;
use crate::config::Selected;
use crate::xqar::{Checker, Issue, Metadata, Param};

/// The rule of issues without a valid rule UID from their bundle.
pub(super) const UNNAMED: &str = "qcbus.dev:qcbus:1.0.0:pooling.rule_named";

/// Metadata key for a rule UID that no reader would accept.
const UNREADABLE: &str = "qcbus.unreadableRuleUID";

/// Sets the ending of a checker. A missing or contradictory ending counts as a failure.
pub(super) fn settle(outcome: &mut CheckerOutcome) {
    let wrong = match &outcome.ending {
        None => "the bundle did not report how the checker ended",
        Some(Ending::NotApplicable { .. } | Ending::Blocked { .. })
            if !outcome.issues.is_empty() =>
        {
            "the bundle reported that the checker was skipped, but also reported issues"
        }
        Some(_) => return,
    };
    let reason = match outcome.reason() {
        "" => wrong.to_owned(),
        reason => format!("{wrong} ({reason})"),
    };
    outcome.ending = Some(Ending::Failed { reason });
}

/// Gives issues their configured level, keeps the requested ones and counts the removed ones.
pub(super) fn select(issues: &mut Vec<Issue>, selected: Selected) -> Counts {
    let mut removed = Counts::default();
    issues.retain_mut(|issue| {
        issue.level = selected.relevel.unwrap_or(issue.level);
        let wanted = selected.levels.contains(issue.level);
        if !wanted {
            removed.add(issue.level);
        }
        wanted
    });
    removed
}

/// Returns the checker as written to the result.
pub(super) fn finish(
    mut outcome: CheckerOutcome,
    configured: Vec<Param>,
    removed: Counts,
) -> Checker {
    let summary = summary::of_checker(&outcome, removed);
    let status = Some(outcome.status());
    outcome
        .metadata
        .extend(outcome.ending.as_ref().and_then(blocked));
    let addressed_rules = rules(&mut outcome);
    let mut params = outcome.params;
    for param in configured {
        if !params.iter().any(|used| used.name == param.name) {
            params.push(param);
        }
    }
    Checker {
        id: outcome.id,
        description: outcome.description,
        summary,
        status,
        params,
        issues: outcome.issues,
        addressed_rules,
        metadata: outcome.metadata,
    }
}

/// Returns the rules of a checker, including those that its issues name. UIDs that would make
/// readers refuse the whole file are moved to a harmless place.
fn rules(outcome: &mut CheckerOutcome) -> Arc<[Text]> {
    let given = std::mem::take(&mut outcome.rule_uids);
    let mut rules = Cow::Borrowed(&given[..]);
    if !given.can_be_written() {
        let (good, bad): (Vec<&Text>, _) = given.iter().partition(|uid| is_rule_uid(uid));
        let mut seen = HashSet::new();
        let once = good.into_iter().filter(|uid| seen.insert((*uid).clone()));
        let mut kept: Vec<Text> = once.cloned().collect();
        for uid in bad {
            match with_underscores(uid) {
                Some(spelt) if seen.insert(spelt.as_str().into()) => kept.push(spelt.into()),
                Some(_) => {}
                None => outcome.metadata.push(unreadable(uid)),
            }
        }
        rules = Cow::Owned(kept);
    }
    for issue in &mut outcome.issues {
        if let Some(spelt) = with_underscores(&issue.rule_uid) {
            issue.rule_uid = spelt;
        }
        if !is_rule_uid(&issue.rule_uid) {
            let given = std::mem::replace(&mut issue.rule_uid, UNNAMED.to_owned());
            if !given.is_empty() {
                issue.description = format!("{} (reported rule: `{given}`)", issue.description);
            }
        }
        if !rules.iter().any(|uid| **uid == *issue.rule_uid) {
            rules.to_mut().push(issue.rule_uid.as_str().into());
        }
    }
    match rules {
        Cow::Borrowed(_) => given.shared().clone(),
        Cow::Owned(rules) => rules.into(),
    }
}

/// Returns a rule UID with `_` instead of `-`, if that makes it one that readers accept. ASAM's
/// list of rules has `road.geometry.s-value_sum`, but the pattern of ASAM's format forbids `-`.
fn with_underscores(uid: &str) -> Option<String> {
    if is_rule_uid(uid) || !uid.contains('-') {
        return None;
    }
    let spelt = uid.replace('-', "_");
    is_rule_uid(&spelt).then_some(spelt)
}

/// Returns the metadata that distinguish a blocked checker from one that does not apply.
fn blocked(ending: &Ending) -> Option<Metadata> {
    let Ending::Blocked { by, .. } = ending else {
        return None;
    };
    let value = match by.as_slice() {
        [] => String::from("the file"),
        by => by.join(" "),
    };
    Some(Metadata {
        key: BLOCKED.to_owned(),
        value,
        description: String::from("The cause that blocked the checker; its answer is missing."),
    })
}

fn unreadable(uid: &Text) -> Metadata {
    Metadata {
        key: UNREADABLE.to_owned(),
        value: String::from(&**uid),
        description: String::from("The bundle reported this rule UID, which is invalid."),
    }
}

/// Adds a second outcome of the same checker to the first.
pub(super) fn merge(first: &mut CheckerOutcome, second: CheckerOutcome) {
    let worst = |ending: &Option<Ending>| match ending {
        Some(Ending::NotApplicable { .. }) => 0,
        Some(Ending::Completed) => 1,
        Some(Ending::Blocked { .. }) => 2,
        None => 3,
        Some(Ending::Failed { .. }) => 4,
    };
    if worst(&second.ending) > worst(&first.ending) {
        first.ending = second.ending;
    }
    let rules = [&*first.rule_uids, &*second.rule_uids].concat();
    first.rule_uids = rules.into_iter().collect();
    first.issues.extend(second.issues);
    first.metadata.extend(second.metadata);
}
