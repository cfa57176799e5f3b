//! Tests of the JUnit of whole reports.

use crate::common::{blocked, checker, endings, issue, markup, report, result, sections};
use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{Level, Location, Locations, Param, Status};
use qcbus_messages::Verdict;
use qcbus_report_junit::{LONGEST_FINDING, MOST_FINDINGS, REPORTER, Suites};
use qcbus_reporter_samples::plain_run;
use qcbus_reporter_sdk::{NoSources, ReportFormat as _, Setting};

fn set(name: &str, value: &str) -> Param {
    Param {
        name: name.into(),
        value: value.into(),
    }
}

#[test]
fn case_of_every_ending_matches_snapshot() {
    let ended = result("maps/harbour.xodr", endings());
    let text = report(&[ended]);
    insta::assert_snapshot!(text);
}

#[test]
fn inapplicable_checkers_are_listed_on_request() {
    let mut ended = result("a.xodr", endings());
    let counted = report(&[ended.clone()]);
    assert!(!counted.contains("check_1_7"));
    assert!(counted.contains("1 checker does not apply to the file and is left out"));
    ended.params = vec![set("Inapplicable", "listed")];
    let listed = report(&[ended.clone()]);
    assert!(listed.contains(
        r#"<skipped message="the rule applies to OpenDRIVE 1.7 and later." type="not applicable"/>"#
    ));
    assert!(!listed.contains("left out"));
    ended.params = vec![set("Inapplicable", "never")];
    let refused = sections(&[ended]).unwrap_err().to_string();
    assert!(refused.contains(r#"Inapplicable="never""#), "{refused}");
}

#[test]
fn file_without_completed_checks_is_red() {
    let only_blocked = result("a.xodr", vec![blocked("check_lanes"), blocked("check_x")]);
    let nobody = result("b.xodr", Vec::new());
    assert_eq!(only_blocked.verdict, Verdict::Undetermined);
    assert_eq!(nobody.verdict, Verdict::Undetermined);
    let mut unexplained = result("c.xodr", Vec::new());
    unexplained.verdict = Verdict::Rejected;
    let text = report(&[only_blocked, nobody, unexplained]);
    insta::assert_snapshot!(text);
}

#[test]
fn accepted_file_passes_and_error_of_skipped_checker_fails() {
    let warned = vec![issue(Level::Warning, "odd", 2)];
    let passes = checker("check_a", Some(Status::Completed), "", warned.clone());
    let accepted = report(&[result("a.xodr", vec![passes.clone()])]);
    assert!(accepted.contains(r#"tests="1" failures="0" errors="0""#));
    assert!(accepted.contains("<system-out>a.xodr:2:5: warning: odd</system-out>"));

    let found = vec![issue(Level::Error, "broken", 2)];
    let odd = checker("check_b", Some(Status::Skipped), "Skipped. 1 issue.", found);
    let rejected = report(&[result("a.xodr", vec![passes, odd])]);
    assert!(rejected.contains(r#"tests="2" failures="1" errors="0""#));
}

#[test]
fn places_are_reported_as_far_as_known() {
    let mut elsewhere = issue(Level::Error, "in a map", 3);
    elsewhere.locations[0].elsewhere = Some(OtherPlace {
        path: "/farm/maps/town.xodr".into(),
        row: 12,
        column: 0,
        xpath: None,
    });
    let mut by_element = issue(Level::Error, "an element", 1);
    by_element.locations[0].places = vec![Location::Xml {
        xpath: "/OpenDRIVE/road[2]".into(),
    }];
    let mut nowhere = issue(Level::Error, "", 1);
    nowhere.locations = vec![Locations::default()];
    let issues = vec![elsewhere, by_element, nowhere];
    let found = checker("check_a", Some(Status::Completed), "", issues);
    let text = report(&[result("scenarios/a.xosc", vec![found])]);
    let root = markup::read(&text);
    let failure = &root.children[0].named("testcase").next().unwrap().children[0];
    assert_eq!(
        failure.text,
        "maps/town.xodr:12: error: in a map\n\
         scenarios/a.xosc: error: an element (/OpenDRIVE/road[2])\n\
         scenarios/a.xosc: error: (no description)"
    );
    assert_eq!(failure.attributes["message"], "in a map (1 of 3 findings)");
}

#[test]
fn hostile_text_stays_text() {
    let text = "]]></failure>&#0;<!--\u{1b}[2K\0\u{FFFF}\u{202e}\r\n\u{3000}";
    let mut found = vec![issue(Level::Error, text, u64::MAX); 2];
    found[0].rule_uid = text.into();
    let mut ended = vec![
        checker(text, Some(Status::Completed), text, found.clone()),
        checker(text, Some(Status::Error), text, found),
        checker("", None, text, Vec::new()),
        checker("", Some(Status::Completed), text, Vec::new()),
    ];
    ended.push(blocked(&format!("{text}#2")));
    let mut hostile = result(&format!(" maps/\"{text}"), ended);
    hostile.results.bundles[0].name = text.into();
    let mut nameless = result("", vec![blocked("")]);
    nameless.results.bundles[0].name = "\n".into();
    let written = report(&[hostile.clone(), nameless]);
    assert_eq!(written.matches("<testsuite ").count(), 2);
    assert!(written.contains(r#"name="(no id)#2""#));
    // The key is the same after reading back, so that a newer result replaces the older one.
    let again = sections(&[hostile]).unwrap();
    let read = Suites.split(&written);
    assert!(again.keys().all(|key| read.contains_key(key)));
}

#[test]
fn ten_thousand_findings_are_bounded_with_errors_first() {
    let long = "ä ".repeat(LONGEST_FINDING);
    let mut issues: Vec<_> = (1..10_000)
        .map(|row| issue(Level::Warning, &long, row))
        .collect();
    issues.push(issue(Level::Error, "the one that counts", 10_000));
    let found = checker("check_a", Some(Status::Completed), "", issues);
    let text = report(&[result("a.xodr", vec![found])]);
    let root = markup::read(&text);
    let failure = &root.children[0].named("testcase").next().unwrap().children[0];
    let lines: Vec<&str> = failure.text.lines().collect();
    assert_eq!(lines[0], "a.xodr:10000:5: error: the one that counts");
    assert_eq!(lines.len(), MOST_FINDINGS + 1);
    assert_eq!(
        lines[MOST_FINDINGS],
        "and 9900 more; the result file contains all of them"
    );
    let message = &failure.attributes["message"];
    assert_eq!(message, "the one that counts (1 of 10000 findings)");
    assert!(text.len() < 200_000, "{} bytes", text.len());
}

#[test]
fn report_of_no_file_is_valid() {
    let none = report(&[]);
    assert!(none.contains(r#"<testsuites name="qcbus" tests="0" failures="0" errors="0">"#));
}

#[test]
fn foreign_and_torn_reports_are_dropped() {
    let ours = report(&[result("a.xodr", endings())]);
    let torn = &ours[..ours.len() / 2];
    assert!(Suites.split(torn).is_empty());
    assert!(Suites.split("").is_empty());
    let foreign = r#"<testsuites><testsuite name="x" tests="0"/></testsuites>"#;
    assert!(Suites.split(foreign).is_empty());
}

#[test]
fn restarted_daemon_keeps_earlier_reports() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("all.junit.xml");
    let make = |keep| {
        let plain = plain_run();
        (REPORTER.make)(&Setting {
            keep,
            is_run: false,
            ..plain
        })
    };
    let sent = |name: &str, checkers| {
        let mut sent = result(name, checkers);
        sent.params = vec![set("OutputFile", path.to_str().unwrap())];
        sent
    };
    let first = sent("b.xodr", endings());
    let second = sent("a.xodr", vec![blocked("check_lanes")]);
    make(false).report(&first, &NoSources).unwrap();
    make(true).report(&second, &NoSources).unwrap();
    let written = std::fs::read_to_string(&path).unwrap();
    assert_eq!(written, report(&[second, first]));
}
