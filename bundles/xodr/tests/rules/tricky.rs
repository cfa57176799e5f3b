//! Tests with tricky maps: valid ones that look wrong, and wrong ones that look valid. Each row of
//! a table names the rules that find something in its map. No other rule may find something.
//!
//! The pages show the plain cases. These tests contain the cases that a careless implementation
//! gets wrong.

mod beyond;
mod build;
mod closed;
mod header;
mod junctions;
mod lane_links;
mod lanes;
mod numbers;
mod reference_lines;
mod road_links;
mod roadside;
mod slight;
mod stands;
mod topology;
mod words;

use std::collections::BTreeSet;
use std::path::Path;

use qcbus_sdk::{Issue, Level, Listener, Loaded, Outcome, Plan, check};
use qcbus_xodr::BUNDLE;

/// Description, the map after its header, and `error NAME` or `warning NAME` for every rule with a
/// finding of that level.
type Row = (&'static str, String, &'static [&'static str]);

struct Heard<'p> {
    plan: &'p Plan,
    findings: BTreeSet<String>,
}

impl Listener for Heard<'_> {
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, _: Outcome) {
        let id = self.plan.checkers()[checker].facts.id;
        let name = id.split_once("_xodr_").map_or(id, |(_, name)| name);
        // The schemas have separate tests.
        for issue in issues.iter().filter(|_| name != "xml_valid_schema") {
            let level = match issue.level {
                Level::Error => "error",
                Level::Warning => "warning",
                Level::Information => continue,
            };
            self.findings.insert(format!("{level} {name}"));
        }
    }
}

/// Returns the rules with a finding in a file.
fn findings(plan: &Plan, file: &[u8]) -> BTreeSet<String> {
    let loaded = Loaded::from_bytes(Path::new("map.xodr"), file.to_vec()).unwrap();
    let mut heard = Heard {
        plan,
        findings: BTreeSet::new(),
    };
    check(plan, &loaded.subject(&BUNDLE).unwrap(), &mut heard);
    heard.findings
}

/// Runs a table on maps of version 1.9.
fn run(rows: &[Row]) {
    let whole = |(what, map, expected): &Row| (*what, build::file("9", map), *expected);
    run_files(&rows.iter().map(whole).collect::<Vec<_>>());
}

/// Runs a table on whole files.
fn run_files(rows: &[Row]) {
    let plan = Plan::by_default(&BUNDLE);
    let mut faults = Vec::new();
    for (what, file, expected) in rows {
        let found = findings(&plan, file.as_bytes());
        let expected: BTreeSet<String> = expected.iter().map(|it| (*it).to_owned()).collect();
        if found != expected {
            faults.push(format!("{what}: found {found:?}, expected {expected:?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
