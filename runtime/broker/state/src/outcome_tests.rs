use std::collections::BTreeMap;

use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::{Asked, CheckerOutcome, Ending, NoPlaces, PoolInput, Scope, pool};
use qcbus_formats::xqar::{
    DomainInfo, InfoElement, Issue, Level, Location, Locations, Metadata, Param, Status,
};
use qcbus_messages::CheckerInfo;
use qcbus_types::{Pending, clip, clip_text, weight};

use super::*;

fn offers() -> Arc<Catalogue> {
    let checker = |id: &str| CheckerInfo {
        id: id.into(),
        description: format!("what {id} looks at").into(),
        rule_uids: [format!("example.org:xodr:1.0.0:{id}")]
            .into_iter()
            .collect(),
        kinds: vec![FileKind::Xodr],
        default_on: true,
        level: Level::Error,
        params: Vec::new(),
    };
    Arc::new(Catalogue {
        checkers: vec![checker("first"), checker("second")],
        ..Catalogue::default()
    })
}

fn task(pending: BTreeMap<u32, Pending>) -> Task {
    Task {
        state: TaskState::Done,
        version: "1".to_owned(),
        catalogue: Some(offers()),
        version_digest: None,
        demanded: [0].into(),
        pending: Arc::new(pending),
        pending_bytes: 0,
        micros: 7,
        quarantined: false,
        strikes: 0,
        missing: false,
    }
}

#[test]
fn result_has_checker_ending_and_known_facts() {
    let param = Param {
        name: "tolerance".to_owned(),
        value: "0.1".to_owned(),
    };
    let fact = Metadata {
        key: "roads".to_owned(),
        value: "3".to_owned(),
        description: "how many there are".to_owned(),
    };
    let pending = Pending {
        issues: Vec::new(),
        withheld: 0,
        done_bytes: 0,
        done: Some((Ending::Completed, vec![param.clone()], vec![fact.clone()])),
    };
    let outcome = outcome("Bundle", &task(BTreeMap::from([(0, pending)])));
    let expected = CheckerOutcome {
        id: "first".into(),
        description: "what first looks at".into(),
        rule_uids: ["example.org:xodr:1.0.0:first"].into_iter().collect(),
        ending: Some(Ending::Completed),
        params: vec![param],
        metadata: vec![fact],
        ..CheckerOutcome::default()
    };
    assert_eq!(outcome.said().checkers, [expected]);
    let asked = Asked {
        asked: 1,
        offered: 2,
    };
    assert_eq!(outcome.said().asked, Some(asked));
    assert_eq!(outcome.micros, 7);
}

