//! Remarks of qcbus itself: the bundle `qcbus`.

use super::{CheckerOutcome, Counts, Ending, OWN_BUNDLE, Pooled, Remark};
use crate::config::{Choice, Config, Levels};
use crate::xqar::{Issue, Level};

/// Rule: issues that the configuration excludes are removed, and the removal is reported.
pub(super) const FILTERED: &str = "qcbus.dev:qcbus:1.0.0:pooling.filtered";
/// Rule: checkers left out on the command line are reported.
const CHOSEN: &str = "qcbus.dev:qcbus:1.0.0:pooling.chosen";
/// Rule: `minLevel` and `maxLevel` are in the current order.
pub(super) const LEVEL_ORDER: &str = "qcbus.dev:qcbus:1.0.0:config.level_order";

/// Reason why issues were removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Why {
    Bundle,
    Checker,
    Levels(Levels),
}

/// Issues of one checker that were removed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Removal {
    pub bundle: String,
    pub checker: String,
    pub counts: Counts,
    pub why: Why,
}

impl Removal {
    pub fn to_remark(&self) -> Remark {
        let Removal {
            bundle,
            checker,
            counts,
            why,
        } = self;
        let why = match why {
            Why::Bundle => String::from("the configuration does not name the bundle"),
            Why::Checker => String::from("the configuration names other checkers of the bundle"),
            Why::Levels(levels) if levels.worst() == levels.mildest() => {
                format!(
                    "the configuration keeps issues of level {} only",
                    levels.worst().as_str()
                )
            }
            Why::Levels(levels) => format!(
                "the configuration keeps issues of the levels {} to {}",
                levels.worst().as_str(),
                levels.mildest().as_str()
            ),
        };
        let were = if counts.total() == 1 { "was" } else { "were" };
        let text = format!(
            "{counts} found by checker `{checker}` of bundle `{bundle}` {were} removed: {why}"
        );
        Remark {
            checker: String::from("qcbus_filter"),
            description: String::from("Issues that the configuration removes are counted."),
            issue: Some(information(FILTERED, text)),
            open: None,
        }
    }
}

/// Returns the remark that some checkers were left out, for later readers of the result.
pub fn chosen(choice: &Choice) -> Option<Remark> {
    if choice.is_everything() {
        return None;
    }
    let text = format!(
        "not every checker was requested: the check was run with `{choice}`, and the verdict does not cover the \
         checkers left out; checkers that requested ones depend on were run as well"
    );
    Some(Remark {
        checker: String::from(super::CHOICE_CHECKER),
        description: String::from("Reports the checkers that the command line leaves out."),
        issue: Some(information(CHOSEN, text)),
        open: None,
    })
}

/// Returns the remark that a configuration uses the order of levels of 2023.
pub(super) fn level_order(config: &Config) -> Option<Remark> {
    let oddities = config.old_order_oddities();
    let first = oddities.first()?;
    let more = match oddities.len() - 1 {
        0 => String::new(),
        1 => String::from("; this also applies to one more checker"),
        n => format!("; this also applies to {n} more checkers"),
    };
    let text = format!("configuration, row {}, {}{more}", first.row, first.text);
    Some(Remark {
        checker: String::from("qcbus_config"),
        description: String::from("Older notations of a configuration are accepted and reported."),
        issue: Some(information(LEVEL_ORDER, text)),
        open: None,
    })
}

/// Returns the remark that none of the demanded checkers examined the file.
pub(super) fn nobody_looked(pooled: &Pooled) -> Remark {
    let open = match pooled.unfinished.as_slice() {
        [] => String::from("no checker is demanded for this file"),
        [only] => format!(
            "the only demanded checker, `{}`, does not apply to this file",
            only.checker
        ),
        all => format!(
            "none of the {} demanded checkers applies to this file",
            all.len()
        ),
    };
    Remark {
        checker: String::from("qcbus_checkers"),
        description: String::from("At least one demanded checker checks the file."),
        issue: None,
        open: Some(open),
    }
}

fn information(rule: &str, description: String) -> Issue {
    Issue {
        id: 0,
        description,
        level: Level::Information,
        rule_uid: rule.to_owned(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}

/// Converts remarks to the checkers of the bundle `qcbus`, in the order of their first remark.
pub(super) fn to_checkers(remarks: Vec<Remark>) -> Vec<CheckerOutcome> {
    let mut checkers: Vec<(CheckerOutcome, Vec<String>)> = Vec::new();
    for remark in remarks {
        let known = checkers
            .iter()
            .position(|(it, _)| *it.id == *remark.checker);
        let at = known.unwrap_or_else(|| {
            let checker = CheckerOutcome {
                id: remark.checker.into(),
                description: remark.description.into(),
                ..CheckerOutcome::default()
            };
            checkers.push((checker, Vec::new()));
            checkers.len() - 1
        });
        checkers[at].0.issues.extend(remark.issue);
        checkers[at].1.extend(remark.open);
    }
    let ended = |(mut checker, open): (CheckerOutcome, Vec<String>)| {
        checker.ending = Some(ending(open));
        checker
    };
    checkers.into_iter().map(ended).collect()
}

/// Returns the ending of a qcbus checker. An open point is a failure, to be visible in a result.
fn ending(open: Vec<String>) -> Ending {
    let more = open.len().saturating_sub(1);
    let Some(first) = open.into_iter().next() else {
        return Ending::Completed;
    };
    let reason = match more {
        0 => first,
        more => format!("{first} (and {more} more)"),
    };
    Ending::Failed { reason }
}

/// Returns the name for a bundle. A bundle with the reserved name of qcbus gets another one.
pub(super) fn guest_name(name: &str) -> &str {
    if name == OWN_BUNDLE {
        "qcbus (guest)"
    } else {
        name
    }
}
