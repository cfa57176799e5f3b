//! Findings of bundles: the only data model for them, from the checker to the result.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::RuleUids;
use crate::Text;
use crate::config::{LEVELS_OF_ASAM, LEVELS_PARAM};
use crate::xqar::{Issue, Metadata, Param, Status};

/// How a checker ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    /// It checked everything.
    Completed,
    /// It does not apply to this version or kind of file. This is a valid answer.
    NotApplicable {
        /// The reason, for a person.
        reason: String,
    },
    /// It could not run, because one of its dependencies found errors or failed, or the file cannot
    /// be read. This is no answer.
    Blocked {
        /// Identifiers of the checkers of its bundle that blocked it; empty when the file itself
        /// was the cause.
        by: Vec<String>,
        /// The reason, for a person.
        reason: String,
    },
    /// It did not run as required: crash, deadline, missing checker, unusable parameter.
    Failed {
        /// The reason, for a person.
        reason: String,
    },
}

impl Ending {
    /// Returns the status for a result.
    pub fn status(&self) -> Status {
        match self {
            Ending::Completed => Status::Completed,
            Ending::NotApplicable { .. } | Ending::Blocked { .. } => Status::Skipped,
            Ending::Failed { .. } => Status::Error,
        }
    }

    /// Returns the reason why it did not complete; empty when it did.
    pub fn reason(&self) -> &str {
        match self {
            Ending::Completed => "",
            Ending::NotApplicable { reason }
            | Ending::Blocked { reason, .. }
            | Ending::Failed { reason } => reason,
        }
    }

    /// Returns the reason for changes.
    pub fn reason_mut(&mut self) -> Option<&mut String> {
        match self {
            Ending::Completed => None,
            Ending::NotApplicable { reason }
            | Ending::Blocked { reason, .. }
            | Ending::Failed { reason } => Some(reason),
        }
    }

    /// Checks whether the checker's answer is missing, so that the file cannot be accepted.
    pub fn is_open(&self) -> bool {
        matches!(self, Ending::Blocked { .. } | Ending::Failed { .. })
    }
}

/// Findings of one bundle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BundleOutcome {
    /// Its name, such as `xodrBundle`.
    pub name: String,
    /// Its short name, such as `xodr`. A configuration may use it instead of the name.
    pub alias: String,
    /// Its version.
    pub version: String,
    /// Date of its build, `YYYY-MM-DD`.
    pub build_date: String,
    /// What it checks.
    pub description: String,
    /// Parameters of the bundle beyond the configured ones.
    pub params: Vec<Param>,
    /// Its checkers in the order of its catalogue: the demanded checkers, and those that blocked
    /// one of them.
    pub checkers: Vec<CheckerOutcome>,
    /// The reason why a required bundle is missing. It never joined, so its checkers are unknown.
    pub absent: Option<String>,
    /// Numbers of demanded and available checkers; `None` when they were not counted.
    pub asked: Option<Asked>,
}

/// States in the results of bundles that their findings have the levels of ASAM.
pub fn state_levels_of_asam(bundles: &mut [BundleOutcome]) {
    for bundle in bundles {
        bundle.params.push(Param {
            name: LEVELS_PARAM.to_owned(),
            value: LEVELS_OF_ASAM.to_owned(),
        });
    }
}

/// Numbers of demanded and available checkers of a bundle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Asked {
    /// Number of demanded checkers.
    pub asked: usize,
    /// Number of checkers in the catalogue, except undemanded ones that are off by default.
    pub offered: usize,
}

/// Findings of one checker.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CheckerOutcome {
    /// Its identifier.
    pub id: Text,
    /// What it checks.
    pub description: Text,
    /// The rules that it checks.
    pub rule_uids: RuleUids,
    /// How it ended. `None` means that the bundle did not report it, which is a failure.
    pub ending: Option<Ending>,
    /// The parameters that it used.
    pub params: Vec<Param>,
    /// Its findings, without ids.
    pub issues: Vec<Issue>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
}

impl CheckerOutcome {
    /// Returns the status of its ending for a result.
    pub fn status(&self) -> Status {
        self.ending.as_ref().map_or(Status::Error, Ending::status)
    }

    /// Returns the reason why it did not complete; empty when it did or when no ending was
    /// reported.
    pub fn reason(&self) -> &str {
        self.ending.as_ref().map_or("", Ending::reason)
    }

    fn blocked_by(&self) -> &[String] {
        match &self.ending {
            Some(Ending::Blocked { by, .. }) => by,
            _ => &[],
        }
    }
}

/// Checks for each outcome whether it is part of the answer. It is if it is demanded, or if it
/// blocks a demanded checker directly or through others.
pub fn in_the_answer(checkers: &[CheckerOutcome], demanded: impl Fn(&str) -> bool) -> Vec<bool> {
    let mut kept: Vec<bool> = checkers.iter().map(|it| demanded(&it.id)).collect();
    loop {
        let answers = checkers.iter().zip(&kept).filter(|(_, kept)| **kept);
        let blocking = answers.flat_map(|(it, _)| it.blocked_by());
        let in_the_way: BTreeSet<&str> = blocking.map(String::as_str).collect();
        let mut more = false;
        for (checker, kept) in checkers.iter().zip(&mut kept) {
            let joins = !*kept && in_the_way.contains(&*checker.id);
            *kept |= joins;
            more |= joins;
        }
        if !more {
            return kept;
        }
    }
}
