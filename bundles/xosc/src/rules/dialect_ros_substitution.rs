use crate::families::values;
use crate::prelude::*;
use qcbus_openscenario::Dialect;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    params: &[ALLOWED],
    run,
    ..Rule::after(READABLE)
};

const ALLOWED: Param = Param::flag(
    "allowed",
    false,
    "whether the simulator supports substitutions of ROS launch files",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !found.flag(&ALLOWED) {
        values::report(scenario, &[ValueFaultKind::Dialect(Dialect::Ros)], found);
    }
}
