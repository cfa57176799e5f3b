//! Tests of the log and the annotations of whole reports.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot continue panics"
)]

mod common;

use common::{blocked, checker, completed, issue, report, result, runner, sections};
use qcbus_formats::location::OtherPlace;
use qcbus_formats::xqar::{Level, Location, Param, Status};
use qcbus_messages::Verdict;
use qcbus_report_github::{Annotations, LONGEST_TEXT, REPORTER};
use qcbus_reporter_samples::plain_run;
use qcbus_reporter_sdk::{NoSources, ReportFormat as _, Setting};

#[test]
fn report_of_several_files_matches_snapshot() {
    let mut elsewhere = issue(Level::Error, "ids.exist", "road 7 is not available", 3);
    elsewhere.locations[0].elsewhere = Some(OtherPlace {
        path: "/farm/maps/town.xodr".into(),
        row: 12,
        column: 0,
        xpath: None,
    });
    let mut by_element = issue(Level::Warning, "names", "100 % empty, odd: yes", 1);
    by_element.rule_uid = String::new();
    by_element.locations[0].places = vec![Location::Xml {
        xpath: "/OpenSCENARIO/Entities".into(),
    }];
    let found = vec![
        issue(Level::Error, "ids.unique", "the id \"5\" is taken", 40),
        issue(Level::Information, "names", "the name is empty", 7),
        by_element,
        elsewhere,
    ];
    let died = |id| {
        checker(
            id,
            Some(Status::Error),
            "Error: it died. 0 issues.",
            Vec::new(),
        )
    };
    let failed: Vec<_> = ["check_b", "check_c", "check_d", "check_e"]
        .map(died)
        .into();
    let text = report(&[
        result("scenarios/cut, in:1.xosc", vec![completed(found)]),
        result("maps/ring.xodr", vec![completed(Vec::new())]),
        result("maps/slow.xodr", failed),
        result(
            "maps/old.xodr",
            vec![blocked("check_b"), blocked("check_c")],
        ),
        result("maps/none.xodr", Vec::new()),
        result(
            "maps/silent.xodr",
            vec![checker("check_b", None, "", Vec::new())],
        ),
    ]);
    insta::assert_snapshot!(text);
}

#[test]
fn undetermined_verdict_is_error_of_its_file() {
    let nobody = result("maps/none.xodr", Vec::new());
    assert_eq!(nobody.verdict, Verdict::Undetermined);
    let commands = runner::run(&report(&[nobody]));
    let error = commands.iter().find(|it| it.name == "error").unwrap();
    assert_eq!(error.properties["file"], "maps/none.xodr");
    let said = "the file is undetermined, not accepted: no checker has checked the file";
    assert_eq!(error.data, said);
}

#[test]
fn annotations_keep_special_characters() {
    let text = "50 %, not %0A: see a::b";
    let path = "maps/a,b:c%3A##[group]=.xodr";
    let found = completed(vec![issue(Level::Warning, "odd.rule", text, 3)]);
    let commands = runner::run(&report(&[result(path, vec![found])]));
    let warning = commands.iter().find(|it| it.name == "warning").unwrap();
    assert_eq!(warning.data, text);
    let properties: Vec<(&str, &str)> = warning
        .properties
        .iter()
        .map(|(key, value)| (key.as_str(), value.as_str()))
        .collect();
    let expected = [
        ("col", "5"),
        ("file", path),
        ("line", "3"),
        ("title", "odd.rule"),
    ];
    assert_eq!(properties, expected);
}

#[test]
fn oversized_line_number_stays_only_in_log() {
    let found = completed(vec![issue(Level::Error, "a", "x", u64::MAX)]);
    let text = report(&[result("a.xodr", vec![found])]);
    assert!(text.contains("a.xodr:18446744073709551615:5: error: x"));
    let commands = runner::run(&text);
    let error = commands.iter().find(|it| it.name == "error").unwrap();
    assert!(!error.properties.contains_key("line"));
}

/// Texts that try to be commands.
const HOSTILE: &[&str] = &[
    "::error::x",
    "  ::set-output name=a::b",
    "x\n::add-mask::secret",
    "x\r::stop-commands::token",
    "x\r\n::endgroup::",
    "x\u{2028}::error::y\u{85}::error::z",
    "##[add-mask]secret",
    "x ##[group]y",
    "###[error]x",
    "#\u{ad}#\u{200b}[set-env name=a]b",
    "#\u{feff}\u{e0001}#[debug]x",
    "::error::%0A::error::x%0D",
    "##",
    "[group]x",
    "a: error: b [c]",
    "x: accepted: no findings",
    "%0A::error::x",
    "\u{1b}[2K\0\u{7}\u{202e}::error::",
    "",
    " ",
];

