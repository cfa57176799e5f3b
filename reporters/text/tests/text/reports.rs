//! Tests of the text of whole reports, as users see it.

use std::collections::BTreeMap;

use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::BLOCKED;
use qcbus_formats::xqar::{
    Checker, CheckerBundle, DomainInfo, InfoElement, Issue, Level, Location, Locations, Metadata,
    Param, Results, Status,
};
use qcbus_messages::{Digest, JobId, ResultMessage, Verdict};
use qcbus_report_text::{Options, REPORTER, render};
use qcbus_reporter_samples::plain_run;
use qcbus_reporter_sdk::{Line, NoSources, Reporter, Setting, Sources};

const UNIQUE: &str = "asam.net:xodr:1.4.0:ids.id_unique_in_class";

/// Files with a few lines.
struct Pages(BTreeMap<&'static str, Vec<&'static str>>);

impl Sources for Pages {
    fn line(&self, path: &str, row: u64, _: u64) -> Option<Line> {
        let row = usize::try_from(row).ok()?.checked_sub(1)?;
        Some(Line::from(*self.0.get(path)?.get(row)?))
    }
}

fn pages() -> Pages {
    let scenario = vec![
        "<?xml version=\"1.0\"?>",
        "<OpenSCENARIO>",
        "  <RoadNetwork>",
        "    <LogicFile filepath=\"harbour.xodr\"/>",
    ];
    let map = vec![
        "<?xml version=\"1.0\"?>",
        "<OpenDRIVE>",
        "\t<road name=\"Kai\" id=\"5\" length=\"20\" junction=\"-1\"/>",
        "\t<road name=\"道路\" id=\"5\" length=\"30\" junction=\"-1\"/>",
        "</OpenDRIVE>",
    ];
    Pages(BTreeMap::from([
        ("/farm/maps/harbour.xodr", map),
        ("/farm/lane.xosc", scenario),
    ]))
}

fn at(row: u64, column: u64, xpath: &str, description: &str) -> Locations {
    let file = Location::File {
        row,
        column,
        offset: None,
    };
    let xml = Location::Xml {
        xpath: xpath.into(),
    };
    Locations {
        description: description.into(),
        elsewhere: None,
        places: vec![file, xml],
    }
}

fn issue(level: Level, description: &str, uid: &str, locations: Vec<Locations>) -> Issue {
    Issue {
        id: 0,
        description: description.into(),
        level,
        rule_uid: uid.into(),
        locations,
        domain_info: Vec::new(),
    }
}

fn checker(id: &str, status: Status, summary: &str, issues: Vec<Issue>) -> Checker {
    Checker {
        id: id.into(),
        summary: summary.into(),
        status: Some(status),
        issues,
        ..Checker::default()
    }
}

fn result(path: &str, verdict: Verdict, checkers: Vec<Checker>) -> ResultMessage {
    let bundle = CheckerBundle {
        name: "xodrBundle".into(),
        checkers,
        ..CheckerBundle::default()
    };
    ResultMessage {
        job: JobId(1),
        input: format!("/farm/{path}"),
        display_path: path.into(),
        xqar: format!("/out/{path}.xqar"),
        verdict,
        digest: Digest([7; 32]),
        config: Digest::default(),
        document: None,
        results: Results {
            version: "1.0.0".into(),
            bundles: vec![bundle],
        },
        rules: BTreeMap::from([(
            UNIQUE.to_owned(),
            "Elements of one class are told apart by their ids alone. When two roads share an id, \
             a link to it may lead to either, and simulators choose differently."
                .to_owned(),
        )]),
        params: Vec::new(),
    }
}

fn duplicates() -> ResultMessage {
    let twice = |row, xpath: &str| {
        issue(
            Level::Error,
            "the id \"5\" of this road is taken; ids of roads must differ",
            UNIQUE,
            vec![
                at(row, 2, xpath, "a road with the id of another"),
                at(3, 19, "/OpenDRIVE/road[1]/@id", "the first one"),
            ],
        )
    };
    let mut second = twice(4, "/OpenDRIVE/road[2]");
    second.locations[0].places.push(Location::Road {
        road_id: "5".into(),
        s: 0.0,
        t: -1.5,
    });
    let name = issue(
        Level::Warning,
        "the name \"道路\" is not in the naming scheme",
        "",
        vec![at(4, 14, "/OpenDRIVE/road[2]/@name", "")],
    );
    let checkers = vec![
        checker("check_name", Status::Completed, "", vec![name]),
        checker(
            "check_ids",
            Status::Completed,
            "2 issue(s) are found.",
            vec![second, twice(9, "/OpenDRIVE/road[7]")],
        ),
    ];
    result("maps/harbour.xodr", Verdict::Rejected, checkers)
}

fn text(result: &ResultMessage) -> String {
    render(result, &Options::default(), &pages())
}

