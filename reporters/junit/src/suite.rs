//! The test suite of a checked file.

use std::collections::BTreeMap;

use qcbus_formats::pool::NotAsked;
use qcbus_formats::xqar::Checker;
use qcbus_messages::{Digest, ResultMessage, Verdict};
use qcbus_reporter_sdk::{checkers, is_blocked, is_inapplicable, reason};
use quick_junit::{NonSuccessKind, Property, TestCase, TestCaseStatus, TestSuite};

use crate::case::{self, Findings};
use crate::text::{counted, name, path, short};

/// Property that identifies a suite: absolute path of the checked file.
pub(crate) const INPUT: &str = "qcbus.inputFile";

/// Treatment of checkers that do not apply to the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Inapplicable {
    /// The suite gives their number.
    Counted,
    /// Each of them has a skipped case.
    Listed,
}

/// Returns the suite of a result.
pub(crate) fn suite(result: &ResultMessage, inapplicable: Inapplicable) -> TestSuite {
    let shown_path = name(&result.display_path, "(no path)");
    let mut suite = TestSuite::new(shown_path.as_str());
    let mut names = Names::default();
    let findings = Findings(result);
    let mut cases = Vec::new();
    let mut left_out = 0;
    for (bundle, checker) in checkers(result) {
        if does_not_apply(checker) && inapplicable == Inapplicable::Counted {
            left_out += 1;
            continue;
        }
        let class = class(&bundle.name, &shown_path);
        let id = names.free(&class, &name(&checker.id, "(no id)"));
        cases.push(case::case(&id, &class, checker, &findings));
    }
    let is_red = |case: &TestCase| matches!(case.status, TestCaseStatus::NonSuccess { .. });
    if result.verdict != Verdict::Accepted && !cases.iter().any(is_red) {
        let class = class(qcbus_formats::pool::OWN_BUNDLE, &shown_path);
        let id = names.free(&class, "verdict");
        cases.insert(0, verdict(&id, &class, result));
    }
    suite.add_test_cases(cases);
    suite.properties = properties(result, left_out);
    let said = remarks(result, left_out);
    if !said.is_empty() {
        suite.set_system_out(said);
    }
    suite
}

/// Checks whether the checker does not apply to the file. A checker with findings is not left out.
/// Other tools may write such a checker.
pub(crate) fn does_not_apply(checker: &Checker) -> bool {
    is_inapplicable(checker) && checker.issues.is_empty()
}

fn class(bundle: &str, shown_path: &str) -> String {
    format!("{}.{shown_path}", name(bundle, "(no bundle)"))
}

/// Returns the case of a file that is not accepted but has no red checker.
fn verdict(id: &str, class: &str, result: &ResultMessage) -> TestCase {
    let blocked: Vec<&Checker> = checkers(result)
        .map(|(_, checker)| checker)
        .filter(|checker| is_blocked(checker))
        .collect();
    let why = match blocked.as_slice() {
        [] if result.verdict == Verdict::Undetermined => {
            "no checker has checked the file".to_owned()
        }
        [] => "the result does not state the reason".to_owned(),
        [first, ..] => format!(
            "{} could not run: {}",
            counted(blocked.len(), "checker"),
            short(&reason(first), crate::LONGEST_FINDING)
        ),
    };
    let message = format!("{}: {why}", result.verdict);
    let status = case::red(NonSuccessKind::Error, result.verdict.as_str(), &message);
    let mut case = TestCase::new(id, status);
    case.set_classname(class);
    case
}

fn properties(result: &ResultMessage, left_out: usize) -> Vec<Property> {
    let mut properties = vec![
        Property::new(INPUT, path(&result.input)),
        Property::new("qcbus.verdict", result.verdict.to_string()),
    ];
    if result.digest != Digest::default() {
        let digest = result.digest.to_string();
        properties.push(Property::new("qcbus.sha256", digest));
    }
    if left_out > 0 {
        let count = left_out.to_string();
        properties.push(Property::new("qcbus.notApplicable", count));
    }
    properties
}

/// Returns remarks for people about everything without a case.
fn remarks(result: &ResultMessage, left_out: usize) -> String {
    let mut lines = Vec::new();
    match left_out {
        0 => {}
        1 => lines.push("1 checker does not apply to the file and is left out".to_owned()),
        many => lines.push(format!(
            "{many} checkers do not apply to the file and are left out"
        )),
    }
    let not_asked = NotAsked::of(&result.results);
    lines.extend(
        not_asked
            .iter()
            .map(|it| path(&format!("not requested: {it}"))),
    );
    lines.join("\n")
}

/// Case names in use, each with its class and the last number given to it.
#[derive(Default)]
struct Names {
    taken: BTreeMap<(String, String), usize>,
}

impl Names {
    /// Returns the name, with `#2` for the second one of its class. So a host that keeps one case
    /// of each name keeps all of them.
    fn free(&mut self, class: &str, name: &str) -> String {
        let of = |name: &str| (class.to_owned(), name.to_owned());
        let mut free = name.to_owned();
        while self.taken.contains_key(&of(&free)) {
            let number = self.taken.entry(of(name)).or_insert(1);
            *number += 1;
            free = format!("{name}#{number}");
        }
        self.taken.insert(of(&free), 1);
        free
    }
}