#[test]
fn hostile_text_never_becomes_command() {
    for hostile in HOSTILE {
        for other in HOSTILE {
            let mut found = issue(Level::Error, "x", hostile, 3);
            found.rule_uid = (*other).to_owned();
            let mut named = issue(Level::Information, "x", other, 3);
            named.rule_uid = String::new();
            named.locations[0].places = vec![Location::Xml {
                xpath: (*hostile).to_owned(),
            }];
            let mut moved = issue(Level::Warning, "x", other, 3);
            moved.locations[0].elsewhere = Some(OtherPlace {
                path: (*hostile).to_owned(),
                ..OtherPlace::default()
            });
            let checkers = vec![
                checker(
                    other,
                    Some(Status::Error),
                    hostile,
                    vec![found, named, moved],
                ),
                checker(hostile, Some(Status::Error), other, Vec::new()),
                blocked(hostile),
            ];
            let mut result = result(hostile, checkers);
            result.results.bundles[0].name = (*hostile).to_owned();
            let commands = runner::run(&report(&[result]));
            // The commands are the group and its end, three findings, and the failed checkers,
            // which have one reason or two.
            assert!((6..=7).contains(&commands.len()), "{commands:?}");
        }
    }
}

#[test]
fn ten_thousand_findings_are_logged_and_limit_is_stated() {
    let long = "ä ".repeat(LONGEST_TEXT);
    let of = |level, count: u64, text: &str| {
        let rows = 1..=count;
        let issues = rows.map(|row| issue(level, &format!("rule_{}", row % 20), text, row));
        issues.collect::<Vec<_>>()
    };
    let text = report(&[
        result("a.xodr", vec![completed(of(Level::Error, 9000, "broken"))]),
        result("b.xodr", vec![completed(of(Level::Warning, 4, "odd"))]),
        result(
            "c.xodr",
            vec![completed(of(Level::Information, 996, &long))],
        ),
    ]);
    let logged = text
        .lines()
        .filter(|line| line.contains("[asam.net:"))
        .count();
    assert_eq!(logged, 10_000);
    let commands = runner::run(&text);
    let named = |name| commands.iter().filter(move |it| it.name == name);
    assert_eq!(named("error").count(), 10);
    assert_eq!(named("warning").count(), 4);
    assert_eq!(named("notice").count(), 10);
    let mut titles: Vec<_> = named("error").map(|it| &it.properties["title"]).collect();
    titles.sort();
    titles.dedup();
    assert_eq!(titles.len(), 10, "every error has a different rule");
    assert_eq!(
        commands.last().unwrap().data,
        "10 of 9000 errors, 4 of 4 warnings, 9 of 996 information are annotated: GitHub accepts no more from one step. The log of the step contains all of them."
    );
    assert!(text.len() < 4_000_000, "{} bytes", text.len());
}

#[test]
fn each_file_is_annotated_while_room_remains() {
    let files: Vec<_> = (0..30)
        .map(|number| {
            let rows = 1..=50;
            let issues = rows.map(|row| issue(Level::Error, "often", "x", row));
            result(
                &format!("{number:02}.xodr"),
                vec![completed(issues.collect())],
            )
        })
        .collect();
    let commands = runner::run(&report(&files));
    let errors = commands.iter().filter(|it| it.name == "error");
    let files: Vec<_> = errors.map(|it| it.properties["file"].as_str()).collect();
    let expected: Vec<_> = (0..10).map(|number| format!("{number:02}.xodr")).collect();
    assert_eq!(files, expected);
}

#[test]
fn report_of_no_file_is_empty() {
    assert_eq!(report(&[]), "");
}

#[test]
fn foreign_and_torn_sections_are_dropped() {
    let whole = result("a.xodr", vec![completed(Vec::new())]);
    let found = completed(vec![issue(Level::Error, "x", "y", 1)]);
    let torn = result("b.xodr", vec![found]);
    let text = report(&[whole.clone(), torn]);
    let end = text.find("::endgroup::").unwrap();
    assert_eq!(Annotations.split(&text[..end + 5]), sections(&[whole]));
    let foreign = "a note\nname: value\nname: maybe: so\n::group::x\n::endgroup::\n";
    assert!(Annotations.split(foreign).is_empty());
}

#[test]
fn restarted_daemon_keeps_earlier_report() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("github.txt");
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
        sent.params = vec![Param {
            name: "OutputFile".into(),
            value: path.to_str().unwrap().into(),
        }];
        sent
    };
    let found = completed(vec![issue(Level::Error, "x", "y", 1)]);
    let first = sent("b.xodr", vec![found]);
    let second = sent("a.xodr", vec![blocked("check_b")]);
    make(false).report(&first, &NoSources).unwrap();
    make(true).report(&second, &NoSources).unwrap();
    let written = std::fs::read_to_string(&path).unwrap();
    assert_eq!(written, report(&[second, first]));
}
