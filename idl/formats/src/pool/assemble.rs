//! The steps of pooling, in order.

mod checker;
mod same_fault;
mod summary;

use super::places::Completer;
use super::remarks::{self, Removal, Why};
use super::{
    Asked, BundleOutcome, CheckerOutcome, Counts, Ending, OWN_BUNDLE, PoolInput, Pooled, Remark,
    Resolver, Scope, Unfinished, absent, in_the_answer,
};
use crate::Text;
use crate::config::{BundleConfig, Config, INPUT_PARAMS, Selection, same_bundle};
use crate::verdict;
use crate::xqar::{Checker, CheckerBundle, FORMAT_VERSION, Level, Param};

pub(super) fn pool(input: PoolInput<'_>, resolver: &mut dyn Resolver) -> Pooled {
    let PoolInput {
        input_file,
        config,
        bundles,
        remarks,
        scope,
        separate,
        version,
        build_date,
    } = input;
    let mut pool = Pool {
        input_file,
        config,
        places: Completer::new(resolver),
        separate,
        removals: Vec::new(),
        pooled: Pooled::default(),
    };
    pool.pooled.results.version = FORMAT_VERSION.to_owned();
    for (entry, outcome) in in_order(config, with_own_names(bundles), scope) {
        pool.add(entry, outcome);
    }
    let own = BundleOutcome {
        name: OWN_BUNDLE.to_owned(),
        version: version.to_owned(),
        build_date: build_date.to_owned(),
        description: String::from("Remarks of qcbus itself about this check."),
        ..BundleOutcome::default()
    };
    let nobody = pool.nobody_looked().filter(|_| scope == Scope::Whole);
    let silent = remarks.iter().all(|remark| remark.open.is_none());
    pool.add_own(
        own,
        remarks
            .into_iter()
            .chain(nobody.filter(|_| silent))
            .collect(),
    );
    pool.finish()
}

/// Numbers bundles of the same name to distinguish them, as ASAM's pooling does.
fn with_own_names(mut bundles: Vec<BundleOutcome>) -> Vec<(BundleOutcome, String)> {
    let mut taken: Vec<String> = vec![OWN_BUNDLE.to_owned()];
    let mut named = Vec::with_capacity(bundles.len());
    for outcome in bundles.drain(..) {
        let wanted = remarks::guest_name(&outcome.name);
        let mut name = wanted.to_owned();
        let mut number = 0;
        while taken.contains(&name) {
            number += 1;
            name = format!("{wanted}{number}");
        }
        taken.push(name.clone());
        named.push((outcome, name));
    }
    named
}

/// How the configuration treats an outcome.
#[derive(Clone, Copy)]
enum Entry<'c> {
    /// There is no configuration, or it does not apply because the bundle runs alone.
    Free,
    /// The configuration names the bundle.
    Configured(&'c BundleConfig),
    /// The configuration does not name the bundle.
    Unwanted,
}

/// Returns the outcomes in the order of the result, each with its entry in the configuration.
fn in_order<'c>(
    config: Option<&'c Config>,
    outcomes: Vec<(BundleOutcome, String)>,
    scope: Scope,
) -> Vec<(Entry<'c>, (BundleOutcome, String))> {
    let Some(config) = config else {
        return outcomes
            .into_iter()
            .map(|outcome| (Entry::Free, outcome))
            .collect();
    };
    let mut left: Vec<Option<(BundleOutcome, String)>> = outcomes.into_iter().map(Some).collect();
    let mut ordered = Vec::with_capacity(left.len());
    for bundle in &config.bundles {
        let mut found = false;
        for slot in &mut left {
            let matches = |(outcome, _): &mut (BundleOutcome, String)| {
                same_bundle(&bundle.application, &outcome.name, &outcome.alias)
            };
            if let Some(outcome) = slot.take_if(matches) {
                ordered.push((Entry::Configured(bundle), outcome));
                found = true;
            }
        }
        if !found && scope == Scope::Whole {
            let outcome = absent::bundle(bundle, None);
            let name = outcome.name.clone();
            ordered.push((Entry::Configured(bundle), (outcome, name)));
        }
    }
    for outcome in left.into_iter().flatten() {
        let entry = match scope {
            Scope::Whole => Entry::Unwanted,
            Scope::Alone => Entry::Free,
        };
        ordered.push((entry, outcome));
    }
    ordered
}

