use crate::families::timeline;
use crate::prelude::*;
use qcbus_openscenario::ImpossibleReason;
use qcbus_openscenario::wording::described;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for condition in scenario.elements_everywhere("Condition") {
        let Some(impossible) = scenario.impossible(condition) else {
            continue;
        };
        let element = impossible.element;
        // For quantities other than the time, the range rules report numbers below zero.
        let is_out_of_range = element
            .number(impossible.attribute)
            .is_some_and(|value| value < 0.0 && !element.is("SimulationTimeCondition"));
        // A run that never ends is reported as such.
        if is_out_of_range || timeline::keeps_running(scenario, condition) {
            continue;
        }
        let so = match impossible.reason {
            // Some simulators have a time of day of their own.
            ImpossibleReason::DayNotSet => "it may never be true",
            _ => "it is never true",
        };
        let text = format!("{}; {so}", described(&impossible));
        found
            .about(element, impossible.attribute, text)
            .maybe_fault(timeline::start_of(condition));
    }
}