fn an_issue(text: &str) -> Issue {
    Issue {
        id: 0,
        description: text.to_owned(),
        level: Level::Error,
        rule_uid: String::new(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}

/// Returns the entry of a checker with this ending and these findings in the result: status, reason, findings.
fn in_the_result(ending: Ending, issues: Vec<Issue>) -> (Status, String, Vec<String>) {
    let pending = Pending {
        issues,
        withheld: 0,
        done_bytes: 0,
        done: Some((ending, Vec::new(), Vec::new())),
    };
    let outcome = outcome("Bundle", &task(BTreeMap::from([(0, pending)])));
    let input = PoolInput {
        input_file: "/farm/a.xodr",
        config: None,
        bundles: vec![outcome.said()],
        remarks: Vec::new(),
        scope: Scope::Alone,
        separate: true,
        version: "1",
        build_date: "",
    };
    let pooled = pool(input, &mut NoPlaces);
    let checker = &pooled.results.bundles[0].checkers[0];
    let found = checker.issues.iter().map(|it| it.description.clone());
    let status = checker.status.unwrap();
    (status, checker.summary.to_string(), found.collect())
}

#[test]
fn skipped_checker_with_findings_fails_and_keeps_them() {
    let reason = || "it is for versions from 1.7".to_owned();
    let not_applicable = Ending::NotApplicable { reason: reason() };
    let blocked = Ending::Blocked {
        by: vec!["second".to_owned()],
        reason: reason(),
    };
    for ending in [not_applicable, blocked] {
        let (status, ..) = in_the_result(ending.clone(), Vec::new());
        assert_eq!(status, Status::Skipped);
        let issues = vec![an_issue("too steep"), an_issue("too narrow")];
        let (status, why, found) = in_the_result(ending, issues);
        assert_eq!(status, Status::Error);
        assert!(why.contains("skipped, but also reported issues"), "{why}");
        assert!(why.contains(&reason()), "{why}");
        assert_eq!(found, ["too steep", "too narrow"]);
    }
}

#[test]
fn findings_of_failed_checker_are_kept() {
    let failed = Ending::Failed {
        reason: "it crashed".to_owned(),
    };
    let (status, why, found) = in_the_result(failed, vec![an_issue("too steep")]);
    assert_eq!((status, found), (Status::Error, vec!["too steep".into()]));
    assert!(why.contains("it crashed"), "{why}");
}

#[test]
fn selected_checkers_of_other_file_kind_are_not_applicable() {
    let outcome = not_applicable("Bundle", "1", &offers(), vec![1], FileKind::Xosc);
    let reason = "Bundle does not check .xosc files".to_owned();
    let said = outcome.said();
    let [only] = said.checkers.as_slice() else {
        panic!("{:?}", said.checkers);
    };
    assert_eq!(&*only.id, "second");
    assert_eq!(only.ending, Some(Ending::NotApplicable { reason }));
}

/// Checks that every text from a bundle counts, byte for byte, because the weight limits the kept data.
#[test]
fn issue_weight_grows_with_each_text() {
    let place = |text: &str, which: usize| {
        let at = |number: usize| if which == number { text } else { "" }.to_owned();
        let child = InfoElement {
            name: at(5),
            ..InfoElement::default()
        };
        let element = InfoElement {
            name: at(6),
            attributes: vec![(at(7), at(8))],
            text: at(9),
            children: vec![child],
        };
        Issue {
            id: 0,
            description: at(0),
            level: Level::Error,
            rule_uid: at(1),
            locations: vec![Locations {
                description: at(2),
                elsewhere: Some(OtherPlace {
                    path: at(3),
                    row: 1,
                    column: 1,
                    xpath: Some(at(4)),
                }),
                places: vec![Location::Xml { xpath: at(10) }],
            }],
            domain_info: vec![DomainInfo {
                name: at(11),
                content: vec![element],
            }],
        }
    };
    let empty = weight(&place("", 0));
    for which in 0..12 {
        let grown = weight(&place(&"x".repeat(1000), which));
        assert_eq!(grown, empty + 1000, "text {which}");
    }
    let mut more = place("", 0);
    let known = more.locations[0].places[0].clone();
    more.locations[0].places.push(known);
    assert!(weight(&more) > empty, "each place adds weight");
}

#[test]
fn text_is_cut_at_character_boundary_with_ellipsis() {
    let cut = |text: &str, most: usize| {
        let mut text = text.to_owned();
        clip_text(&mut text, most);
        text
    };
    assert_eq!(cut("abcd", 4), "abcd");
    assert_eq!(cut("abcd", 3), "abc…");
    assert_eq!(cut("aäö", 2), "a…", "`ä` has two bytes");
    assert_eq!(cut("aäö", 3), "aä…");
    assert_eq!(cut("aäö", 5), "aäö");
    assert_eq!(cut("ä", 0), "…");
}

/// Checks that a cut text releases its memory. Otherwise a few bytes would hold megabytes.
#[test]
fn cut_text_releases_its_memory() {
    let mut text = "x".repeat(1 << 20);
    clip_text(&mut text, 100);
    assert!(text.capacity() < 200, "{}", text.capacity());
    let mut issue = an_issue("short");
    issue.locations = vec![Locations::default(); 10_000];
    clip(&mut issue, 100);
    assert_eq!(issue.locations.len(), 64);
    assert!(issue.locations.capacity() < 100);
}

#[test]
fn road_and_message_names_count_to_weight() {
    let called = |text: &str, which: usize| {
        let at = |number: usize| if which == number { text } else { "" }.to_owned();
        let road = Location::Road {
            road_id: at(0),
            s: 0.0,
            t: 0.0,
        };
        let message = Location::Message {
            index: 0,
            channel: Some(at(1)),
            field: Some(at(2)),
            time: None,
        };
        let places = vec![road, message];
        Issue {
            locations: vec![Locations {
                places,
                ..Locations::default()
            }],
            ..an_issue("")
        }
    };
    for which in 0..3 {
        let grown = weight(&called(&"x".repeat(1000), which));
        assert_eq!(grown, weight(&called("", which)) + 1000, "text {which}");
    }
}

#[test]
fn oversized_finding_is_cut() {
    let long = "x".repeat(2000);
    let place = Locations {
        description: long.clone(),
        elsewhere: Some(OtherPlace {
            path: long.clone(),
            row: 1,
            column: 1,
            xpath: Some(long.clone()),
        }),
        places: vec![Location::Xml { xpath: "/a".into() }; 100],
    };
    let fact = DomainInfo {
        name: "qcbus.location".to_owned(),
        content: Vec::new(),
    };
    let mut issue = Issue {
        id: 0,
        description: long.clone(),
        level: Level::Error,
        rule_uid: long,
        locations: vec![place; 100],
        domain_info: vec![fact; 100],
    };
    clip(&mut issue, 1000);
    let cut = |text: &str, most: usize| text.len() == most + "…".len() && text.ends_with('…');
    assert!(cut(&issue.description, 1000));
    assert!(cut(&issue.rule_uid, 512));
    assert_eq!((issue.locations.len(), issue.domain_info.len()), (64, 16));
    for place in &issue.locations {
        let elsewhere = place.elsewhere.as_ref().unwrap();
        let texts = [
            &place.description,
            &elsewhere.path,
            elsewhere.xpath.as_ref().unwrap(),
        ];
        assert!(texts.into_iter().all(|text| cut(text, 1000)));
        assert_eq!(place.places.len(), 16);
    }
}
