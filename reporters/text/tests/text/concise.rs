//! Tests of the format with one line for each finding.

use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::BLOCKED;
use qcbus_formats::xqar::{Checker, Issue, Level, Metadata, Param, Status};
use qcbus_messages::{ResultMessage, Verdict};
use qcbus_report_text::{CONCISE, Folding, concise};
use qcbus_reporter_samples as samples;
use qcbus_reporter_sdk::{NoSources, Reporter, Setting};

fn issue(level: Level, text: &str, row: u64) -> Issue {
    samples::issue(
        level,
        "asam.net:xodr:1.4.0:ids.id_unique_in_class",
        text,
        (row, 3),
    )
}

fn result(path: &str, verdict: Verdict, checkers: Vec<Checker>) -> ResultMessage {
    ResultMessage {
        verdict,
        ..samples::result(path, checkers)
    }
}

fn checker(status: Status, summary: &str, issues: Vec<Issue>) -> Checker {
    samples::checker("check_x", Some(status), summary, issues)
}

#[test]
fn errors_come_first_and_each_finding_is_one_line() {
    let mut elsewhere = issue(Level::Error, "in\nthe map", 7);
    elsewhere.locations[0].elsewhere = Some(OtherPlace {
        path: "/farm/town.xodr".into(),
        row: 99,
        column: 1,
        xpath: None,
    });
    let issues = vec![
        issue(Level::Warning, "odd", 1),
        issue(Level::Error, "a\u{1b}[2Jb", 9),
        elsewhere,
        issue(Level::Information, "", 0),
    ];
    let checkers = vec![checker(Status::Completed, "", issues)];
    let text = concise(
        &result("a.xosc", Verdict::Rejected, checkers),
        false,
        Folding::None,
    );
    insta::assert_snapshot!(text, @r"
    a.xosc:7:3: error: in the map [ids.id_unique_in_class]
    a.xosc:9:3: error: a�[2Jb [ids.id_unique_in_class]
    a.xosc:1:3: warning: odd [ids.id_unique_in_class]
    a.xosc: information: (no description) [ids.id_unique_in_class]
    ");
}

#[test]
fn folded_findings_are_counted() {
    let issues = (1..=12)
        .map(|row| issue(Level::Error, "again", row))
        .collect();
    let folded = result(
        "a.xodr",
        Verdict::Rejected,
        vec![checker(Status::Completed, "", issues)],
    );
    let text = concise(&folded, false, Folding::After(2));
    insta::assert_snapshot!(text, @r"
    a.xodr:1:3: error: again [ids.id_unique_in_class]
    a.xodr:2:3: error: again [ids.id_unique_in_class]
    a.xodr: error: and 10 more of this rule [ids.id_unique_in_class]
    ");
    assert_eq!(concise(&folded, false, Folding::None).lines().count(), 12);
}

#[test]
fn undetermined_verdict_is_always_explained() {
    let mut blocked = checker(
        Status::Skipped,
        "Skipped: `check_y` failed. 0 issues.",
        Vec::new(),
    );
    blocked.metadata.push(Metadata {
        key: BLOCKED.into(),
        ..Metadata::default()
    });
    let failed = checker(Status::Error, "Error: it died. 0 issues.", Vec::new());
    let text = |checkers| {
        let open = result("a.xodr", Verdict::Undetermined, checkers);
        concise(&open, false, Folding::None)
    };
    assert_eq!(
        text(vec![blocked.clone(), failed]),
        "a.xodr: undetermined: 1 checker gave no answer (xodrBundle/check_x): it died.; \
         1 checker gave no answer (xodrBundle/check_x): `check_y` failed.\n"
    );
    assert_eq!(
        text(vec![blocked]),
        "a.xodr: undetermined: 1 checker gave no answer (xodrBundle/check_x): `check_y` failed.\n"
    );
    assert_eq!(
        text(Vec::new()),
        "a.xodr: undetermined: no checker has checked the file\n"
    );
    assert_eq!(
        concise(
            &result("a.xodr", Verdict::Accepted, Vec::new()),
            false,
            Folding::None
        ),
        ""
    );
}

#[test]
fn restarted_daemon_keeps_lines_of_other_files() {
    let dir = tempfile::tempdir().unwrap();
    let all = dir.path().join("all.txt");
    let new_reporter = || -> Box<dyn Reporter> {
        (CONCISE.make)(&Setting {
            keep: true,
            is_run: false,
            ..samples::plain_run()
        })
    };
    let of = |path: &str, text: &str| {
        let issues = vec![issue(Level::Error, text, 4)];
        let mut result = result(
            path,
            Verdict::Rejected,
            vec![checker(Status::Completed, "", issues)],
        );
        result.params = vec![Param {
            name: "OutputFile".into(),
            value: all.to_string_lossy().into_owned(),
        }];
        result
    };
    let mut first = new_reporter();
    first
        .report(&of("b: error: x.xodr", "one"), &NoSources)
        .unwrap();
    first.report(&of("a:1.xodr", "two"), &NoSources).unwrap();
    drop(first);
    let mut second = new_reporter();
    second.report(&of("a:1.xodr", "three"), &NoSources).unwrap();
    let text = std::fs::read_to_string(&all).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.sort_unstable();
    assert_eq!(
        lines,
        [
            "a:1.xodr:4:3: error: three [ids.id_unique_in_class]",
            "b: error: x.xodr:4:3: error: one [ids.id_unique_in_class]",
        ]
    );
}
