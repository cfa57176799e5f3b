//! Proof by mutation on maps without faults. One violating edit at a time must make the violated
//! rule fire. No other rule may fire, except those that the table of edits allows.
//!
//! The maps and the table are in `tests/rules/mutation/`. `QCBUS_BLESS=1` writes
//! `docs/evidence/mutation-opendrive.md`. `QCBUS_MUTATE=NAME` tries the edits of the rules whose
//! name contains it, and prints the results of each.

mod edit;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;
use std::sync::LazyLock;

use edit::{Edit, Entry};
use qcbus_rule_tests::mutate::in_parallel;
use qcbus_sdk::{Issue, Level, Listener, Loaded, Outcome, Plan, Status, check};
use qcbus_xodr::BUNDLE;

const EDITS: &str = include_str!("mutation/edits.txt");
const PAGE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../docs/evidence/mutation-opendrive.md"
);
/// The published schemas reject some constructs that the standard prints. The rule mentions this
/// and does not report an error.
const DEFECT: &str = "known defect of the published schema";

const MAPS: [(&str, &str); 4] = [
    ("1.4", include_str!("mutation/all-1.4.xodr")),
    ("1.7", include_str!("mutation/all-1.7.xodr")),
    ("1.8", include_str!("mutation/all-1.8.xodr")),
    ("1.9", include_str!("mutation/all-1.9.xodr")),
];

/// All rules that are on by default, and the profiles of simulators. The rules' pages are read
/// once, not for every map.
static PLAN: LazyLock<Plan> = LazyLock::new(|| {
    let is_on = |id: &'static str, by_default| by_default || name(id).starts_with("profile_");
    Plan::new(
        &BUNDLE,
        |checker| is_on(checker.facts.id, checker.facts.default_on),
        |_, _| None,
    )
});

/// The findings of the rules for a map, by the rules' names.
#[derive(Default)]
struct Verdict {
    /// Rules that completed.
    completed: BTreeSet<&'static str>,
    findings: BTreeMap<&'static str, Vec<Issue>>,
}

impl Verdict {
    fn of(map: &str) -> Verdict {
        let loaded = Loaded::from_bytes(Path::new("map.xodr"), map.as_bytes().to_vec()).unwrap();
        let subject = loaded.subject(&BUNDLE).unwrap();
        let mut heard = Heard(Verdict::default());
        check(&PLAN, &subject, &mut heard);
        heard.0
    }

    /// Returns the rules with a finding at error level.
    fn errors(&self) -> impl Iterator<Item = &'static str> {
        let error = |issues: &Vec<Issue>| issues.iter().any(|issue| issue.level == Level::Error);
        let all = self.findings.iter();
        all.filter(move |(_, issues)| error(issues))
            .map(|(rule, _)| *rule)
    }

    fn told(&self) -> String {
        let mut text = String::new();
        for (rule, issues) in &self.findings {
            for issue in issues.iter().filter(|it| !it.description.contains(DEFECT)) {
                writeln!(text, "    {:?} {rule}: {}", issue.level, issue.description).unwrap();
            }
        }
        text
    }
}

struct Heard(Verdict);

impl Listener for Heard {
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome) {
        // A backport is the same rule for older files.
        let rule = name(PLAN.checkers()[checker].facts.id);
        if outcome.ending.status() == Status::Completed {
            self.0.completed.insert(rule);
        }
        if !issues.is_empty() {
            self.0.findings.entry(rule).or_default().extend(issues);
        }
    }
}

