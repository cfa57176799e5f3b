//! Compares whole reports with the rules of the format
//! (<https://docs.gitlab.com/ci/testing/code_quality/>, "Code Quality report format").

#![expect(clippy::unwrap_used, reason = "a test that cannot continue panics")]

use std::collections::{BTreeMap, BTreeSet};

use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::BLOCKED;
use qcbus_formats::xqar::{Checker, Issue, Level, Location, Locations, Metadata, Status};
use qcbus_messages::{ResultMessage, Verdict};
use qcbus_report_gitlab::{CodeQuality, MOST_ENTRIES, Section};
use qcbus_reporter_samples::result;
use qcbus_reporter_sdk::{Destination, NoSources, ReportFormat as _};
use serde_json::Value;

const UID: &str = "asam.net:xodr:1.4.0:road.lane.link_order";

fn issue(text: &str, level: Level, row: u64, xpath: &str) -> Issue {
    let place = Locations {
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
    };
    Issue {
        id: 0,
        description: text.into(),
        level,
        rule_uid: UID.into(),
        locations: vec![place],
        domain_info: Vec::new(),
    }
}

fn checker(id: &str, status: Status, issues: Vec<Issue>) -> Checker {
    Checker {
        id: id.into(),
        summary: "The process died.".into(),
        status: Some(status),
        issues,
        ..Checker::default()
    }
}

fn found(path: &str, issues: Vec<Issue>) -> ResultMessage {
    result(
        path,
        vec![checker("check_links", Status::Completed, issues)],
    )
}

fn rejected(path: &str) -> ResultMessage {
    let mut elsewhere = issue("in the part", Level::Error, 2, "/OpenDRIVE/include");
    elsewhere.locations[0].elsewhere = Some(OtherPlace {
        path: "/farm/maps/part.xodr".into(),
        row: 9,
        column: 5,
        xpath: None,
    });
    let mut nowhere = issue("no place\nis known", Level::Information, 0, "/OpenDRIVE");
    nowhere.rule_uid.clear();
    let wrong = issue(
        "lane `-1` is wrong",
        Level::Warning,
        12,
        "/OpenDRIVE/road[@id='5']",
    );
    found(path, vec![nowhere, wrong, elsewhere])
}

fn undetermined(path: &str) -> ResultMessage {
    let skipped = checker("check_other", Status::Skipped, Vec::new());
    let failed = ["check_a", "check_b"].map(|id| checker(id, Status::Error, Vec::new()));
    result(path, [failed.to_vec(), vec![skipped]].concat())
}

fn sections(results: &[ResultMessage]) -> BTreeMap<String, Section> {
    let section = |result: &ResultMessage| {
        let section = CodeQuality.section(result, &NoSources, Destination::OwnFile);
        (result.input.clone(), section.unwrap())
    };
    results.iter().map(section).collect()
}

/// Returns a report. Asserts that it follows the rules of the format.
fn whole(results: &[ResultMessage]) -> String {
    let text = CodeQuality.whole(&sections(results)).unwrap();
    // GitLab rejects a byte order mark.
    assert!(text.starts_with('['));
    for entry in &entries(&text) {
        for field in ["description", "check_name", "fingerprint"] {
            assert!(
                entry[field].as_str().is_some_and(|it| !it.is_empty()),
                "{entry}"
            );
        }
        let severity = entry["severity"].as_str().unwrap();
        assert!(["info", "minor", "major", "critical", "blocker"].contains(&severity));
        let path = entry["location"]["path"].as_str().unwrap();
        assert!(!path.is_empty() && !path.starts_with(['/', '.']), "{path}");
        assert!(
            entry["location"]["lines"]["begin"]
                .as_u64()
                .is_some_and(|it| it >= 1)
        );
    }
    let all = entries(&text);
    let different: BTreeSet<_> = all.iter().map(|it| it["fingerprint"].as_str()).collect();
    assert_eq!(different.len(), all.len());
    text
}

fn entries(text: &str) -> Vec<Value> {
    serde_json::from_str(text).unwrap()
}

#[test]
fn report_of_every_verdict_matches_snapshot() {
    let accepted = found("maps/fine.xodr", Vec::new());
    insta::assert_snapshot!(whole(&[
        rejected("maps/a b.xodr"),
        accepted,
        undetermined("u.xodr")
    ]));
}

#[test]
fn report_without_findings_is_empty_array() {
    assert_eq!(whole(&[]), "[]\n");
    assert_eq!(whole(&[found("fine.xodr", Vec::new())]), "[]\n");
}

