//! What qcbus itself has to say: the bundle `qcbus`.

use super::{CheckerOutcome, Counts, OWN_BUNDLE, Remark};
use crate::config::{Config, Levels};
use crate::xqar::{Issue, Level, Status};

/// Rule: issues that the configuration does not want are removed, and that is said.
pub(super) const FILTERED: &str = "qcbus.dev:qcbus:1.0.0:pooling.filtered";
/// Rule: `minLevel` and `maxLevel` are in today's order.
pub(super) const LEVEL_ORDER: &str = "qcbus.dev:qcbus:1.0.0:config.level_order";

/// Why issues were removed.
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
            issue: information(FILTERED, text),
        }
    }
}

/// The remark that a configuration uses the order of levels of 2023.
pub(super) fn level_order(config: &Config) -> Option<Remark> {
    let notices = config.old_order_notices();
    let first = notices.first()?;
    let more = match notices.len() - 1 {
        0 => String::new(),
        1 => String::from("; the same holds for one more checker"),
        n => format!("; the same holds for {n} more checkers"),
    };
    let text = format!("configuration, row {}, {}{more}", first.row, first.text);
    Some(Remark {
        checker: String::from("qcbus_config"),
        description: String::from("Older ways to write a configuration are understood and told."),
        issue: information(LEVEL_ORDER, text),
    })
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

/// Remarks as the checkers of the bundle `qcbus`, in the order in which they first speak.
pub(super) fn to_checkers(remarks: Vec<Remark>) -> Vec<CheckerOutcome> {
    let mut checkers: Vec<CheckerOutcome> = Vec::new();
    for Remark {
        checker: id,
        description,
        issue,
    } in remarks
    {
        let at = checkers
            .iter()
            .position(|checker| checker.id == id)
            .unwrap_or_else(|| {
                checkers.push(CheckerOutcome {
                    id,
                    description,
                    status: Some(Status::Completed),
                    ..CheckerOutcome::default()
                });
                checkers.len() - 1
            });
        checkers[at].issues.push(issue);
    }
    checkers
}

/// The name that a guest gets who calls itself like qcbus.
pub(super) fn guest_name(name: &str) -> &str {
    if name == OWN_BUNDLE {
        "qcbus (guest)"
    } else {
        name
    }
}
