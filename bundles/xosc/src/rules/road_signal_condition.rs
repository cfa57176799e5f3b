use crate::families::signals;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    signals::missing_signals(scenario, "TrafficSignalCondition", "name", found);
}