#[test]
fn undetermined_file_has_blocker_entry() {
    let mut blocked = checker("check_a", Status::Skipped, Vec::new());
    blocked.summary = "The file cannot be read.".into();
    blocked.metadata.push(Metadata {
        key: BLOCKED.into(),
        ..Metadata::default()
    });
    let nobody = checker("check_a", Status::Skipped, Vec::new());
    for (checker, why) in [
        (
            blocked,
            "1 checker gave no answer (xodrBundle/check_a): The file cannot be read.",
        ),
        (nobody, "no checker has checked the file"),
    ] {
        let all = entries(&whole(&[result("u.xodr", vec![checker])]));
        assert_eq!(all.len(), 1);
        assert_eq!(all[0]["severity"], "blocker");
        assert_eq!(
            all[0]["description"],
            format!("the file is undetermined, not accepted: {why}")
        );
    }
    // A file with an error is undetermined, too.
    let mut partly = undetermined("p.xodr");
    let wrong = checker(
        "c",
        Status::Completed,
        vec![issue("x", Level::Error, 1, "/a")],
    );
    partly.results.bundles[0].checkers.push(wrong);
    partly.verdict = Verdict::Rejected;
    let all = entries(&whole(&[partly]));
    let severities: Vec<_> = all
        .iter()
        .map(|it| it["severity"].as_str().unwrap())
        .collect();
    assert_eq!(severities, ["blocker", "major"]);
}

fn many(path: &str, count: u64) -> ResultMessage {
    let issues = (0..count).map(|n| {
        let level = match n % 3 {
            0 => Level::Information,
            1 => Level::Error,
            _ => Level::Warning,
        };
        issue(
            "wrong",
            level,
            n + 1,
            &format!("/OpenDRIVE/road[@id='{n}']"),
        )
    });
    found(path, issues.collect())
}

#[test]
fn ten_thousand_findings_are_all_reported() {
    assert_eq!(entries(&whole(&[many("a.xodr", 10_000)])).len(), 10_000);
}

#[test]
fn findings_beyond_limit_drop_least_severe_with_notice() {
    let text = whole(&[many("a.xodr", 15_000), many("b.xodr", 15_000)]);
    let all = entries(&text);
    assert_eq!(all.len(), MOST_ENTRIES + 1);
    assert_eq!(
        all[0]["description"],
        "only the 25000 most severe of 30000 entries are in this report; left out: 0 blocker, \
         0 major, 0 minor, 5000 info"
    );
    let of = |severity: &str| all.iter().filter(|it| it["severity"] == severity).count();
    assert_eq!(
        (of("major"), of("minor"), of("info")),
        (10_000, 10_000, 5_000)
    );
    // A restarted daemon has the listed entries and still reports the omitted ones.
    let again = entries(&CodeQuality.whole(&CodeQuality.split(&text)).unwrap());
    let said = |entry: &Value| entry["description"] == all[0]["description"];
    assert!(again.iter().any(said));
}

#[test]
fn fingerprints_survive_edits_and_distinguish_findings() {
    let of = |row, road: &str, text: &str| {
        let issues = ["-1", "-2", "-2"].map(|lane| {
            let xpath = format!("/OpenDRIVE/road{road}/lane[@id='{lane}']");
            issue(text, Level::Error, row, &xpath)
        });
        let all = entries(&whole(&[found("a.xodr", issues.to_vec())]));
        let fingerprint = |entry: &Value| entry["fingerprint"].as_str().unwrap().to_owned();
        all.iter().map(fingerprint).collect::<Vec<_>>()
    };
    assert_eq!(of(7, "[2]", "0.5 m off"), of(900, "[3]", "0.7 m off"));
}

#[test]
fn hostile_text_stays_text() {
    let hostile = "x</script>\u{1b}[2K\u{202e}\0\n[click](http://evil.example)";
    let mut wrong = issue(hostile, Level::Error, u64::MAX, hostile);
    wrong.rule_uid = hostile.into();
    let result = found(hostile, vec![wrong]);
    let text = whole(std::slice::from_ref(&result));
    for field in ["description", "check_name"] {
        let all = entries(&text);
        let said = all[0][field].as_str().unwrap();
        assert!(!said.chars().any(qcbus_messages::shown::moves), "{said:?}");
    }
    assert_eq!(entries(&text)[0]["location"]["lines"]["begin"], i32::MAX);
    assert_eq!(CodeQuality.split(&text), sections(&[result]));
}

#[test]
fn report_splits_into_its_sections() {
    let mut same_name = rejected("maps/a b.xodr");
    same_name.input = "/other/maps/a b.xodr".into();
    let mut results = vec![
        rejected("maps/a b.xodr"),
        same_name,
        undetermined("u.xodr"),
        many("m.xodr", 50),
    ];
    while !results.is_empty() {
        let text = whole(&results);
        assert_eq!(CodeQuality.split(&text), sections(&results));
        assert_eq!(CodeQuality.whole(&CodeQuality.split(&text)).unwrap(), text);
        results.pop();
    }
    // Accepted files have no entries, and texts in another form are ignored.
    let accepted = whole(&[found("fine.xodr", Vec::new())]);
    for text in [
        accepted.as_str(),
        "",
        "{}",
        "[{}]",
        "[{\"description\": \"x\"}]",
    ] {
        assert!(CodeQuality.split(text).is_empty());
    }
}