#[test]
fn issues_follow_file_order_and_rule_is_explained_once() {
    insta::assert_snapshot!(text(&duplicates()));
}

#[test]
fn accepted_file_is_two_lines_and_hash() {
    let checkers = vec![checker("check_ids", Status::Completed, "", Vec::new())];
    insta::assert_snapshot!(text(&result("a.xodr", Verdict::Accepted, checkers)));
}

#[test]
fn checkers_that_did_not_run_are_listed_with_reason() {
    let newer = "The rule holds from 1.7.0 on, the file is of 1.4. 0 issue(s) are found.";
    let checkers = vec![
        checker("check_ids", Status::Completed, "", Vec::new()),
        checker("check_lane_a", Status::Skipped, newer, Vec::new()),
        checker("check_lane_b", Status::Skipped, newer, Vec::new()),
        checker("check_signal", Status::Skipped, "", Vec::new()),
        checker(
            "check_geometry",
            Status::Error,
            "It did not end within 30 s and was stopped.",
            Vec::new(),
        ),
    ];
    insta::assert_snapshot!(text(&result("a.xodr", Verdict::Undetermined, checkers)));
}

#[test]
fn inapplicable_checkers_are_only_counted() {
    let options = Options {
        inapplicable: false,
        ..Options::default()
    };
    let newer = "The rule holds from 1.7.0 on, the file is of 1.4. 0 issue(s) are found.";
    let mut checkers = vec![
        checker("check_ids", Status::Completed, "", Vec::new()),
        checker("check_lane_a", Status::Skipped, newer, Vec::new()),
        checker("check_lane_b", Status::Skipped, newer, Vec::new()),
    ];
    let accepted = result("a.xodr", Verdict::Accepted, checkers.clone());
    let said = render(&accepted, &options, &pages());
    assert!(said.contains("1 completed, 2 skipped that do not apply to the file\n  sha256"));
    let mut blocked = checker(
        "check_road",
        Status::Skipped,
        "The road is broken.",
        Vec::new(),
    );
    blocked.metadata.push(Metadata {
        key: BLOCKED.into(),
        value: "check_ids".into(),
        description: String::new(),
    });
    checkers.push(blocked);
    let undetermined = result("a.xodr", Verdict::Undetermined, checkers);
    let said = render(&undetermined, &options, &pages());
    assert!(said.contains("3 skipped, 2 of which do not apply to the file\n"));
    assert!(said.contains("  skipped, 1: The road is broken.\n"));
    assert!(!said.contains("The rule holds"));
}

#[test]
fn place_in_other_file_is_shown_there() {
    let mut found = issue(
        Level::Error,
        "the scenario's map has two roads \"5\"",
        UNIQUE,
        vec![at(
            4,
            5,
            "/OpenSCENARIO/RoadNetwork/LogicFile",
            "the second one",
        )],
    );
    let place = OtherPlace {
        path: "/farm/maps/harbour.xodr".into(),
        row: 4,
        column: 2,
        xpath: Some("/OpenDRIVE/road[2]".into()),
    };
    found.locations[0].elsewhere = Some(place);
    let checkers = vec![checker("check_map", Status::Completed, "", vec![found])];
    insta::assert_snapshot!(text(&result("lane.xosc", Verdict::Rejected, checkers)));
}

#[test]
fn invalid_data_of_other_tools_is_tolerated() {
    let zero = at(0, 0, "", "somewhere");
    let no_column = at(3, 0, "/OpenDRIVE/road", "");
    let far = at(u64::MAX, u64::MAX, "//*", "");
    let escape = "a\u{1b}[2Jb\nsecond line";
    let mut issues = vec![
        issue(Level::Information, escape, "", vec![zero]),
        issue(Level::Information, "", "x:y", vec![no_column, far]),
        issue(Level::Warning, "no place at all", "x:y", Vec::new()),
    ];
    issues[2].domain_info.push(DomainInfo {
        name: "vendor".into(),
        content: vec![InfoElement {
            name: "Thing".into(),
            attributes: vec![("a".into(), "1".into())],
            text: " some\n text".into(),
            children: vec![InfoElement::default()],
        }],
    });
    let mut only = checker("check_x", Status::Completed, "", issues);
    only.status = None;
    let result = result("maps/harbour.xodr", Verdict::Accepted, vec![only]);
    insta::assert_snapshot!(text(&result));
}

#[test]
fn coloured_report_has_same_text() {
    let options = Options {
        color: true,
        ..Options::default()
    };
    let colored = render(&duplicates(), &options, &pages());
    assert!(colored.contains("\u{1b}["));
    let mut plain = String::new();
    let mut rest = colored.as_str();
    while let Some((before, after)) = rest.split_once('\u{1b}') {
        plain.push_str(before);
        rest = after.split_once('m').map_or("", |(_, after)| after);
    }
    plain.push_str(rest);
    assert_eq!(plain, text(&duplicates()));
}

