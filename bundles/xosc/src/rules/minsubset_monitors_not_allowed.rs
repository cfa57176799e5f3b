use crate::families::minsubset;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let instead = "remove it and everything that refers to it";
    minsubset::none(scenario, &["MonitorDeclaration"], instead, found);
}
