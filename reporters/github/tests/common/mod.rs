//! Results to report on, and a runner that reads what is printed.

pub mod runner;

use std::collections::BTreeMap;

use qcbus_formats::pool::BLOCKED;
use qcbus_formats::xqar::{
    Checker, CheckerBundle, Issue, Level, Location, Locations, Metadata, Results, Status,
};
use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};
use qcbus_report_github::{Annotations, Section};
use qcbus_reporter_sdk::{Destination, NoSources, ReportForm as _, Subject};

pub fn issue(level: Level, rule: &str, text: &str, row: u64) -> Issue {
    let place = Location::File {
        row,
        column: 5,
        offset: None,
    };
    Issue {
        id: 0,
        description: text.into(),
        level,
        rule_uid: format!("asam.net:xodr:1.4.0:{rule}"),
        locations: vec![Locations {
            places: vec![place],
            ..Locations::default()
        }],
        domain_info: Vec::new(),
    }
}

pub fn checker(id: &str, status: Option<Status>, summary: &str, issues: Vec<Issue>) -> Checker {
    Checker {
        id: id.into(),
        summary: summary.into(),
        status,
        issues,
        ..Checker::default()
    }
}

pub fn completed(issues: Vec<Issue>) -> Checker {
    checker("check_a", Some(Status::Completed), "", issues)
}

pub fn blocked(id: &str) -> Checker {
    let by = Metadata {
        key: BLOCKED.into(),
        ..Metadata::default()
    };
    let summary = "Skipped: `check_version` found errors. 0 issues.";
    Checker {
        metadata: vec![by],
        ..checker(id, Some(Status::Skipped), summary, Vec::new())
    }
}

/// A result whose verdict follows from its checkers.
pub fn result(path: &str, checkers: Vec<Checker>) -> ResultMessage {
    let results = Results {
        version: "1.0.0".into(),
        bundles: vec![CheckerBundle {
            name: "xodrBundle".into(),
            checkers,
            ..CheckerBundle::default()
        }],
    };
    ResultMessage {
        job: JobId(1),
        input: format!("/farm/{path}"),
        display_path: path.into(),
        xqar: format!("/out/{path}.xqar"),
        verdict: Verdict::of(&results),
        digest: Digest([7; 32]),
        config: Digest::default(),
        document: None,
        results,
        rules: BTreeMap::new(),
        params: Vec::new(),
    }
}

pub fn sections(results: &[ResultMessage]) -> BTreeMap<String, Section> {
    let section = |result: &ResultMessage| {
        let section = Annotations.section(result, &NoSources, Destination::File);
        (Annotations.key(Subject::from(result)), section.unwrap())
    };
    results.iter().map(section).collect()
}

/// The report of these results. Whatever they are, a runner is asked for no more than it takes, and
/// the report reads back as what it was made of.
pub fn report(results: &[ResultMessage]) -> String {
    let sections = sections(results);
    let text = Annotations.whole(&sections).unwrap();
    runner::run(&text);
    assert_eq!(Annotations.split(&text), sections);
    text
}
