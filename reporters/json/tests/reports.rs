//! Tests of the JSON of whole reports.

use std::collections::BTreeMap;

use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{
    Checker, CheckerBundle, Issue, Level, Location, Locations, Metadata, Param, Results, Status,
};
use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};
use qcbus_report_json::{REPORTER, render};
use qcbus_reporter_samples::plain_run;
use qcbus_reporter_sdk::{NoSources, Reporter, Setting};
use serde_json::Value;

const UID: &str = "asam.net:xodr:1.4.0:ids.id_unique_in_class";

fn param(name: &str, value: &str) -> Param {
    Param {
        name: name.into(),
        value: value.into(),
    }
}

fn issue() -> Issue {
    let elsewhere = OtherPlace {
        path: "/farm/maps/lanes.xodr".into(),
        row: 9,
        column: 5,
        xpath: None,
    };
    let here = vec![
        Location::File {
            row: 4,
            column: 2,
            offset: Some(87),
        },
        Location::Xml {
            xpath: "/OpenDRIVE/road[2]".into(),
        },
        Location::Road {
            road_id: "5".into(),
            s: 0.1,
            t: -1.5,
        },
    ];
    let reference = Location::File {
        row: 2,
        column: 3,
        offset: None,
    };
    Issue {
        id: 7,
        description: "the id \"5\" is taken".into(),
        level: Level::Error,
        rule_uid: UID.into(),
        locations: vec![
            Locations {
                description: "the second one".into(),
                elsewhere: None,
                places: here,
            },
            Locations {
                description: "the first one".into(),
                elsewhere: Some(elsewhere),
                places: vec![reference],
            },
        ],
        domain_info: Vec::new(),
    }
}

fn result(path: &str) -> ResultMessage {
    let checker = Checker {
        id: "check_ids".into(),
        description: "Ids are unique.".into(),
        summary: "1 issue(s) are found.".into(),
        status: Some(Status::Completed),
        params: vec![param("tolerance", "0.01")],
        issues: vec![issue()],
        addressed_rules: [UID.into()].into(),
        metadata: vec![Metadata {
            key: "micros".into(),
            value: "12".into(),
            description: "time spent".into(),
        }],
    };
    let bundle = CheckerBundle {
        name: "xodrBundle".into(),
        version: "0.1.0".into(),
        build_date: "2026-11-21".into(),
        params: vec![param("InputFile", "/farm/maps/harbour.xodr")],
        checkers: vec![checker],
        ..CheckerBundle::default()
    };
    ResultMessage {
        job: JobId(1),
        input: format!("/farm/{path}"),
        display_path: path.into(),
        xqar: format!("/out/{path}.xqar"),
        verdict: Verdict::Rejected,
        digest: Digest([7; 32]),
        config: Digest::default(),
        document: None,
        results: Results {
            version: "1.0.0".into(),
            bundles: vec![bundle],
        },
        rules: BTreeMap::from([(UID.to_owned(), "Ids tell roads apart.".to_owned())]),
        params: Vec::new(),
    }
}

#[test]
fn whole_json_report_matches_snapshot() {
    insta::assert_snapshot!(render(&result("maps/harbour.xodr"), 2).unwrap());
}

#[test]
fn report_without_indent_is_single_line_of_same_content() {
    let result = result("maps/harbour.xodr");
    let line = render(&result, 0).unwrap();
    assert_eq!(line.matches('\n').count(), 1);
    let read = |text: &str| serde_json::from_str::<Value>(text).unwrap();
    assert_eq!(read(&line), read(&render(&result, 4).unwrap()));
}

#[test]
fn bundles_and_checkers_of_same_name_are_all_listed() {
    let mut twice = result("a.xodr");
    let checkers = &mut twice.results.bundles[0].checkers;
    checkers.push(checkers[0].clone());
    let bundle = twice.results.bundles[0].clone();
    twice.results.bundles.push(bundle);
    let json: Value = serde_json::from_str(&render(&twice, 2).unwrap()).unwrap();
    let second = &json["bundles"]["xodrBundle#2"];
    assert_eq!(second["name"], "xodrBundle");
    assert_eq!(second["checkers"]["check_ids#2"]["checkerId"], "check_ids");
    assert_eq!(json["qcbus"]["issues"]["error"], 4);
}

#[test]
fn checker_without_status_is_null() {
    let mut result = result("a.xodr");
    result.results.bundles[0].checkers[0].status = None;
    let json: Value = serde_json::from_str(&render(&result, 2).unwrap()).unwrap();
    let checker = &json["bundles"]["xodrBundle"]["checkers"]["check_ids"];
    assert_eq!(checker["status"], Value::Null);
    assert_eq!(json["qcbus"]["checkers"]["noStatus"], 1);
}

#[test]
fn shared_file_holds_newest_report_of_each_checked_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("all.json");
    let output = param("OutputFile", &path.to_string_lossy());
    let (mut one, mut other) = (result("b.xodr"), result("a.xodr"));
    (one.params, other.params) = (vec![output.clone()], vec![output]);
    let mut reporter = new_reporter(false);
    for result in [&one, &other, &one] {
        reporter.report(result, &NoSources).unwrap();
    }
    reporter.finish().unwrap();
    let expected = render(&other, 0).unwrap() + &render(&one, 0).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);

    // The reporter restarts after a crash in the middle of a write.
    std::fs::write(&path, expected.clone() + "{\"version\": ").unwrap();
    new_reporter(true).report(&one, &NoSources).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
}

#[test]
fn invalid_indent_is_refused_with_allowed_range() {
    let mut result = result("a.xodr");
    result.params.push(param("Indent", "-1"));
    let error = new_reporter(false).report(&result, &NoSources);
    assert_eq!(
        error.unwrap_err().to_string(),
        "use the parameter Indent=\"-1\": expected an integer from 0 to 16"
    );
}

fn new_reporter(keep: bool) -> Box<dyn Reporter> {
    (REPORTER.make)(&Setting {
        keep,
        is_run: false,
        ..plain_run()
    })
}
