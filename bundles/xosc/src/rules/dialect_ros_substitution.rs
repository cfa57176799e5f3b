use crate::families::values;
use crate::prelude::*;
use qcbus_openscenario::Dialect;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_dialect_ros_substitution",
    uids: &["qcbus.dev:xosc:1.0.0:dialect.ros_substitution"],
    level: Level::Warning,
    after: super::READABLE,
    params: &[ALLOWED],
    page: include_str!("dialect_ros_substitution.md"),
    run,
    ..Rule::DEFAULTS
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
