//! Results for test reports, and checks that every report must pass.

pub mod markup;

use std::collections::{BTreeMap, BTreeSet};

use qcbus_formats::xqar::{Checker, Issue, Level, Status};
use qcbus_messages::ResultMessage;
use qcbus_report_junit::Suites;
use qcbus_reporter_samples as samples;
pub use qcbus_reporter_samples::{blocked, checker, result};
use qcbus_reporter_sdk::{Destination, NoSources, ReportError, ReportFormat as _, Subject};

use markup::Element;

pub fn issue(level: Level, text: &str, row: u64) -> Issue {
    samples::issue(
        level,
        "asam.net:xodr:1.4.0:ids.id_unique_in_class",
        text,
        (row, 5),
    )
}

/// Returns one checker for every kind of ending.
pub fn endings() -> Vec<Checker> {
    let completed = Some(Status::Completed);
    let remarks = vec![
        issue(Level::Information, "the name is empty", 7),
        issue(Level::Warning, "the road is 3 mm long", 8),
    ];
    let errors = vec![
        issue(Level::Warning, "the id \"5\" is odd", 3),
        issue(Level::Error, "the id \"5\" is taken\nby <road>", 4),
    ];
    let too_old = "Skipped: the rule applies to OpenDRIVE 1.7 and later. 0 issues.";
    let died = "Error: the bundle died. 0 issues.";
    vec![
        checker("check_version", completed, "0 issues.", Vec::new()),
        checker("check_lengths", completed, "2 issues.", remarks),
        checker("check_ids", completed, "2 issues.", errors),
        checker("check_1_7", Some(Status::Skipped), too_old, Vec::new()),
        checker("check_links", Some(Status::Error), died, Vec::new()),
        checker("check_silent", None, "", Vec::new()),
        blocked("check_lanes"),
    ]
}

/// Returns sections by their keys.
pub fn sections(
    results: &[ResultMessage],
) -> Result<BTreeMap<String, quick_junit::TestSuite>, ReportError> {
    let section = |result: &ResultMessage| {
        let section = Suites.section(result, &NoSources, Destination::OwnFile)?;
        Ok((Suites.key(Subject::from(result)), section))
    };
    results.iter().map(section).collect()
}

/// Returns the report of these results. It always follows the rules of JUnit and reads back as the
/// same sections.
pub fn report(results: &[ResultMessage]) -> String {
    let sections = sections(results).unwrap();
    let text = Suites.whole(&sections).unwrap();
    assert_keeps_the_rules(&text);
    assert!(Suites.split(&text) == sections, "{text}");
    text
}

/// Asserts that names, places and numbers of elements follow JUnit.
pub fn assert_keeps_the_rules(text: &str) {
    let root = markup::read(text);
    assert_eq!(root.name, "testsuites");
    root.has_only(&["name", "tests", "failures", "errors"]);
    let mut sums = [0; 3];
    for suite in &root.children {
        assert_eq!(suite.name, "testsuite");
        suite.has_only(&["name", "tests", "skipped", "errors", "failures"]);
        assert!(!suite.attributes["name"].trim().is_empty());
        let order = ["properties", "testcase", "system-out"];
        let places = suite.children.iter().map(|child| {
            let place = order.iter().position(|name| *name == child.name);
            place.unwrap_or_else(|| panic!("unexpected element {} in a suite", child.name))
        });
        assert!(places.is_sorted(), "the order must be {order:?}");
        let cases: Vec<&Element> = suite.named("testcase").collect();
        let counts = [cases.len(), with(&cases, "failure"), with(&cases, "error")];
        assert_eq!(counts, suite.numbers(["tests", "failures", "errors"]));
        assert_eq!([with(&cases, "skipped")], suite.numbers(["skipped"]));
        sums.iter_mut().zip(counts).for_each(|(sum, it)| *sum += it);
        assert_cases(&cases);
    }
    assert_eq!(sums, root.numbers(["tests", "failures", "errors"]));
}

fn with(cases: &[&Element], child: &str) -> usize {
    let has = |case: &&&Element| case.named(child).next().is_some();
    cases.iter().filter(has).count()
}

fn assert_cases(cases: &[&Element]) {
    let mut names = BTreeSet::new();
    for case in cases {
        case.has_only(&["name", "classname"]);
        assert!(
            case.attributes
                .values()
                .all(|value| !value.trim().is_empty())
        );
        assert!(
            names.insert(&case.attributes),
            "twice: {:?}",
            case.attributes
        );
        let kinds: Vec<&str> = case.children.iter().map(|it| it.name.as_str()).collect();
        let allowed: [&[&str]; 6] = [
            &[],
            &["failure"],
            &["error"],
            &["skipped"],
            &["system-out"],
            &["skipped", "system-out"],
        ];
        assert!(allowed.contains(&kinds.as_slice()), "{kinds:?}");
        for child in case.children.iter().filter(|it| it.name != "system-out") {
            child.has_only(&["type", "message"]);
            assert!(child.attributes.values().all(|value| !value.is_empty()));
        }
    }
}
