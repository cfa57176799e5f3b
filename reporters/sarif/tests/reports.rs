//! Validates whole logs against the schema.

#![expect(clippy::unwrap_used, reason = "a test that cannot continue panics")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::BLOCKED;
use qcbus_formats::xqar::{Checker, Issue, Level, Location, Locations, Metadata, Status};
use qcbus_messages::{ResultMessage, Verdict};
use qcbus_report_sarif::{
    MOST_PACKED_BYTES, MOST_PLACES, MOST_RESULTS, SHOWN_RESULTS, Sarif, Section, UNANSWERED,
};
use qcbus_reporter_samples::result;
use qcbus_reporter_sdk::{Destination, NoSources, ReportFormat as _, RulePage};
use serde_json::Value;

const UID: &str = "asam.net:xodr:1.4.0:road.lane.link_order";

fn form() -> Sarif {
    Sarif::new(|uid, _| {
        (uid == UID).then(|| RulePage {
            checker: "check_links".into(),
            summary: "Links are in order.".into(),
            text: "# Links are in order\n\nA lane goes on\nin one lane.\n\n## Why\n\nBecause.\n",
            link: "https://example.com/rules#links".into(),
        })
    })
}

fn at(row: u64, xpath: &str) -> Locations {
    Locations {
        description: "the lane".into(),
        elsewhere: None,
        places: vec![
            Location::File {
                row,
                column: 5,
                offset: None,
            },
            Location::Xml {
                xpath: xpath.into(),
            },
        ],
    }
}

fn issue(text: &str, level: Level, locations: Vec<Locations>) -> Issue {
    Issue {
        id: 0,
        description: text.into(),
        level,
        rule_uid: UID.into(),
        locations,
        domain_info: Vec::new(),
    }
}

fn checker(id: &str, status: Option<Status>, issues: Vec<Issue>) -> Checker {
    Checker {
        id: id.into(),
        description: "Links lead to lanes.".into(),
        summary: "The process died.".into(),
        status,
        issues,
        ..Checker::default()
    }
}

fn rejected(path: &str) -> ResultMessage {
    let mut first = at(12, "/OpenDRIVE/road[@id='5']/lanes/laneSection[2]");
    first.places.push(Location::Road {
        road_id: "5".into(),
        s: 12.345_678,
        t: -1.75,
    });
    first.places.push(Location::Inertial {
        x: 1.0,
        y: f64::NAN,
        z: 1e300,
    });
    let other = OtherPlace {
        path: "/farm/maps/lanes part.xodr".into(),
        row: 9,
        column: 5,
        xpath: Some("/OpenDRIVE/road".into()),
    };
    let elsewhere = Locations {
        description: "the first one".into(),
        elsewhere: Some(other),
        places: vec![Location::File {
            row: 2,
            column: 3,
            offset: None,
        }],
    };
    let mut nameless = issue("no rule\nsays this", Level::Information, Vec::new());
    nameless.rule_uid.clear();
    let issues = vec![
        nameless,
        issue(
            "lane `-1` is wrong",
            Level::Warning,
            vec![first, elsewhere.clone()],
        ),
        issue("in the part", Level::Error, vec![elsewhere]),
    ];
    result(
        path,
        vec![checker("check_links", Some(Status::Completed), issues)],
    )
}

fn accepted(path: &str) -> ResultMessage {
    result(
        path,
        vec![checker("check_links", Some(Status::Completed), Vec::new())],
    )
}

fn undetermined(path: &str) -> ResultMessage {
    let mut blocked = checker("check_ids", Some(Status::Skipped), Vec::new());
    blocked.summary = "Skipped: the file cannot be read. 0 issues.".into();
    blocked.metadata.push(Metadata {
        key: BLOCKED.into(),
        ..Metadata::default()
    });
    let skipped = checker("check_other", Some(Status::Skipped), Vec::new());
    let failed = checker("check_links", Some(Status::Error), Vec::new());
    result(path, vec![failed, blocked, skipped])
}

fn sections(results: &[ResultMessage]) -> BTreeMap<String, Section> {
    let section = |result: &ResultMessage| {
        let section = form().section(result, &NoSources, Destination::OwnFile);
        (result.input.clone(), section.unwrap())
    };
    results.iter().map(section).collect()
}

