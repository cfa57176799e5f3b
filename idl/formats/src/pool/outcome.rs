//! What bundles found: the one form of it, from the checker that says it to the result.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::RuleUids;
use crate::Text;
use crate::xqar::{Issue, Metadata, Param, Status};

/// How a checker ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    /// It looked at all there is.
    Completed,
    /// It has nothing to say about such a file: version or kind. That is an answer.
    NotApplicable {
        /// Why, for a person.
        reason: String,
    },
    /// It could not look: something that it rests on found errors or failed, or the file could not
    /// be read. That is no answer.
    Blocked {
        /// Identifiers of the checkers of its bundle that it rests on and that stopped it; none when
        /// it was the file itself.
        by: Vec<String>,
        /// Why, for a person.
        reason: String,
    },
    /// It should have looked and did not: crash, deadline, absent, a parameter of no use.
    Failed {
        /// Why, for a person.
        reason: String,
    },
}

impl Ending {
    /// What a result calls it.
    pub fn status(&self) -> Status {
        match self {
            Ending::Completed => Status::Completed,
            Ending::NotApplicable { .. } | Ending::Blocked { .. } => Status::Skipped,
            Ending::Failed { .. } => Status::Error,
        }
    }

    /// Why it did not complete; empty when it did.
    pub fn reason(&self) -> &str {
        match self {
            Ending::Completed => "",
            Ending::NotApplicable { reason }
            | Ending::Blocked { reason, .. }
            | Ending::Failed { reason } => reason,
        }
    }

    /// The same, to be changed.
    pub fn reason_mut(&mut self) -> Option<&mut String> {
        match self {
            Ending::Completed => None,
            Ending::NotApplicable { reason }
            | Ending::Blocked { reason, .. }
            | Ending::Failed { reason } => Some(reason),
        }
    }

    /// Whether the checker owes an answer, so that nothing may be accepted.
    pub fn is_open(&self) -> bool {
        matches!(self, Ending::Blocked { .. } | Ending::Failed { .. })
    }
}

/// What one bundle found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BundleOutcome {
    /// Its name, such as `xodrBundle`.
    pub name: String,
    /// Its short name, such as `xodr`; a configuration may use it for the name.
    pub alias: String,
    /// Its version.
    pub version: String,
    /// Date of its build, `YYYY-MM-DD`.
    pub build_date: String,
    /// What it checks.
    pub description: String,
    /// Parameters of the bundle beyond the configured ones.
    pub params: Vec<Param>,
    /// Its checkers in the order of its catalogue: those that were demanded, and those besides that
    /// kept one of them from looking.
    pub checkers: Vec<CheckerOutcome>,
    /// Why it was not there: it was demanded and nobody has ever seen it, so nobody knows its checkers.
    pub absent: Option<String>,
    /// How many checkers were demanded of how many that it has; `None`: nobody counted.
    pub asked: Option<Asked>,
}

/// How many checkers of a bundle were asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Asked {
    /// Demanded.
    pub asked: usize,
    /// In the bundle's catalogue, without those that are off by default and that nobody demands.
    pub offered: usize,
}

/// What one checker found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CheckerOutcome {
    /// Its identifier.
    pub id: Text,
    /// What it checks.
    pub description: Text,
    /// The rules that it answers for.
    pub rule_uids: RuleUids,
    /// How it ended; `None`: it never said, which is a failure.
    pub ending: Option<Ending>,
    /// The parameters that it used.
    pub params: Vec<Param>,
    /// Its findings, ids not yet given.
    pub issues: Vec<Issue>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
}

impl CheckerOutcome {
    /// What a result calls its ending.
    pub fn status(&self) -> Status {
        self.ending.as_ref().map_or(Status::Error, Ending::status)
    }

    /// Why it did not complete; empty when it did or never said.
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

/// Whether each of these outcomes is part of the answer: demanded, or in the way of one that is,
/// directly or through others.
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
