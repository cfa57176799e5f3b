//! Which checkers run, and with which parameters.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_formats::config::Config;
use qcbus_formats::pool::Asked;

use crate::bundle::groups;
use crate::resource::Resource;
use crate::seen::Seen;
use crate::{Bundle, Checker, ResourceValue, UserFiles, Values};

/// A bundle's checkers, prepared for checking: which are demanded, and with which values.
pub struct Plan {
    pub(crate) bundle: &'static Bundle,
    pub(crate) checkers: Vec<Checker>,
    /// By model; the order of checking.
    pub(crate) groups: Vec<Vec<usize>>,
    /// Groups that may be checked side by side, because none of them rests on another of these.
    pub(crate) batches: Vec<Vec<usize>>,
    /// In the order of `checkers`.
    pub(crate) entries: Vec<Entry>,
    /// What was made of the user's files.
    pub(crate) resources: Vec<ResourceValue>,
    /// What the files looked like that parameters name.
    seen: Vec<Seen>,
    /// The configuration that it follows.
    pub(crate) config: Option<Arc<Config>>,
}

/// How one checker takes part.
pub(crate) struct Entry {
    /// Its result is asked for.
    pub demanded: bool,
    /// It runs: demanded, or a precondition of one that runs.
    pub runs: bool,
    /// Its parameters, or why they cannot be used.
    pub values: Result<Values, String>,
    /// Indices of its preconditions; the error names one that does not exist.
    pub after: Result<Vec<usize>, String>,
}

impl Plan {
    /// Demands the checkers that `demanded` names, with the parameters that `configured` gives:
    /// both are asked with the checker's id, the latter also with the parameter's name.
    pub fn new(
        bundle: &'static Bundle,
        demanded: impl Fn(&Checker) -> bool,
        configured: impl Fn(&Checker, &str) -> Option<String>,
    ) -> Plan {
        let checkers = bundle.checkers();
        let entries = checkers.iter().map(|checker| Entry {
            demanded: demanded(checker),
            runs: demanded(checker),
            values: Values::resolve(checker.facts.params, |name| configured(checker, name))
                .map_err(|error| error.to_string()),
            after: preconditions(&checkers, checker),
        });
        let mut entries: Vec<Entry> = entries.collect();
        mark_preconditions(&mut entries);
        let groups = groups(&checkers);
        Plan {
            bundle,
            batches: batches(&groups, &entries),
            groups,
            checkers,
            entries,
            resources: Vec::new(),
            seen: Vec::new(),
            config: None,
        }
    }

    /// Says which configuration it follows, for rules that hand it on ([`crate::Subject::config`]).
    #[must_use]
    pub(crate) fn following(mut self, config: &Config) -> Plan {
        self.config = Some(Arc::new(config.clone()));
        self
    }

    /// Every checker that is on by default, with the default parameters.
    pub fn by_default(bundle: &'static Bundle) -> Plan {
        Plan::new(bundle, |checker| checker.facts.default_on, |_, _| None)
    }

    /// Reads the files that parameters name, for the checkers that run; what the user gave on the
    /// command line comes before what a configuration says. A checker whose files are of no use ends
    /// with an error. A resource is read once, as the first checker demands it.
    #[must_use]
    pub fn with_files(mut self, given: Option<&UserFiles>) -> Plan {
        let mut read: Vec<(&'static Resource, Result<(), String>)> = Vec::new();
        for (checker, entry) in self.checkers.iter().zip(&mut self.entries) {
            let (Some(resource), true, Ok(values)) =
                (checker.facts.resource, entry.runs, &mut entry.values)
            else {
                continue;
            };
            if let Some(given) = given.filter(|given| given.of(resource).is_some()) {
                values.set(&resource.param, given.directory());
            }
            let known = read
                .iter()
                .find(|(known, _)| std::ptr::eq(*known, resource));
            let outcome = match known {
                Some((_, outcome)) => outcome.clone(),
                None => {
                    let directory = values.text(&resource.param);
                    let value = value_of(resource, given, directory.trim(), &mut self.seen);
                    value.map(|value| self.resources.extend(value))
                }
            };
            read.push((resource, outcome.clone()));
            if let Err(why) = outcome {
                entry.values = Err(format!("the parameter `{}`: {why}", resource.param.name));
            }
        }
        self
    }

    /// The bundle.
    pub fn bundle(&self) -> &'static Bundle {
        self.bundle
    }

