use crate::families::declared;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.3.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Any scenario may use a catalog's maneuver.
    if scenario.form() == Form::Scenario {
        declared::MONITORS.resolve(scenario, found);
    }
}