/// Returns the text of a log.
fn unchecked(results: &[ResultMessage]) -> String {
    form().whole(&sections(results)).unwrap()
}

/// Returns the text of a log. Asserts that it matches the schema.
fn whole(results: &[ResultMessage]) -> String {
    let text = unchecked(results);
    let log: Value = serde_json::from_str(&text).unwrap();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/schema/sarif-2.1.0.json");
    let schema: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let validator = jsonschema::options()
        .should_validate_formats(true)
        .build(&schema)
        .unwrap();
    let errors = validator.iter_errors(&log).take(3);
    let errors: Vec<String> = errors
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(errors.is_empty(), "{errors:?}");
    text
}

fn run(results: &[ResultMessage]) -> Value {
    let mut log: Value = serde_json::from_str(&whole(results)).unwrap();
    log["runs"][0].take()
}

/// Returns the log for a snapshot that does not depend on the version of the program.
fn pretty(results: &[ResultMessage]) -> String {
    let mut log: Value = serde_json::from_str(&whole(results)).unwrap();
    let driver = &mut log["runs"][0]["tool"]["driver"];
    assert_eq!(driver["version"], env!("CARGO_PKG_VERSION"));
    driver["version"] = "VERSION".into();
    driver["semanticVersion"] = "VERSION".into();
    serde_json::to_string_pretty(&log).unwrap()
}

fn fingerprints(run: &Value) -> Vec<&str> {
    let results = run["results"].as_array().unwrap().iter();
    results
        .map(|it| {
            it["partialFingerprints"]["primaryLocationLineHash"]
                .as_str()
                .unwrap()
        })
        .collect()
}

#[test]
fn whole_sarif_log_matches_snapshot() {
    let results = [rejected("maps/a b.xodr"), accepted("maps/fine.xodr")];
    insta::assert_snapshot!(pretty(&results));
}

#[test]
fn log_without_results_is_valid() {
    let run = run(&[]);
    assert_eq!(run["results"], Value::Array(Vec::new()));
    assert_eq!(run["invocations"][0]["executionSuccessful"], true);
}

#[test]
fn undetermined_file_is_never_shown_as_success() {
    let nobody = result(
        "c.xodr",
        vec![checker("a", Some(Status::Skipped), Vec::new())],
    );
    for (result, reason) in [
        (undetermined("b.xodr"), "2 "),
        (nobody, "no checker has checked"),
    ] {
        assert_eq!(result.verdict, Verdict::Undetermined);
        let run = run(std::slice::from_ref(&result));
        let invocation = &run["invocations"][0];
        assert_eq!(invocation["executionSuccessful"], false);
        let told = &invocation["toolExecutionNotifications"];
        assert!(
            told[0]["message"]["text"]
                .as_str()
                .unwrap()
                .contains(&result.display_path)
        );
        assert_eq!(run["artifacts"][0]["properties"]["verdict"], "undetermined");
        let only = &run["results"][0];
        assert_eq!(
            (&only["ruleId"], &only["level"]),
            (&UNANSWERED.into(), &"error".into())
        );
        let text = only["message"]["text"].as_str().unwrap();
        assert!(
            text.starts_with("The file is undetermined, not accepted: "),
            "{text}"
        );
        if reason.starts_with("no") {
            assert!(text.contains(reason), "{text}");
        } else {
            assert!(text.contains("xodrBundle/check_links") && text.contains("check_ids"));
            assert!(!text.contains("check_other"), "{text}");
            assert_eq!(told.as_array().unwrap().len(), 2);
        }
    }
}

#[test]
fn dead_bundle_is_single_notification_beside_errors() {
    let mut checkers: Vec<Checker> = (0..300)
        .map(|n| checker(&format!("check_{n:03}"), Some(Status::Error), Vec::new()))
        .collect();
    let wrong = issue("x", Level::Error, vec![at(1, "/a")]);
    checkers.push(checker("check_links", Some(Status::Completed), vec![wrong]));
    let run = run(&[result("a.xodr", checkers)]);
    let told = run["invocations"][0]["toolExecutionNotifications"]
        .as_array()
        .unwrap();
    assert_eq!(told.len(), 1);
    let text = told[0]["message"]["text"].as_str().unwrap();
    assert!(
        text.starts_with("a.xodr (rejected): 300 checkers gave no answer (xodrBundle/check_000, ")
    );
    assert!(text.contains("295 more): The process died."), "{text}");
    assert_eq!(run["results"].as_array().unwrap().len(), 2);
}

