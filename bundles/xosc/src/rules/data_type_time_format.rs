use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let kinds = [ValueFaultKind::Declared, ValueFaultKind::Parameter];
    for fault in values::faults(scenario, &kinds) {
        if values::is_about_time(fault) {
            let level = if values::is_basic_zone(scenario, fault) {
                Level::Warning
            } else {
                Level::Error
            };
            values::say(fault, found).level(level);
        }
    }
}
