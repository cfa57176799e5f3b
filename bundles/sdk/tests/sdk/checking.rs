//! Tests of gates, preconditions, panics, backports and limits, with rules made for them.

use crate::common;
use std::path::Path;

use qcbus_document::Document;
use qcbus_formats::pool::{CheckerOutcome, Ending};
use qcbus_formats::xqar::Status;
use qcbus_sdk::{
    AnyRule, Backport, Bundle, Checker, Level, Loaded, Model, Param, Permits, Plan, Rule, Sink,
    Subject, Unbuilt, examine, examine_timed,
};

const LIMIT: Param = Param::number("limit", 0.0, "m", "a limit");

static FINDS_ERRORS: Rule<Document> = Rule {
    id: "finds_errors",
    uids: &["x:xodr:1.0.0:a.b"],
    run: every_road,
    ..Rule::DEFAULTS
};
static PANICS: Rule<Document> = Rule {
    id: "panics",
    uids: &["x:xodr:1.0.0:a.c"],
    run: |document, found| {
        every_road(document, found);
        panic!("on purpose");
    },
    ..Rule::DEFAULTS
};
static GIVES_UP: Rule<Document> = Rule {
    id: "gives_up",
    uids: &["x:xodr:1.0.0:a.l"],
    run: |document, found| {
        every_road(document, found);
        found.fail("it raised KeyError: 'id'\nin line 3");
        found.fail("and once more");
    },
    ..Rule::DEFAULTS
};
static AFTER_ERRORS: Rule<Document> = Rule {
    id: "after_errors",
    uids: &["x:xodr:1.0.0:a.d"],
    after: &["finds_errors"],
    run: every_road,
    ..Rule::DEFAULTS
};
static AFTER_SKIPPED: Rule<Document> = Rule {
    id: "after_skipped",
    uids: &["x:xodr:1.0.0:a.e"],
    after: &["after_errors"],
    run: every_road,
    ..Rule::DEFAULTS
};
static NEWER: Rule<Document> = Rule {
    id: "newer",
    uids: &["x:xodr:1.8.0:a.f"],
    versions: "1.8.0..",
    run: every_road,
    ..Rule::DEFAULTS
};
static LOWERED: Rule<Document> = Rule {
    id: "lowered",
    uids: &["x:xodr:1.8.0:a.g"],
    versions: "1.8.0..",
    backport: Backport::Lower { since: "1.4.0" },
    run: every_road,
    ..Rule::DEFAULTS
};
static SEPARATE: Rule<Document> = Rule {
    id: "separate",
    uids: &["x:xodr:1.8.0:a.h"],
    versions: "1.8.0..",
    backport: Backport::Separate { since: "" },
    run: every_road,
    ..Rule::DEFAULTS
};
static ALIKE: Rule<Document> = Rule {
    id: "alike",
    uids: &["x:xodr:1.8.0:a.k"],
    versions: "1.8.0..",
    backport: Backport::Alike { since: "" },
    run: every_road,
    ..Rule::DEFAULTS
};
static WITH_PARAM: Rule<Document> = Rule {
    id: "with_param",
    uids: &["x:xodr:1.0.0:a.i"],
    params: &[LIMIT],
    run: |_, found| assert_eq!(found.number(&LIMIT), 2.5),
    ..Rule::DEFAULTS
};
static ON_NO_MODEL: Rule<Unavailable> = Rule {
    id: "on_no_model",
    uids: &["x:xodr:1.0.0:a.j"],
    run: |_, _| unreachable!(),
    ..Rule::DEFAULTS
};

struct Unavailable;

impl Model for Unavailable {
    type Of<'d> = ();
    type Part = ();

    fn build<'d>(_: &'d Subject<'d>) -> Result<(), Unbuilt> {
        Err(Unbuilt::NotApplicable(
            "there is nothing to look at".to_owned(),
        ))
    }

    fn parts((): &()) -> Vec<()> {
        Vec::new()
    }
}