#[test]
fn descriptions_appear_without_sources() {
    let text = render(&duplicates(), &Options::default(), &NoSources);
    assert!(text.contains("= here: the first one"), "{text}");
}

#[test]
fn reports_go_beside_result_or_into_one_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
    let mut first = duplicates();
    first.xqar = path("a.xodr.xqar");
    new_reporter(true, false).report(&first, &pages()).unwrap();
    let own = std::fs::read_to_string(path("a.xodr.txt")).unwrap();
    assert_eq!(own, text(&first));

    let all = Param {
        name: "OutputFile".into(),
        value: path("all.txt"),
    };
    let mut other = result("a.xodr", Verdict::Accepted, Vec::new());
    (first.params, other.params) = (vec![all.clone()], vec![all]);
    let mut reporter = new_reporter(true, false);
    for result in [&first, &other, &first] {
        reporter.report(result, &pages()).unwrap();
    }
    reporter.finish().unwrap();
    let expected = format!(
        "==== a.xodr ====\n{}\n==== maps/harbour.xodr ====\n{}\n",
        text(&other),
        text(&first)
    );
    assert_eq!(std::fs::read_to_string(path("all.txt")).unwrap(), expected);

    let mut again = new_reporter(true, true);
    again.report(&other, &pages()).unwrap();
    assert_eq!(std::fs::read_to_string(path("all.txt")).unwrap(), expected);
}

#[test]
fn invalid_width_is_refused_with_allowed_range() {
    let mut result = duplicates();
    result.params.push(Param {
        name: "LineWidth".into(),
        value: "wide".into(),
    });
    let error = new_reporter(false, false)
        .report(&result, &NoSources)
        .unwrap_err();
    insta::assert_snapshot!(
        error,
        @r#"use the parameter LineWidth="wide": a whole number from 40 to 1000 is needed"#
    );
}

fn new_reporter(color: bool, keep: bool) -> Box<dyn Reporter> {
    (REPORTER.make)(&Setting {
        color,
        keep,
        is_run: false,
        ..plain_run()
    })
}

#[test]
fn findings_that_differ_only_in_numbers_are_shown_once() {
    let wide = |row: u64| {
        let text = format!("lane `-{row}` is {row}.5 m wide");
        issue(Level::Warning, &text, UNIQUE, vec![at(row, 2, "/a", "")])
    };
    let narrow = issue(
        Level::Warning,
        "lane `-1` is 0.1 m narrow",
        UNIQUE,
        vec![at(5, 2, "/a", "")],
    );
    let said = |count: u64| {
        let issues = (1..=count).map(wide).chain([narrow.clone()]).collect();
        let found = checker("check_width", Status::Completed, "", issues);
        let options = Options {
            merges: true,
            ..Options::default()
        };
        let result = result("a.xodr", Verdict::Accepted, vec![found]);
        render(&result, &options, &pages())
    };
    let few = said(3);
    assert!(
        few.contains("3.5 m wide") && !few.contains("= also"),
        "{few}"
    );
    let many = said(4);
    assert!(
        many.contains("1.5 m wide") && many.contains("0.1 m narrow"),
        "{many}"
    );
    assert!(!many.contains("2.5 m wide"), "{many}");
    assert!(
        many.contains("3 more findings like this, in rows 2, 3, 4; `--verbose`"),
        "{many}"
    );
    let more = said(12);
    assert!(
        more.contains("11 more findings like this, in rows 2, 3, 4, 5, 6, 7, 8, 9 and 3 others;"),
        "{more}"
    );
}

#[test]
fn many_findings_show_only_their_main_places_in_full() {
    let words = ["one", "two", "three", "four", "five", "six", "seven"];
    let said = |count: usize, level: Level| {
        let finding = |(row, word): (u64, &&str)| {
            let places = vec![at(row, 2, "/a", ""), at(1, 2, "/a", "the other road")];
            issue(level, &format!("fault {word}"), UNIQUE, places)
        };
        let issues = (1_u64..).zip(words.iter().take(count)).map(finding);
        let found = checker("check_width", Status::Completed, "", issues.collect());
        let options = Options {
            merges: true,
            ..Options::default()
        };
        let result = result("a.xodr", Verdict::Rejected, vec![found]);
        render(&result, &options, &pages())
    };
    let few = said(6, Level::Error);
    assert_eq!(few.matches("::: ").count(), 6, "{few}");
    assert!(!few.contains("= see"), "{few}");
    let many = said(7, Level::Error);
    assert_eq!(many.matches("::: ").count(), 0, "{many}");
    let shown = many.matches("= see: the other road (row 1)").count();
    assert_eq!(shown, 7, "{many}");
    assert_eq!(many.matches("= at: /a").count(), 7, "{many}");
    let information = said(7, Level::Information);
    assert!(!information.contains("= at: /a"), "{information}");
    assert_eq!(information.matches("--> a.xodr:").count(), 7);
}