struct Pool<'a, 'r> {
    input_file: &'a str,
    config: Option<&'a Config>,
    places: Completer<'r>,
    separate: bool,
    removals: Vec<Removal>,
    pooled: Pooled,
}

impl<'a> Pool<'a, '_> {
    fn add(&mut self, entry: Entry<'a>, (outcome, name): (BundleOutcome, String)) {
        let entry = match entry {
            Entry::Unwanted => return self.remove_all(&name, &outcome.checkers, Why::Bundle),
            Entry::Free => None,
            Entry::Configured(bundle) => Some(bundle),
        };
        let outcome = match (outcome.absent.clone(), entry) {
            (None, _) => outcome,
            (why, Some(bundle)) => absent::bundle(bundle, why),
            (Some(why), None) => absent::required(why),
        };
        let BundleOutcome {
            version,
            build_date,
            description,
            params,
            checkers,
            asked,
            ..
        } = outcome;
        let checkers = merged(checkers);
        let checkers = match entry {
            Some(bundle) if !bundle.checkers.is_empty() => self.configured(bundle, &name, checkers),
            _ => checkers,
        };
        let mut checkers: Vec<Checker> = checkers
            .into_iter()
            .map(|outcome| self.checker(entry, &name, outcome))
            .collect();
        if !self.separate {
            same_fault::join(&mut checkers);
        }
        same_fault::forget_causes(&mut checkers);
        self.pooled.results.bundles.push(CheckerBundle {
            summary: summary::of_bundle(&checkers),
            params: self.params(entry, params, asked),
            name,
            version,
            build_date,
            description,
            checkers,
        });
    }

    /// Returns the configured checkers in the order of the configuration. Checkers that blocked one
    /// of them follow. The issues of all others are removed.
    fn configured(
        &mut self,
        config: &BundleConfig,
        name: &str,
        outcomes: Vec<CheckerOutcome>,
    ) -> Vec<CheckerOutcome> {
        let there: Vec<Text> = outcomes.iter().map(|outcome| outcome.id.clone()).collect();
        let kept = in_the_answer(&outcomes, |id| config.checker(id).is_some());
        let (mut wanted, mut others) = (Vec::new(), Vec::new());
        for (outcome, kept) in outcomes.into_iter().zip(kept) {
            if kept { &mut wanted } else { &mut others }.push(outcome);
        }
        let mut ordered = Vec::with_capacity(config.checkers.len());
        for checker in &config.checkers {
            match wanted.iter().position(|outcome| *outcome.id == *checker.id) {
                Some(at) => ordered.push(wanted.remove(at)),
                None => ordered.push(absent::checker(&checker.id, name, &there)),
            }
        }
        ordered.append(&mut wanted);
        self.remove_all(name, &others, Why::Checker);
        ordered
    }

    fn remove_all(&mut self, bundle: &str, checkers: &[CheckerOutcome], why: Why) {
        for checker in checkers {
            let mut counts = Counts::default();
            checker
                .issues
                .iter()
                .for_each(|issue| counts.add(issue.level));
            self.removed(bundle, &checker.id, counts, why);
        }
    }

    fn removed(&mut self, bundle: &str, checker: &str, counts: Counts, why: Why) {
        if counts.total() > 0 {
            self.pooled.removed.extend(counts);
            let (bundle, checker) = (bundle.to_owned(), checker.to_owned());
            self.removals.push(Removal {
                bundle,
                checker,
                counts,
                why,
            });
        }
    }

    /// Completes one checker: levels, rules, places, summary.
    fn checker(
        &mut self,
        entry: Option<&BundleConfig>,
        bundle: &str,
        mut outcome: CheckerOutcome,
    ) -> Checker {
        checker::settle(&mut outcome);
        let configured = self
            .config
            .map(|config| config.effective_params(entry, &outcome.id, &[]))
            .unwrap_or_default();
        let mut removed = Counts::default();
        if let Some(Selection::Selected(selected)) = entry.map(|e| e.selects(&outcome.id)) {
            removed = checker::select(&mut outcome.issues, selected);
            self.removed(bundle, &outcome.id, removed, Why::Levels(selected.levels));
        }
        for issue in &mut outcome.issues {
            self.places.complete(issue);
        }
        let ending = outcome.ending.as_ref();
        if let Some(ending) = ending.filter(|it| **it != Ending::Completed) {
            self.pooled.unfinished.push(Unfinished {
                bundle: bundle.to_owned(),
                checker: outcome.id.clone(),
                ending: ending.clone(),
            });
        }
        checker::finish(outcome, configured, removed)
    }

    /// Returns `InputFile` first, then the configured parameters, then the bundle's own. The number
    /// of checkers left out is last.
    fn params(
        &self,
        entry: Option<&BundleConfig>,
        own: Vec<Param>,
        asked: Option<Asked>,
    ) -> Vec<Param> {
        let mut params = vec![Param {
            name: INPUT_PARAMS[0].to_owned(),
            value: self.input_file.to_owned(),
        }];
        let configured = self
            .config
            .map(|config| config.bundle_params(entry))
            .unwrap_or_default();
        let own = own
            .into_iter()
            .filter(|param| !INPUT_PARAMS.contains(&param.name.as_str()));
        let asked = asked.and_then(Asked::to_param);
        for param in configured.into_iter().chain(own).chain(asked) {
            if !params.iter().any(|earlier| earlier.name == param.name) {
                params.push(param);
            }
        }
        params
    }

    /// Returns the remark that no checker examined the file, unless the result already explains it.
    fn nobody_looked(&self) -> Option<Remark> {
        let looked = self.pooled.results.bundles.iter().any(verdict::has_looked);
        let told = self.pooled.open().next().is_some();
        (!looked && !told).then(|| remarks::nobody_looked(&self.pooled))
    }

    /// Adds the bundle `qcbus`, if it has any remarks.
    fn add_own(&mut self, own: BundleOutcome, remarks: Vec<Remark>) {
        let mut all: Vec<Remark> = self
            .config
            .and_then(remarks::level_order)
            .into_iter()
            .collect();
        all.extend(self.removals.drain(..).map(|removal| removal.to_remark()));
        all.extend(remarks);
        if all.is_empty() {
            return;
        }
        let outcome = BundleOutcome {
            checkers: remarks::to_checkers(all),
            ..own
        };
        let name = outcome.name.clone();
        // The bundle `qcbus` is never filtered, so the configuration is ignored here.
        let config = self.config.take();
        self.add(Entry::Free, (outcome, name));
        self.config = config;
    }

    /// Numbers and counts the issues.
    fn finish(mut self) -> Pooled {
        let mut next = 0;
        for bundle in &mut self.pooled.results.bundles {
            for issue in bundle
                .checkers
                .iter_mut()
                .flat_map(|checker| &mut checker.issues)
            {
                issue.id = next;
                next += 1;
                self.pooled.counts.add(issue.level);
            }
        }
        self.pooled
    }
}

