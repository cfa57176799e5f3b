use crate::families::deprecation;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_deprecated_element_used",
    uids: &["qcbus.dev:xosc:1.0.0:deprecated.element_used"],
    level: Level::Information,
    versions: "1.1.0..2.0.0",
    after: super::READABLE,
    page: include_str!("deprecated_element_used.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    deprecation::report(scenario, found);
}
