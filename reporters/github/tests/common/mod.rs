//! Results for test reports, and a runner that reads the printed output.

pub mod runner;

use std::collections::BTreeMap;

use qcbus_formats::xqar::{Checker, Issue, Level, Status};
use qcbus_messages::ResultMessage;
use qcbus_report_github::{Annotations, Section};
use qcbus_reporter_samples as samples;
pub use qcbus_reporter_samples::{blocked, checker, result};
use qcbus_reporter_sdk::{Destination, NoSources, ReportFormat as _, Subject};

pub fn issue(level: Level, rule: &str, text: &str, row: u64) -> Issue {
    samples::issue(
        level,
        &format!("asam.net:xodr:1.4.0:{rule}"),
        text,
        (row, 5),
    )
}

pub fn completed(issues: Vec<Issue>) -> Checker {
    checker("check_a", Some(Status::Completed), "", issues)
}

pub fn sections(results: &[ResultMessage]) -> BTreeMap<String, Section> {
    let section = |result: &ResultMessage| {
        let section = Annotations.section(result, &NoSources, Destination::OwnFile);
        (Annotations.key(Subject::from(result)), section.unwrap())
    };
    results.iter().map(section).collect()
}

/// Returns the report of these results. The report never exceeds the limits of a runner, and it
/// reads back as the same sections.
pub fn report(results: &[ResultMessage]) -> String {
    let sections = sections(results);
    let text = Annotations.whole(&sections).unwrap();
    runner::run(&text);
    assert_eq!(Annotations.split(&text), sections);
    text
}
