//! A bundle: rules under one name, and the checkers built from them.

use std::any::TypeId;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use qcbus_document::{Document, FileKind};
use qcbus_formats::xqar::Level;
use qcbus_messages::{BUILD_DATE, Catalogue, CheckerInfo, ParamInfo};

use crate::pages::Head;
use crate::rule::Facts;
use crate::{AnyRule, Backport, Version, VersionRange};

/// A checker bundle: its names, its input files and its rules.
pub struct Bundle {
    /// Name in results and configurations, such as `xodrBundle`.
    pub name: &'static str,
    /// Short name, such as `xodr`.
    pub alias: &'static str,
    /// Version of the bundle.
    pub version: &'static str,
    /// Description of its checks in one sentence.
    pub description: &'static str,
    /// Name of the standard in texts: `OpenDRIVE`.
    pub standard: &'static str,
    /// Kinds of root files that it checks.
    pub kinds: &'static [FileKind],
    /// Published versions of the standard, ascending.
    pub versions: &'static [Version],
    /// Form in which it reads a modular scenario.
    pub reads: Reads,
    /// Reads the version of a document; `None` if it is missing.
    pub version_of: fn(&Document<'_>) -> Option<Version>,
    /// The rules in the order of the result. A rule comes after its preconditions.
    pub rules: &'static [&'static dyn AnyRule],
}

/// Checkers by address and length of their list of rules.
type KnownCheckers = BTreeMap<(usize, usize), Arc<[Checker]>>;

/// Form in which a bundle reads a modular scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reads {
    /// The file as it is written.
    Written,
    /// The expanded scenario, if it can be built. It is then the root of the subject. Findings in
    /// it are shown in its source files.
    Expanded,
}

/// One checker of a result. A rule with a separate backport has two.
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
    /// Versions that the rule applies to, or the reason why they cannot be parsed.
    pub range: Result<VersionRange, String>,
    /// Description of its check in one sentence.
    pub description: String,
}

impl Bundle {
    /// Returns the checkers in the order of the result.
    pub fn checkers(&self) -> Vec<Checker> {
        self.known_checkers().to_vec()
    }

    /// Returns the checkers, built once for each list of rules. They are built from the pages of
    /// all rules, and each start of a bundle needs them several times. The key is the address of
    /// the list, which never changes within a process.
    fn known_checkers(&self) -> Arc<[Checker]> {
        static KNOWN: Mutex<KnownCheckers> = Mutex::new(BTreeMap::new());
        let rules = (self.rules.as_ptr().addr(), self.rules.len());
        // The map is valid after a panic, because only complete entries are inserted.
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(checkers) = known.get(&rules) {
            return checkers.clone();
        }
        let rules_of = self.rules.iter();
        let checkers: Arc<[Checker]> = rules_of.flat_map(|rule| checkers_of(*rule)).collect();
        known.insert(rules, checkers.clone());
        checkers
    }

    /// Returns the catalogue that the bundle sends to the broker.
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

    /// Returns the rules with this checker id, UID, or last part of either.
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
    /// Returns the level of its issues, unless an issue sets another one.
    pub fn level(&self) -> Level {
        let lowered = self.is_backport && !matches!(self.facts.backport, Backport::Alike { .. });
        match (lowered, self.facts.level) {
            (true, Level::Error) => Level::Warning,
            (true, _) => Level::Information,
            (false, level) => level,
        }
    }
}

/// Suffix of the id of a checker for documents older than its rule.
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
        description: Head::of(facts.page).summary,
    };
    if !facts.backport.is_separate() {
        return vec![plain];
    }
    let backport = Checker {
        id: format!("{}{BACKPORT_SUFFIX}", facts.id),
        is_backport: true,
        ..plain.clone()
    };
    vec![plain, backport]
}

/// Groups checkers by model, in the order of each model's first rule, so that every model is built
/// once.
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