static RULES: &[&dyn AnyRule] = &[
    &FINDS_ERRORS,
    &PANICS,
    &GIVES_UP,
    &AFTER_ERRORS,
    &AFTER_SKIPPED,
    &NEWER,
    &LOWERED,
    &SEPARATE,
    &ALIKE,
    &WITH_PARAM,
    &ON_NO_MODEL,
];

static BUNDLE: Bundle = Bundle {
    rules: RULES,
    ..common::BUNDLE
};

fn every_road(document: &Document<'_>, found: &mut Sink<'_>) {
    for road in document.elements("road") {
        found.issue(road, "a road").at(road, "the same road");
    }
}

const MAP: &str = "<OpenDRIVE>\n<header revMajor='1' revMinor='4'/>\n<road id='1'/>\n<road id='2'/>\n</OpenDRIVE>\n";

fn checked(
    demanded: impl Fn(&Checker) -> bool,
    configured: impl Fn(&Checker, &str) -> Option<String>,
) -> Vec<CheckerOutcome> {
    let loaded = Loaded::from_bytes(Path::new("a.xodr"), MAP.as_bytes().to_vec()).unwrap();
    examine(&Plan::new(&BUNDLE, demanded, configured), &loaded)
        .unwrap()
        .checkers
}

fn of(id: &str) -> CheckerOutcome {
    let mut all = checked(
        |checker| checker.id == id,
        |_, name| (name == "limit").then(|| "2.5".to_owned()),
    );
    let at = all.iter().position(|outcome| *outcome.id == *id).unwrap();
    all.remove(at)
}

#[test]
fn findings_are_located_and_in_document_order() {
    let outcome = of("finds_errors");
    assert_eq!(outcome.status(), Status::Completed);
    let places: Vec<_> = outcome
        .issues
        .iter()
        .map(|issue| format!("{:?}", issue.locations[0].places))
        .collect();
    assert!(
        places[0].contains("row: 3") && places[0].contains("/OpenDRIVE/road[@id='1']"),
        "{places:?}"
    );
    assert!(places[1].contains("row: 4"), "{places:?}");
    assert_eq!(outcome.issues[0].locations.len(), 2);
}

#[test]
fn timings_name_every_required_checker_and_sum_up() {
    let loaded = Loaded::from_bytes(Path::new("a.xodr"), MAP.as_bytes().to_vec()).unwrap();
    let (outcome, timings) =
        examine_timed(&Plan::by_default(&BUNDLE), &loaded, &Permits::new(2)).unwrap();
    let text = timings.to_string();
    for checker in &outcome.checkers {
        let lines = text
            .lines()
            .filter(|line| line.ends_with(&format!("ms  {}", checker.id)));
        assert_eq!(lines.count(), 1, "{} in\n{text}", checker.id);
    }
    assert_eq!(timings.checkers.len(), outcome.checkers.len());
    assert!(timings.sum() <= timings.whole, "{text}");
}

#[test]
fn panic_fails_its_checker_and_keeps_findings() {
    let outcome = of("panics");
    assert_eq!((outcome.status(), outcome.issues.len()), (Status::Error, 2));
    assert!(
        outcome.reason().contains("on purpose"),
        "{}",
        outcome.reason()
    );
    assert_eq!(
        checked(|_| true, |_, _| None).len(),
        RULES.len() + 2,
        "the other checkers continue"
    );
}

#[test]
fn rule_that_gives_up_fails_checker_with_first_reason() {
    let outcome = of("gives_up");
    assert_eq!((outcome.status(), outcome.issues.len()), (Status::Error, 2));
    assert_eq!(outcome.reason(), "it raised KeyError: 'id'\nin line 3");
}

#[test]
fn preconditions_hold_transitively_even_when_not_selected() {
    let reasons = [of("after_errors"), of("after_skipped")].map(|outcome| {
        assert_eq!(
            (outcome.status(), outcome.issues.len()),
            (Status::Skipped, 0)
        );
        outcome.reason().to_owned()
    });
    assert_eq!(
        reasons,
        ["`finds_errors` found errors", "`after_errors` was skipped"]
    );
}