fn many(path: &str, count: usize) -> ResultMessage {
    let issues = (0..count).map(|n| {
        let level = match n % 3 {
            0 => Level::Information,
            1 => Level::Error,
            _ => Level::Warning,
        };
        let xpath = format!("/OpenDRIVE/road[@id='{n}']/lanes");
        issue(
            &format!("road `{n}` is wrong"),
            level,
            vec![at(n as u64 + 1, &xpath)],
        )
    });
    result(
        path,
        vec![checker(
            "check_links",
            Some(Status::Completed),
            issues.collect(),
        )],
    )
}

#[test]
fn all_ten_thousand_findings_are_kept_with_notice() {
    let run = run(&[many("a.xodr", 10_000)]);
    assert_eq!(run["results"].as_array().unwrap().len(), 10_000);
    let told = run["invocations"][0]["toolConfigurationNotifications"]
        .as_array()
        .unwrap();
    let [only] = &told[..] else {
        panic!("{told:?}")
    };
    assert_eq!(only["level"], "note");
    let text = only["message"]["text"].as_str().unwrap();
    assert!(text.contains(&format!("the {SHOWN_RESULTS} most severe of the 10000")));
}

#[test]
fn findings_beyond_limit_drop_least_severe_with_notice() {
    let results = [many("a.xodr", 15_000), many("b.xodr", 15_000)];
    let text = unchecked(&results);
    let log: Value = serde_json::from_str(&text).unwrap();
    let run = &log["runs"][0];
    let kept = run["results"].as_array().unwrap();
    assert_eq!(kept.len(), MOST_RESULTS);
    let count = |level: &str| kept.iter().filter(|it| it["level"] == level).count();
    assert_eq!(
        (count("error"), count("warning"), count("note")),
        (10_000, 10_000, 5_000)
    );
    assert_eq!(run["properties"]["found"], 30_000);
    assert_eq!(run["properties"]["leftOut"]["note"], 5_000);
    let told = &run["invocations"][0]["toolConfigurationNotifications"];
    assert_eq!(
        told[0]["message"]["text"],
        "25000 of 30000 findings are in this report, the most severe ones: code scanning accepts no more. Left out: 0 errors, 0 warnings, 5000 notes."
    );
    // A restarted daemon has the listed results and still reports the omitted ones.
    assert_eq!(form().whole(&form().split(&text)).unwrap(), text);
}

#[test]
fn log_too_large_when_compressed_is_cut_with_notice() {
    // Each finding has its own random text, so that the log cannot be compressed well.
    let mut random = numbers(7);
    let issues = (0..9_000).map(|n| {
        let text: String = (0..1900)
            .map(|_| char::from(b'!' + (random() % 90) as u8))
            .collect();
        issue(
            &text.replace("](", "__"),
            Level::Error,
            vec![at(n + 1, "/a")],
        )
    });
    let all = checker("check_links", Some(Status::Completed), issues.collect());
    let text = unchecked(&[result("a.xodr", vec![all])]);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packed, text.as_bytes()).unwrap();
    let packed = packed.finish().unwrap().len() as u64;
    let room = MOST_PACKED_BYTES * 11 / 10;
    assert!((MOST_PACKED_BYTES / 2..room).contains(&packed), "{packed}");
    let log: Value = serde_json::from_str(&text).unwrap();
    let left_out = log["runs"][0]["properties"]["leftOut"]["error"]
        .as_u64()
        .unwrap();
    let kept = log["runs"][0]["results"].as_array().unwrap().len() as u64;
    assert!(left_out > 0);
    assert_eq!(kept + left_out, 9_000);
}

/// Returns a generator of the same numbers on every machine (Knuth's linear congruential one).
fn numbers(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        state >> 33
    }
}

