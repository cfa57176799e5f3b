//! Tests of rules that check one part of the model after the other.

use crate::common;
use std::path::Path;
use std::sync::Mutex;

use crate::roads::Roads;
use qcbus_formats::xqar::{Issue, Status};
use qcbus_sdk::{AnyRule, Bundle, Listener, Loaded, Outcome, Plan, Rule, Sink, check};

static FINDS: Rule<Roads> = Rule {
    id: "finds",
    uids: &["x:xodr:1.0.0:a.a"],
    each: Some(report),
    run: |_, found| found.fact("seen", found.count().to_string(), "roads before the whole"),
    ..Rule::DEFAULTS
};
static PANICS: Rule<Roads> = Rule {
    id: "panics",
    uids: &["x:xodr:1.0.0:a.b"],
    each: Some(|roads, part, found| {
        report(roads, part, found);
        assert!(*part != 1, "on purpose");
    }),
    ..Rule::DEFAULTS
};
static WHOLE: Rule<Roads> = Rule {
    id: "whole",
    uids: &["x:xodr:1.0.0:a.c"],
    run: |roads, found| found.fact("all", roads.0.len().to_string(), "roads"),
    ..Rule::DEFAULTS
};
static AFTER_CLEAN: Rule<Roads> = Rule {
    id: "after_clean",
    uids: &["x:xodr:1.0.0:a.d"],
    after: &["whole"],
    each: Some(report),
    ..Rule::DEFAULTS
};
static AFTER_ERRORS: Rule<Roads> = Rule {
    id: "after_errors",
    uids: &["x:xodr:1.0.0:a.e"],
    after: &["finds"],
    each: Some(report),
    ..Rule::DEFAULTS
};

fn report(roads: &Roads<'_>, part: &usize, found: &mut Sink<'_>) {
    found.issue(roads.0[*part], format!("road {part}"));
}

static BUNDLE: Bundle = Bundle {
    rules: &[
        &FINDS as &dyn AnyRule,
        &PANICS,
        &WHOLE,
        &AFTER_CLEAN,
        &AFTER_ERRORS,
    ],
    ..common::BUNDLE
};

/// Events of a check: the order of starts, and the end of each checker.
#[derive(Default)]
struct Heard {
    begun: Mutex<Vec<usize>>,
    ended: Vec<(usize, Vec<Issue>, Outcome)>,
    /// Number of starts after which the check is cancelled.
    patience: Option<usize>,
}

impl Listener for Heard {
    fn is_cancelled(&self) -> bool {
        let begun = self.begun.lock().unwrap().len();
        self.patience.is_some_and(|most| begun >= most)
    }

    fn begins(&self, checker: usize) {
        self.begun.lock().unwrap().push(checker);
    }

    fn ended(&mut self, checker: usize, issues: Vec<Issue>, outcome: Outcome) {
        self.ended.push((checker, issues, outcome));
    }
}

fn heard(patience: Option<usize>) -> (bool, Heard) {
    let map = "<OpenDRIVE><header revMajor='1' revMinor='4'/>\n<road/><road/><road/></OpenDRIVE>";
    let loaded = Loaded::from_bytes(Path::new("a.xodr"), map.as_bytes().to_vec()).unwrap();
    let subject = loaded.subject(&BUNDLE).unwrap();
    let mut heard = Heard {
        patience,
        ..Heard::default()
    };
    let complete = check(&Plan::by_default(&BUNDLE), &subject, &mut heard);
    (complete, heard)
}

fn texts(issues: &[Issue]) -> Vec<&str> {
    issues
        .iter()
        .map(|issue| issue.description.as_str())
        .collect()
}

#[test]
fn rules_check_parts_in_turn_and_then_the_whole() {
    let (complete, heard) = heard(None);
    assert!(complete);
    let parts = [[0, 1].as_slice(), &[0, 1], &[0]].concat();
    // First runs the rule that checks only the whole, then the one that checked parts and did not
    // fail.
    let whole = [2, 0];
    // The rule runs on three parts and the whole.
    let dependent = [3, 3, 3, 3];
    let begun = heard.begun.into_inner().unwrap();
    assert_eq!(begun, [parts.as_slice(), &whole, &dependent].concat());
    let order: Vec<usize> = heard.ended.iter().map(|(checker, ..)| *checker).collect();
    assert_eq!(order, [0, 1, 2, 4, 3]);
    let (_, issues, outcome) = &heard.ended[0];
    assert_eq!(texts(issues), ["road 0", "road 1", "road 2"]);
    assert_eq!(outcome.metadata[0].value, "3", "the whole is checked last");
}

#[test]
fn rule_that_panics_at_part_stops_and_keeps_findings() {
    let (_, heard) = heard(None);
    let (_, issues, outcome) = &heard.ended[1];
    assert_eq!(outcome.ending.status(), Status::Error);
    assert!(
        outcome.ending.reason().contains("on purpose"),
        "{}",
        outcome.ending.reason()
    );
    assert_eq!(texts(issues), ["road 0", "road 1"]);
}

#[test]
fn preconditions_end_before_dependents_begin() {
    let (_, heard) = heard(None);
    let of = |wanted: usize| {
        let mut all = heard.ended.iter();
        all.find(|(checker, ..)| *checker == wanted).unwrap()
    };
    assert_eq!(of(4).2.ending.status(), Status::Skipped);
    assert_eq!(of(4).2.ending.reason(), "`finds` found errors");
    assert_eq!(of(3).2.ending.status(), Status::Completed);
    assert_eq!(of(3).1.len(), 3);
}

#[test]
fn check_can_be_cancelled_between_parts() {
    let (complete, heard) = heard(Some(2));
    assert!(!complete);
    let begun = heard.begun.into_inner().unwrap();
    assert_eq!(begun, [0, 1], "no further part is begun");
    assert!(
        heard.ended.is_empty(),
        "an unfinished checker is not reported"
    );
}