/// Merges checkers with the same id, because ids are unique in a result and no issue may be lost.
fn merged(outcomes: Vec<CheckerOutcome>) -> Vec<CheckerOutcome> {
    let mut ids: Vec<&str> = outcomes.iter().map(|it| &*it.id).collect();
    ids.sort_unstable();
    if ids.windows(2).all(|two| two[0] != two[1]) {
        return outcomes;
    }
    let mut all: Vec<CheckerOutcome> = Vec::with_capacity(outcomes.len());
    let mut seen: std::collections::HashMap<Text, usize> = std::collections::HashMap::new();
    for outcome in outcomes {
        match seen.get(&outcome.id) {
            None => {
                seen.insert(outcome.id.clone(), all.len());
                all.push(outcome);
            }
            Some(&at) => checker::merge(&mut all[at], outcome),
        }
    }
    all
}

impl Counts {
    /// Returns the sum over all levels.
    pub fn total(self) -> u64 {
        self.errors + self.warnings + self.information
    }

    /// Counts one more issue.
    pub fn add(&mut self, level: Level) {
        match level {
            Level::Error => self.errors += 1,
            Level::Warning => self.warnings += 1,
            Level::Information => self.information += 1,
        }
    }

    fn extend(&mut self, other: Counts) {
        self.errors += other.errors;
        self.warnings += other.warnings;
        self.information += other.information;
    }
}
