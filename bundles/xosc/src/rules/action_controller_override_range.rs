use crate::families::ranges;
use crate::families::ranges::tables::OVERRIDES;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    uids: &UIDS,
    run,
    ..Rule::after(READABLE)
};

const OWN: [&str; 1] = ["qcbus.dev:xosc:1.0.0:action.controller_override_range"];

const UIDS: [&str; OWN.len() + OVERRIDES.len()] = ranges::uids(&OWN, OVERRIDES);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    ranges::report_as_own(scenario, OVERRIDES, found);
    for gear in scenario.elements_everywhere("Gear") {
        if gear.class() == Some("OverrideGearAction") {
            whole_number(gear, found);
        }
    }
}

/// Checks the number of a gear, which is a double in the schema.
fn whole_number(gear: Element<'_, '_>, found: &mut Sink<'_>) {
    let Some(number) = gear.double("number") else {
        return;
    };
    if number.fract() != 0.0 || !number.is_finite() {
        // This is a warning only. Simulators round the number, and existing files contain such
        // numbers.
        let text = format!(
            "`number` of `Gear` is {}, but should be a whole number: 0 is neutral, -1 is reverse",
            ranges::shown(gear, "number", number)
        );
        found.about(gear, "number", text).level(Level::Warning);
    }
}