#[test]
fn version_gates_rule_and_backport_lowers_level() {
    assert_eq!(
        of("newer").reason(),
        "the rule applies to OpenDRIVE 1.8 and later; the file has version 1.4"
    );
    let lowered = of("lowered");
    assert_eq!(lowered.issues[0].level, Level::Warning);
    assert!(
        lowered.issues[0]
            .description
            .contains("1.4 does not demand this"),
        "{lowered:?}"
    );
    assert_eq!(of("separate").status(), Status::Skipped);
    let backport = of("separate_backport");
    assert_eq!(
        (backport.status(), backport.issues[0].level),
        (Status::Completed, Level::Warning)
    );
    assert_eq!(of("alike").status(), Status::Skipped);
    let alike = of("alike_backport");
    assert_eq!(
        (alike.issues[0].level, alike.issues[0].description.as_str()),
        (Level::Error, "a road")
    );
}

#[test]
fn parameters_reach_rule_and_result() {
    let outcome = of("with_param");
    assert_eq!(
        (outcome.status(), outcome.params[0].value.as_str()),
        (Status::Completed, "2.5")
    );
    let wrong = checked(
        |checker| checker.id == "with_param",
        |_, _| Some("much".to_owned()),
    );
    assert_eq!(wrong[0].status(), Status::Error);
    assert!(
        wrong[0].reason().contains("`much`"),
        "{}",
        wrong[0].reason()
    );
}

#[test]
fn model_that_cannot_be_built_skips_its_rules() {
    let outcome = of("on_no_model");
    assert_eq!(
        (outcome.status(), outcome.reason()),
        (Status::Skipped, "there is nothing to look at")
    );
}

#[test]
fn findings_beyond_limit_are_counted_with_their_level() {
    let limited = checked(
        |checker| checker.id == "finds_errors",
        |_, name| (name == "qcbus.max_issues").then(|| "1".to_owned()),
    );
    let [listed, rest] = limited[0].issues.as_slice() else {
        panic!("{limited:?}")
    };
    assert_eq!((listed.level, rest.level), (Level::Error, Level::Error));
    assert!(
        rest.description.starts_with("1 further finding"),
        "{}",
        rest.description
    );
    assert_eq!(limited[0].metadata[0].value, "1");
}

#[test]
fn rules_are_found_by_id_uid_and_their_ends() {
    let ids = |name: &str| {
        BUNDLE
            .find(name)
            .iter()
            .map(|rule| rule.facts().id)
            .collect::<Vec<_>>()
    };
    assert_eq!(ids("finds_errors"), ["finds_errors"]);
    assert_eq!(ids("x:xodr:1.8.0:a.h"), ["separate"]);
    assert_eq!(ids("separate_backport"), ["separate"]);
    assert_eq!(ids("errors"), ["finds_errors", "after_errors"]);
    assert!(ids("nothing").is_empty() && ids("").is_empty());
}

#[test]
fn blocking_checkers_of_selected_checker_are_reported() {
    let demanded = |id: &'static str| checked(move |checker| checker.id == id, |_, _| None);
    let ids = |all: &[CheckerOutcome]| all.iter().map(|it| it.id.to_string()).collect::<Vec<_>>();
    let all = demanded("after_skipped");
    assert_eq!(ids(&all), ["finds_errors", "after_errors", "after_skipped"]);
    let by = |at: usize| match &all[at].ending {
        Some(Ending::Blocked { by, .. }) => by.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(
        (by(1), by(2)),
        (vec!["finds_errors".into()], vec!["after_errors".into()])
    );
    assert_eq!(all[0].issues.len(), 2, "the errors themselves are reported");
    assert_eq!(
        ids(&demanded("newer")),
        ["newer"],
        "an inapplicable checker counts as an answer"
    );
}
