//! No file, however broken, makes a rule panic: the examples of the pages and, where they are at hand,
//! real scenarios, broken in the ways of `qcbus_sdk::robust`.

use std::path::Path;

use qcbus_sdk::robust::Robust;
use qcbus_xosc::BUNDLE;

const ROBUST: Robust = Robust {
    bundle: &BUNDLE,
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
fn truncated_examples_break_no_rule() {
    ROBUST.assert_truncated_examples();
}

#[test]
fn mutated_examples_break_no_rule() {
    ROBUST.assert_mutated_examples();
}

#[test]
fn real_scenarios_broken_in_any_way_break_no_rule() {
    let cases = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases");
    ROBUST.assert_files_below(Path::new(cases));
}