    /// All checkers of the bundle in the order of the result, demanded or not.
    pub fn checkers(&self) -> &[Checker] {
        &self.checkers
    }

    /// Whether a file that a parameter names has changed since it was read.
    pub(crate) fn is_outdated(&self) -> bool {
        self.seen.iter().any(Seen::is_outdated)
    }

    /// Files and directories that parameters name, which were read and are looked at again.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        self.seen
            .iter()
            .map(|seen| seen.path().to_owned())
            .collect()
    }

    /// How many checkers are demanded, and of how many; what is off by default is left out by nobody.
    pub fn asked(&self) -> Asked {
        let all = self.checkers.iter().zip(&self.entries);
        let in_question = all.filter(|(checker, it)| checker.facts.default_on || it.demanded);
        Asked {
            asked: self.entries.iter().filter(|entry| entry.demanded).count(),
            offered: in_question.count(),
        }
    }

    /// Whether the result of the checker with this index is asked for.
    pub fn is_demanded(&self, index: usize) -> bool {
        self.entries.get(index).is_some_and(|entry| entry.demanded)
    }
}

/// What a checker gets: from the command line, else from where its parameter says.
fn value_of(
    resource: &'static Resource,
    given: Option<&UserFiles>,
    directory: &str,
    seen: &mut Vec<Seen>,
) -> Result<Option<ResourceValue>, String> {
    if let Some(value) = given.and_then(|given| given.of(resource)) {
        return Ok(Some(value));
    }
    if directory.is_empty() {
        return Ok(None);
    }
    let path = Path::new(directory);
    // Looked at before it is read: what changes in between is noticed later.
    seen.push(Seen::new(resource, path));
    let read = resource.read(path).map(Some);
    read.map_err(|error| format!("failed to {error}"))
}

/// Groups that follow each other and of which none rests on another, in any direction: that a checker
/// does not look because it comes too early must not depend on how many threads there are.
fn batches(groups: &[Vec<usize>], entries: &[Entry]) -> Vec<Vec<usize>> {
    let rests_on = |group: &[usize], other: &[usize]| {
        let after = group
            .iter()
            .flat_map(|&index| entries[index].after.iter().flatten());
        after.into_iter().any(|before| other.contains(before))
    };
    let mut batches: Vec<Vec<usize>> = Vec::new();
    for (number, group) in groups.iter().enumerate() {
        let is_apart = |batch: &&mut Vec<usize>| {
            let mut others = batch.iter().map(|&it| &groups[it]);
            !others.any(|other| rests_on(group, other) || rests_on(other, group))
        };
        match batches.last_mut().filter(is_apart) {
            Some(batch) => batch.push(number),
            None => batches.push(vec![number]),
        }
    }
    batches
}

fn preconditions(checkers: &[Checker], checker: &Checker) -> Result<Vec<usize>, String> {
    let index_of = |id: &&str| {
        let position = checkers.iter().position(|other| other.id == *id);
        position.ok_or_else(|| format!("its precondition `{id}` does not exist"))
    };
    checker.facts.after.iter().map(index_of).collect()
}

/// What a demanded checker depends on runs too; its findings are reported when they are in the way.
fn mark_preconditions(entries: &mut [Entry]) {
    let mut open: Vec<usize> = (0..entries.len()).filter(|&i| entries[i].runs).collect();
    while let Some(index) = open.pop() {
        let Ok(after) = entries[index].after.clone() else {
            continue;
        };
        for precondition in after {
            if !std::mem::replace(&mut entries[precondition].runs, true) {
                open.push(precondition);
            }
        }
    }
}
