//! A bundle: rules under one name, and the checkers that follow from them.

use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use qcbus_document::{Document, FileKind};
use qcbus_formats::xqar::Level;
use qcbus_messages::{BUILD_DATE, Catalogue, CheckerInfo, ParamInfo};

use crate::pages::{Page, Template};
use crate::rule::Facts;
use crate::{AnyRule, Backport, Version, VersionRange};

/// A checker bundle: its names, what it takes, and its rules.
pub struct Bundle {
    /// Name in results and configurations, such as `xodrBundle`.
    pub name: &'static str,
    /// Short name, such as `xodr`.
    pub alias: &'static str,
    /// Version of the bundle.
    pub version: &'static str,
    /// What it checks, in a sentence.
    pub description: &'static str,
    /// The standard, as texts name it: `OpenDRIVE`.
    pub standard: &'static str,
    /// Root files that it takes.
    pub kinds: &'static [FileKind],
    /// Published versions of the standard, ascending.
    pub versions: &'static [Version],
    /// What it looks at where the root is a modular scenario.
    pub reads: Reads,
    /// Reads the version that a document names; `None` when it names none.
    pub version_of: fn(&Document<'_>) -> Option<Version>,
    /// The rules in the order of the result. A rule comes after those it depends on.
    pub rules: &'static [&'static dyn AnyRule],
    /// What the short examples of the pages are put into.
    pub templates: &'static [Template],
}

/// Checkers by where the list of their rules lies, and how long it is.
type KnownCheckers = BTreeMap<(usize, usize), Arc<[Checker]>>;

/// What a bundle looks at where the root is a modular scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reads {
    /// The file as it is written.
    Written,
    /// What it is expanded to, where that can be had: the root of the subject is the expanded scenario
    /// then, and what is found in it is shown in the files that it was made of.
    Expanded,
}

/// One checker as results list it. A rule with a separate backport makes two.
#[derive(Clone)]
pub struct Checker {
    /// Identifier.
    pub id: String,
    /// The rule.
    pub rule: &'static dyn AnyRule,
    /// The rule's data.
    pub facts: Facts,
    /// Whether this is the `…_backport` of the rule.
    pub is_backport: bool,
    /// Versions that the rule applies to; the error says why they cannot be read.
    pub range: Result<VersionRange, String>,
    /// What it checks, in a sentence.
    pub description: String,
}

impl Bundle {
    /// The checkers in the order of the result.
    pub fn checkers(&self) -> Vec<Checker> {
        self.known_checkers().to_vec()
    }

    /// They are made out of the pages of all rules, and asked for several times in every start of a bundle: made
    /// once for each list of rules, which stays where it is as long as the process.
    fn known_checkers(&self) -> Arc<[Checker]> {
        static KNOWN: Mutex<KnownCheckers> = Mutex::new(BTreeMap::new());
        let rules = (self.rules.as_ptr().addr(), self.rules.len());
        // What a panic left there is whole: it is put in when it is made.
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(checkers) = known.get(&rules) {
            return checkers.clone();
        }
        let rules_of = self.rules.iter();
        let checkers: Arc<[Checker]> = rules_of.flat_map(|rule| checkers_of(*rule)).collect();
        known.insert(rules, checkers.clone());
        checkers
    }

    /// What the bundle tells the broker.
    pub fn catalogue(&self) -> Catalogue {
        Catalogue {
            alias: self.alias.to_owned(),
            description: self.description.to_owned(),
            build_date: BUILD_DATE.to_owned(),
            kinds: self.kinds.to_vec(),
            checkers: self
                .known_checkers()
                .iter()
                .map(|checker| self.info(checker))
                .collect(),
        }
    }

    /// The rules that go by this checker id, UID, or the last part of either.
    pub fn find(&self, name: &str) -> Vec<&'static dyn AnyRule> {
        let exact = |rule: &&&dyn AnyRule| {
            let facts = rule.facts();
            let plain = name.strip_suffix(BACKPORT_SUFFIX).unwrap_or(name);
            facts.id == plain || facts.uids.contains(&name)
        };
        let found: Vec<_> = self.rules.iter().filter(exact).copied().collect();
        if !found.is_empty() || name.is_empty() {
            return found;
        }
        let loose = |rule: &&&dyn AnyRule| {
            let facts = rule.facts();
            let ends = |whole: &str| {
                whole
                    .strip_suffix(name)
                    .is_some_and(|rest| rest.ends_with(['_', ':', '.']))
            };
            ends(facts.id) || facts.uids.iter().any(|uid| ends(uid))
        };
        self.rules.iter().filter(loose).copied().collect()
    }

    fn info(&self, checker: &Checker) -> CheckerInfo {
        let facts = &checker.facts;
        let params = facts.params.iter().map(|param| ParamInfo {
            name: param.name.to_owned(),
            default: param.default_text(),
            description: param.meaning(),
        });
        CheckerInfo {
            id: checker.id.as_str().into(),
            description: checker.description.as_str().into(),
            rule_uids: facts.uids.iter().copied().collect(),
            kinds: self.kinds.to_vec(),
            default_on: facts.default_on,
            level: checker.level(),
            params: params.collect(),
        }
    }
}

impl Checker {
    /// Severity of its issues when it leaves nothing else to say.
    pub fn level(&self) -> Level {
        let lowered = self.is_backport && !matches!(self.facts.backport, Backport::Alike { .. });
        match (lowered, self.facts.level) {
            (true, Level::Error) => Level::Warning,
            (true, _) => Level::Information,
            (false, level) => level,
        }
    }
}

/// Ends the id of a checker that looks at documents older than its rule.
pub const BACKPORT_SUFFIX: &str = "_backport";

fn checkers_of(rule: &'static dyn AnyRule) -> Vec<Checker> {
    let facts = rule.facts();
    let plain = Checker {
        id: facts.id.to_owned(),
        rule,
        facts,
        is_backport: false,
        range: facts
            .versions
            .parse()
            .map_err(|error: crate::VersionError| error.to_string()),
        description: Page::head(facts.page).summary,
    };
    if !facts.backport.is_separate() {
        return vec![plain];
    }
    let backport = Checker {
        id: format!("{}{BACKPORT_SUFFIX}", facts.id),
        is_backport: true,
        description: format!(
            "In versions before the rule was made: {}",
            plain.description
        ),
        ..plain.clone()
    };
    vec![plain, backport]
}

/// Checkers by model, in the order of each model's first rule: so every model is built once.
pub(crate) fn groups(checkers: &[Checker]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(TypeId, Vec<usize>)> = Vec::new();
    for (index, checker) in checkers.iter().enumerate() {
        let model = checker.rule.model();
        match groups.iter_mut().find(|(known, _)| *known == model) {
            Some((_, members)) => members.push(index),
            None => groups.push((model, vec![index])),
        }
    }
    groups.into_iter().map(|(_, members)| members).collect()
}
