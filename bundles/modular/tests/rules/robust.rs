//! Checks that a damaged set of files never makes a rule panic.

use qcbus_modular::BUNDLE;
use qcbus_rule_tests::robust::Robust;

use crate::templates::TEMPLATES;

const ROBUST: Robust = Robust {
    bundle: &BUNDLE,
    templates: TEMPLATES,
    extension: "xosc",
    hostile: &[
        "",
        " ",
        ".",
        "..",
        "a.b",
        ".x",
        "value",
        "x,y",
        "$",
        "${",
        "$p",
        "ManeuverGroup.name",
        "parameterAttributes",
        "lib.xosc",
        "main.xosc",
        "../lib.xosc",
        "lib.mosc",
        "<",
        "1e308",
        "ä",
        "drive.",
    ],
};

const MAIN: &str = include_str!("../../../../tests/farm/modular/convoy.xosc");
const LIBRARY: &str = include_str!("../../../../tests/farm/modular/moves.xosc");
/// A library that itself takes a group.
const FURTHER: &str = include_str!("../../../../tests/farm/faulty/misassembled.xosc");

#[test]
fn no_rule_fails_on_truncated_examples() {
    ROBUST.assert_truncated_examples();
}

#[test]
fn no_rule_fails_on_mutated_examples() {
    ROBUST.assert_mutated_examples();
}

#[test]
fn no_rule_fails_on_broken_modular_scenario() {
    let files = [
        ("convoy.xosc", MAIN),
        ("moves.xosc", LIBRARY),
        ("further.xosc", FURTHER),
    ];
    let twists = [
        (
            "scenarioFileName=\"moves.xosc\"",
            "scenarioFileName=\"further.xosc\"",
        ),
        (
            "scenarioFileName=\"moves.xosc\"",
            "scenarioFileName=\"convoy.xosc\"",
        ),
        ("../modular/moves.xosc", "moves.xosc"),
        ("maneuverGroupName=\"brake\"", "maneuverGroupName=\"lead\""),
        (
            "maneuverGroupName=\"brake\"",
            "maneuverGroupName=\"lead.brake\"",
        ),
        ("ManeuverGroupReference", "ParameterReference"),
        ("key=\"AbsoluteTargetSpeed.value\"", "key=\"value\""),
        (
            "SpeedActionTarget.AbsoluteTargetSpeed.value",
            "SpeedActionDynamics.value",
        ),
        (
            "parameterAttributes=\"value\"",
            "parameterAttributes=\"value, delay;x.y\"",
        ),
        ("<EntityRef entityRef=\"car\"/>", ""),
        ("value=\"5\"", "value=\"$p\""),
        ("revMinor=\"2\"", "revMinor=\"0\""),
        ("quay_straight", "ring"),
        (
            "<Maneuver name=\"speed\">",
            "<CatalogReference catalogName=\"c\" entryName=\"e\"/><Maneuver name=\"speed\">",
        ),
    ];
    ROBUST.assert_mutated_set(&files, &twists);
}
