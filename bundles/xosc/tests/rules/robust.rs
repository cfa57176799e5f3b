//! Checks that a damaged file never makes a rule panic. The tests break the examples of the pages
//! and, if they are available, real scenarios. They use the methods of `qcbus_rule_tests::robust`.

use std::path::Path;

use qcbus_rule_tests::robust::Robust;
use qcbus_xosc::BUNDLE;

use crate::templates::TEMPLATES;

const ROBUST: Robust = Robust {
    bundle: &BUNDLE,
    templates: TEMPLATES,
    extension: "xosc",
    hostile: &[
        "",
        " ",
        "0",
        "-1",
        "1e308",
        "-1e308",
        "1e-320",
        "NaN",
        "INF",
        "-INF",
        "99999999999999999999",
        "x",
        "$",
        "${",
        "${}",
        "$x",
        "${1/0}",
        "${((((((((1))))))))}",
        "$$",
        "${$x}",
        "::",
        "a::b::",
        "Ego",
        "2026-02-30T25:61:00",
        "true",
        "-9223372036854775808",
        "9223372036854775807",
        "ä",
        "$(var x)",
        "a$b",
    ],
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
fn no_rule_fails_on_broken_real_scenarios() {
    let cases = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases");
    ROBUST.assert_files_below(Path::new(cases));
}

/// Breaks an expanded modular scenario. Its elements come from several files, in another order than
/// they are written.
#[test]
fn no_rule_fails_on_broken_expanded_scenario() {
    const MAIN: &str = include_str!("../../../../tests/farm/modular/convoy.xosc");
    const LIBRARY: &str = include_str!("../../../../tests/farm/modular/moves.xosc");
    let twists = [
        ("value=\"8\"", "value=\"-8\""),
        ("value=\"8\"", "value=\"${$p}\""),
        ("value=\"4\"", "value=\"INF\""),
        ("entityRef=\"second\"", "entityRef=\"nobody\""),
        ("name=\"tail\"", "name=\"lead\""),
        ("greaterThan", "equalTo"),
        ("dimension=\"time\"", "dimension=\"rate\""),
        (
            "<SimulationTimeCondition ",
            "<ParameterCondition parameterRef=\"p\" ",
        ),
        (
            "<LanePosition roadId=\"1\" laneId=\"-1\" s=\"20\"/>",
            "<WorldPosition x=\"1e9\" y=\"NaN\"/>",
        ),
        (
            "<Maneuver name=\"speed\">",
            "<CatalogReference catalogName=\"c\" entryName=\"e\"/><Maneuver name=\"speed\">",
        ),
    ];
    ROBUST.assert_mutated_set(&[("convoy.xosc", MAIN), ("moves.xosc", LIBRARY)], &twists);
}
