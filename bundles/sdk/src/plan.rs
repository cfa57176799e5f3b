//! Selection of checkers and their parameters.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_formats::config::Config;
use qcbus_formats::pool::Asked;

use crate::bundle::groups;
use crate::resource::Resource;
use crate::seen::Seen;
use crate::{Bundle, Checker, ResourceValue, UserFiles, Values};

/// A bundle's checkers, prepared for checking: the demanded ones and their values.
pub struct Plan {
    pub(crate) bundle: &'static Bundle,
    pub(crate) checkers: Vec<Checker>,
    /// Checkers by model, in the order of checking.
    pub(crate) groups: Vec<Vec<usize>>,
    /// Groups that may be checked in parallel, because they do not depend on each other.
    pub(crate) batches: Vec<Vec<usize>>,
    /// Entries in the order of `checkers`.
    pub(crate) entries: Vec<Entry>,
    /// Values built from the user's files.
    pub(crate) resources: Vec<ResourceValue>,
    /// Recorded state of the files that parameters name.
    seen: Vec<Seen>,
    /// The configuration of the plan.
    pub(crate) config: Option<Arc<Config>>,
}

/// Role of one checker in a plan.
pub(crate) struct Entry {
    /// Whether its result is demanded.
    pub demanded: bool,
    /// Whether it runs: it is demanded, or a precondition of one that runs.
    pub runs: bool,
    /// Its parameters, or the reason why they cannot be used.
    pub values: Result<Values, String>,
    /// Indices of its preconditions, or an error with one that does not exist.
    pub after: Result<Vec<usize>, String>,
}

impl Plan {
    /// Creates a plan with the checkers that `demanded` selects and the parameters that
    /// `configured` returns. Both closures get the checker, the latter also the parameter's name.
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

    /// Sets the configuration of the plan, for rules that pass it on ([`crate::Subject::config`]).
    #[must_use]
    pub(crate) fn following(mut self, config: &Config) -> Plan {
        self.config = Some(Arc::new(config.clone()));
        self
    }

    /// Creates a plan with every checker that is on by default and the default parameters.
    pub fn by_default(bundle: &'static Bundle) -> Plan {
        Plan::new(bundle, |checker| checker.facts.default_on, |_, _| None)
    }

    /// Reads the files that parameters name, for the checkers that run. Files given on the command
    /// line take precedence over those of a configuration. A checker with unusable files ends with
    /// an error. Each resource is read only once, for the first checker that needs it.
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

    /// Returns the bundle.
    pub fn bundle(&self) -> &'static Bundle {
        self.bundle
    }

    /// Returns all checkers of the bundle in the order of the result, demanded or not.
    pub fn checkers(&self) -> &[Checker] {
        &self.checkers
    }

    /// Returns the indices of all checkers in the order of checking.
    pub fn order(&self) -> impl Iterator<Item = usize> {
        self.groups.iter().flatten().copied()
    }

    /// Returns the indices of the preconditions of a checker.
    ///
    /// # Errors
    /// A text that names a precondition that does not exist.
    pub fn preconditions(&self, index: usize) -> Result<&[usize], &str> {
        match self.entries.get(index).map(|entry| &entry.after) {
            Some(Err(error)) => Err(error),
            Some(Ok(after)) => Ok(after),
            None => Ok(&[]),
        }
    }

    /// Checks whether a file that a parameter names has changed since it was read.
    pub(crate) fn is_outdated(&self) -> bool {
        self.seen.iter().any(Seen::is_outdated)
    }

    /// Returns the files and directories named by parameters. They were read and are checked for
    /// changes.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        self.seen
            .iter()
            .map(|seen| seen.path().to_owned())
            .collect()
    }

    /// Returns the number of demanded checkers and of offered ones. A checker that is off by
    /// default counts only if it is demanded.
    pub fn asked(&self) -> Asked {
        let all = self.checkers.iter().zip(&self.entries);
        let in_question = all.filter(|(checker, it)| checker.facts.default_on || it.demanded);
        Asked {
            asked: self.entries.iter().filter(|entry| entry.demanded).count(),
            offered: in_question.count(),
        }
    }

    /// Checks whether the result of the checker with this index is demanded.
    pub fn is_demanded(&self, index: usize) -> bool {
        self.entries.get(index).is_some_and(|entry| entry.demanded)
    }
}

/// Returns the value of a resource: from the command line, else from the path in its parameter.
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
    // The state is recorded before reading, so that a change in between is noticed later.
    seen.push(Seen::new(resource, path));
    let read = resource.read(path).map(Some);
    read.map_err(|error| format!("failed to {error}"))
}

/// Forms batches of consecutive groups that do not depend on each other in any direction. A checker
/// that runs before its precondition is blocked. This must not depend on the number of threads.
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

/// Marks the preconditions of demanded checkers to run, too. Their findings are reported if they
/// block a demanded checker.
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