#[test]
fn fingerprints_survive_edits_and_distinguish_findings() {
    let of = |row, road: &str, text: &str| {
        let place = |id: &str| {
            at(
                row,
                &format!("/OpenDRIVE/road{road}/lanes/lane[@id='{id}']"),
            )
        };
        let issues = vec![
            issue(text, Level::Error, vec![place("-1")]),
            issue(text, Level::Error, vec![place("-2")]),
            issue(text, Level::Error, vec![place("-2")]),
        ];
        run(&[result(
            "a.xodr",
            vec![checker("c", Some(Status::Completed), issues)],
        )])
    };
    let (before, after) = (of(7, "[2]", "0.5 m off"), of(900, "[3]", "0.7 m off"));
    assert_eq!(fingerprints(&before), fingerprints(&after));
    assert_ne!(
        before["results"][0]["locations"],
        after["results"][0]["locations"]
    );
    let different: BTreeSet<&str> = fingerprints(&before).into_iter().collect();
    assert_eq!(different.len(), 3);
    assert!(fingerprints(&before)[2].ends_with(":2"));
}

#[test]
fn hostile_text_stays_text() {
    let hostile = "</script>\u{1b}[2K\u{202e}\0\n[click](http://evil.example) {0} \u{FFFE}";
    let mut places = vec![at(u64::MAX, hostile); 200];
    places.extend((1..=200).map(|row| at(row, hostile)));
    let mut found = issue(hostile, Level::Error, places);
    found.rule_uid = hostile.into();
    let mut all = checker(hostile, Some(Status::Completed), vec![found]);
    all.description = hostile.into();
    let mut result = result(hostile, vec![all]);
    result.results.bundles[0].name = hostile.into();
    let text = whole(std::slice::from_ref(&result));
    let log: Value = serde_json::from_str(&text).unwrap();
    let found = &log["runs"][0]["results"][0];
    let said = found["message"]["text"].as_str().unwrap();
    assert!(!said.chars().any(qcbus_messages::shown::moves), "{said:?}");
    assert!(!said.contains("]("), "{said}");
    assert_eq!(
        found["locations"][0]["physicalLocation"].get("region"),
        None
    );
    assert_eq!(
        found["relatedLocations"].as_array().unwrap().len(),
        MOST_PLACES - 1
    );
    assert_eq!(found["properties"]["placesLeftOut"], 102);
    let sections = sections(&[result]);
    assert_eq!(form().split(&text), sections);
}

#[test]
fn log_splits_into_its_sections() {
    let mut same_name = rejected("maps/a b.xodr");
    same_name.input = "/other/farm/maps/a b.xodr".into();
    let mut results = vec![
        rejected("maps/a b.xodr"),
        same_name,
        accepted("maps/fine.xodr"),
        undetermined("u.xodr"),
        many("m.xodr", 50),
    ];
    while !results.is_empty() {
        let text = whole(&results);
        let sections = sections(&results);
        assert_eq!(form().split(&text), sections);
        assert_eq!(form().whole(&form().split(&text)).unwrap(), text);
        let run = run(&results);
        let different: BTreeSet<&str> = fingerprints(&run).into_iter().collect();
        assert_eq!(different.len(), fingerprints(&run).len());
        results.pop();
    }
}

#[test]
fn foreign_and_torn_logs_are_dropped() {
    let text = whole(&[rejected("a.xodr")]);
    let foreign = text.replace("\"name\":\"qcbus\"", "\"name\":\"other\"");
    assert_ne!(foreign, text);
    for text in ["", "{}", "[", &foreign, &text[..text.len() / 2]] {
        assert!(form().split(text).is_empty());
    }
}

/// Writes the logs of these tests for `tests/multitool`: `QCBUS_SARIF_OUT=DIRECTORY cargo test …`.
#[test]
fn logs_are_written_for_other_validators() {
    let given = std::env::var_os("QCBUS_SARIF_OUT");
    let own = tempfile::tempdir().unwrap();
    let directory = given.map_or(own.path().to_owned(), Into::into);
    let logs = [
        (
            "small",
            whole(&[rejected("maps/a b.xodr"), accepted("maps/fine.xodr")]),
        ),
        ("undetermined", whole(&[undetermined("u.xodr")])),
        ("empty", whole(&[])),
    ];
    for (name, text) in logs {
        let path = directory.join(format!("{name}.sarif"));
        std::fs::write(&path, &text).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
}
