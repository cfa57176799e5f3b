//! Checks that a damaged file never makes a rule panic. The tests break the examples of the pages
//! and, if they are available, real maps. They use the methods of `qcbus_rule_tests::robust`.

use std::path::Path;

use qcbus_rule_tests::pages::evidence;
use qcbus_rule_tests::robust::{NUMBERS, Robust, places};
use qcbus_sdk::Plan;
use qcbus_xodr::BUNDLE;

use crate::templates::TEMPLATES;

const ROBUST: Robust = Robust {
    bundle: &BUNDLE,
    templates: TEMPLATES,
    extension: "xodr",
    hostile: NUMBERS,
};

#[test]
fn no_rule_fails_on_truncated_examples() {
    ROBUST.assert_truncated_examples();
}

#[test]
fn no_rule_fails_on_mutated_examples() {
    ROBUST.assert_mutated_examples();
}

#[test]
fn no_rule_fails_on_broken_real_maps() {
    let cases = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases");
    ROBUST.assert_files_below(Path::new(cases));
}

/// Lengths that no element can have.
const IMPOSSIBLE: [&str; 3] = ["-1", "0", "-9223372036854775808"];

/// Tries these lengths for all roads, geometries, sections and repeats of an example. A short run
/// tries one of them per example.
#[test]
fn no_rule_fails_on_impossible_lengths() {
    let plan = Plan::by_default(&BUNDLE);
    let tried = if places() > 2 { IMPOSSIBLE.len() } else { 1 };
    for (index, shown) in evidence::documents(&BUNDLE, TEMPLATES)
        .into_iter()
        .enumerate()
    {
        for length in IMPOSSIBLE.iter().cycle().skip(index).take(tried) {
            let mut parts = shown.text.split(" length=\"");
            let mut text = parts.next().unwrap_or_default().to_owned();
            for part in parts {
                let rest = part.split_once('"').map_or(part, |(_, rest)| rest);
                text.push_str(&format!(" length=\"{length}\"{rest}"));
            }
            ROBUST.assert_unbroken(&plan, text.as_bytes(), shown.rule);
        }
    }
}
