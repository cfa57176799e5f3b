//! Proof by mutation on scenarios without faults. One violating edit at a time must make the
//! violated rule fire at the place of the edit. No other rule may fire, except those that the list
//! of edits allows.
//!
//! The scenarios, their map and their catalogs are in `tests/rules/mutation/world`, the edits in
//! `tests/rules/mutation/edits.txt`. `QCBUS_BLESS=1` writes `docs/evidence/mutation-openscenario.md`.
//! `QCBUS_MUTATE=NAME` tries the edits of the rules whose name contains it, and prints the results
//! of each.

mod list;
mod page;
mod trial;

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

use list::{Entry, Mutation};
use qcbus_rule_tests::corpus::agrees_or_says;
use qcbus_rule_tests::mutate::in_parallel;
use qcbus_xosc::BUNDLE;
use trial::{BASES, Base, Bench, Trial, rule_of};

const EDITS: &str = include_str!("mutation/edits.txt");

/// Minimum number of edits of each family.
const LEAST: usize = 3;

#[test]
fn unedited_scenarios_have_no_findings() {
    let told: Vec<String> = in_parallel(&BASES, |bench: &mut Bench, base: &Base| {
        let said = bench.unedited(base).unwrap();
        let told = said.iter().map(|it| format!("{}: {it}\n", base.name));
        told.collect()
    });
    assert!(told.concat().is_empty(), "{}", told.concat());
}

#[test]
fn every_rule_has_edits_or_a_reason() {
    let entries = list::read(EDITS).unwrap();
    let listed: BTreeSet<&str> = entries.iter().map(|entry| entry.rule.as_str()).collect();
    assert_eq!(listed.len(), entries.len(), "a rule is listed twice");
    let ids = BUNDLE.rules.iter().map(|rule| rule.facts().id);
    let rules: BTreeSet<&str> = ids.map(rule_of).collect();
    let missing: Vec<_> = rules.difference(&listed).collect();
    let unknown: Vec<_> = listed.difference(&rules).collect();
    assert!(
        missing.is_empty() && unknown.is_empty(),
        "rules without edits (add edits or `none: REASON` to edits.txt): {missing:#?}\nedits of unknown rules: {unknown:#?}"
    );
    for entry in &entries {
        let one = entry.edits.is_empty() == entry.without.is_some();
        assert!(one, "{}: expected either edits or a reason", entry.rule);
    }
    for (family, entries) in list::families(&entries) {
        let count: usize = entries.iter().map(|entry| entry.edits.len()).sum();
        assert!(count >= LEAST, "{family} has only {count} edits");
    }
}

#[test]
fn every_edit_is_found_only_by_its_rule() {
    let entries = list::read(EDITS).unwrap();
    let wanted = std::env::var("QCBUS_MUTATE").unwrap_or_default();
    let asked = |entry: &&Entry| entry.rule.contains(&wanted);
    let all: Vec<(&Entry, &Mutation)> = entries
        .iter()
        .filter(asked)
        .flat_map(|entry| entry.edits.iter().map(move |edit| (entry, edit)))
        .collect();
    let trials: Vec<Trial<'_>> = in_parallel(&all, |bench: &mut Bench, (entry, edit)| {
        bench.trial(entry, edit)
    });
    if !wanted.is_empty() {
        for trial in &trials {
            std::io::stderr()
                .write_all(trial.told().as_bytes())
                .unwrap();
        }
    }
    let faults: Vec<String> = trials.iter().filter_map(Trial::fault).collect();
    assert!(
        faults.is_empty(),
        "{} of {} edits do not have the expected effect:\n{}",
        faults.len(),
        trials.len(),
        faults.join("\n")
    );
    if wanted.is_empty() {
        let silent = silent(&entries, &trials);
        assert!(
            silent.is_empty(),
            "no edit triggers these rules: {silent:?}"
        );
        agrees_or_says(Path::new(page::PATH), &page::page(&entries, &trials));
    }
}

/// Returns the checkers that no edit makes fire, although their rule has edits. A backport needs an
/// older scenario.
fn silent(entries: &[Entry], trials: &[Trial<'_>]) -> Vec<String> {
    let heard: BTreeSet<&str> = trials
        .iter()
        .flat_map(|trial| trial.said.iter().map(|said| said.checker.as_str()))
        .collect();
    let without = |rule: &str| {
        let mut entries = entries.iter().filter(|entry| entry.without.is_some());
        entries.any(|entry| entry.rule == rule)
    };
    let checkers = BUNDLE.checkers().into_iter().map(|checker| checker.id);
    checkers
        .filter(|id| !heard.contains(id.as_str()) && !without(rule_of(id)))
        .collect()
}