fn name(id: &'static str) -> &'static str {
    id.split_once("_xodr_").map_or(id, |(_, name)| name)
}

/// Result of a rule's edits.
#[derive(Default)]
struct Row {
    tried: usize,
    detected: usize,
    maps: BTreeSet<&'static str>,
    companions: BTreeSet<&'static str>,
}

/// A base map.
struct Map {
    name: &'static str,
    text: &'static str,
    /// Rules that apply to it.
    rules: BTreeSet<&'static str>,
}

fn maps() -> Vec<Map> {
    let map = |(name, text): (&'static str, &'static str)| Map {
        name,
        text,
        rules: Verdict::of(text).completed,
    };
    MAPS.into_iter().map(map).collect()
}

/// Tries a rule's edits on all maps. Adds errors to `faults`.
fn row(entry: &Entry, maps: &[Map], faults: &mut Vec<String>) -> Row {
    let mut row = Row::default();
    for edit in &entry.edits {
        let (mut tried, mut seen) = (0, BTreeSet::new());
        for map in maps {
            if !edit.is_for(map.name) || !map.rules.contains(entry.rule.as_str()) {
                continue;
            }
            let Some(text) = edit.apply(map.text) else {
                continue;
            };
            tried += 1;
            row.maps.insert(map.name);
            row.detected += usize::from(judged(entry, edit, map.name, &text, &mut seen, faults));
        }
        row.tried += tried;
        if tried == 0 {
            faults.push(format!("{}: no map has: {}", entry.rule, edit.text));
        }
        let unused = edit
            .companions
            .iter()
            .filter(|it| !seen.contains(it.as_str()));
        for companion in unused {
            let (rule, text) = (&entry.rule, &edit.text);
            faults.push(format!(
                "{rule}: `{companion}` is allowed, but silent at: {text}"
            ));
        }
        row.companions.extend(seen);
    }
    row
}

/// Returns the rows of all rules whose name contains `wanted`, in order, and the errors. Rules are
/// independent, so they run in parallel.
fn rows(entries: &[Entry], maps: &[Map], wanted: &str) -> (Vec<Row>, Vec<String>) {
    let done = in_parallel(entries, |(): &mut (), entry| {
        let mut faults = Vec::new();
        let row = match entry.rule.contains(wanted) {
            true => row(entry, maps, &mut faults),
            false => Row::default(),
        };
        (row, faults)
    });
    let (rows, faults): (Vec<Row>, Vec<Vec<String>>) = done.into_iter().unzip();
    (rows, faults.concat())
}

/// Returns whether the rule fires on the edited map.
fn judged(
    entry: &Entry,
    edit: &Edit,
    map: &str,
    text: &str,
    seen: &mut BTreeSet<&'static str>,
    faults: &mut Vec<String>,
) -> bool {
    let verdict = Verdict::of(text);
    let what = || format!("{} in {map}: {}\n{}", entry.rule, edit.text, verdict.told());
    if std::env::var_os("QCBUS_MUTATE").is_some() {
        println!("{}", what());
    }
    let detected = verdict.findings.contains_key(entry.rule.as_str());
    if !detected {
        faults.push(format!("not detected: {}", what()));
    }
    for other in verdict.errors().filter(|other| *other != entry.rule) {
        seen.insert(other);
        if !edit.companions.iter().any(|it| it == other) {
            faults.push(format!("`{other}` fires as well: {}", what()));
        }
    }
    detected
}

fn page(entries: &[Entry], rows: &[Row]) -> String {
    let (tried, detected) = rows
        .iter()
        .fold((0, 0), |sum, row| (sum.0 + row.tried, sum.1 + row.detected));
    let with = entries
        .iter()
        .filter(|entry| entry.without.is_none())
        .count();
    let mut text = format!(
        "# Mutation proof of the OpenDRIVE rules\n\nGenerated by `bundles/xodr/tests/rules/mutation.rs`. The rules find \
         nothing wrong with its maps. Each edit\nof `bundles/xodr/tests/rules/mutation/edits.txt` violates one rule. \
         That rule must fire, at any level. At\nerror level, no other rules may fire except the companions of \
         that edit.\n\n{with} of {} rules have edits. Detected: **{detected} of {tried}**, each edit counted \
         once per map (1.4, 1.7, 1.8, 1.9) that has the element and to whose version the rule applies.\n\n\
         | rule | edits | maps | tried | detected | companions |\n|---|--:|---|--:|--:|---|\n",
        entries.len()
    );
    for (entry, row) in entries.iter().zip(rows) {
        if entry.without.is_some() {
            continue;
        }
        let list = |names: &BTreeSet<&str>| names.iter().copied().collect::<Vec<_>>().join(", ");
        let (rule, edits, maps) = (&entry.rule, entry.edits.len(), list(&row.maps));
        let (tried, detected, also) = (row.tried, row.detected, list(&row.companions));
        writeln!(
            text,
            "| {rule} | {edits} | {maps} | {tried} | {detected} | {also} |"
        )
        .unwrap();
    }
    text.push_str("\n## Rules without an edit\n\n| rule | why |\n|---|---|\n");
    for entry in entries {
        if let Some(why) = &entry.without {
            writeln!(text, "| {} | {why} |", entry.rule).unwrap();
        }
    }
    text
}

#[test]
fn unedited_maps_have_no_findings() {
    let mut faults = String::new();
    for (name, text) in MAPS {
        let verdict = Verdict::of(text);
        let mut found = verdict.findings.values().flatten();
        if found.any(|it| it.level != Level::Information && !it.description.contains(DEFECT)) {
            writeln!(faults, "in {name}:\n{}", verdict.told()).unwrap();
        }
    }
    assert!(faults.is_empty(), "{faults}");
}

#[test]
fn every_rule_has_edits_or_a_reason() {
    let entries = edit::table(EDITS);
    let listed: Vec<&str> = entries.iter().map(|entry| entry.rule.as_str()).collect();
    let rules: Vec<&str> = BUNDLE.rules.iter().map(|it| name(it.facts().id)).collect();
    let missing: Vec<_> = rules.iter().filter(|it| !listed.contains(it)).collect();
    let unknown: Vec<_> = listed.iter().filter(|it| !rules.contains(it)).collect();
    assert!(
        missing.is_empty() && unknown.is_empty(),
        "rules without edits (add edits or `none: REASON` to edits.txt): {missing:#?}\nedits of unknown rules: {unknown:#?}"
    );
    assert_eq!(listed.len(), rules.len(), "a rule is listed twice");
    for entry in &entries {
        let one = entry.edits.is_empty() == entry.without.is_some();
        assert!(one, "{}: expected either edits or a reason", entry.rule);
    }
}

#[test]
fn every_edit_is_found_only_by_its_rule() {
    let (entries, maps) = (edit::table(EDITS), maps());
    let wanted = std::env::var("QCBUS_MUTATE").unwrap_or_default();
    let (rows, faults) = rows(&entries, &maps, &wanted);
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        faults.join("\n")
    );
    if !wanted.is_empty() {
        return;
    }
    let text = page(&entries, &rows);
    if std::env::var_os("QCBUS_BLESS").is_some() {
        std::fs::write(PAGE, &text).unwrap();
    }
    let written = std::fs::read_to_string(PAGE).unwrap_or_default();
    assert!(
        written == text,
        "{PAGE} does not match the edits; QCBUS_BLESS=1 rewrites it"
    );
}
