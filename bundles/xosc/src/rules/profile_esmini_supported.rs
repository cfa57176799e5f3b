use crate::families::profiles::Fate::{Ignores, Stops};
use crate::families::profiles::{self, Gap, gap};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

const GAPS: &[Gap] = &[
    gap("Actors", Ignores).saying("selectTriggeringEntities", "true"),
    gap("AnimationAction", Ignores),
    gap("EntitySelection", Ignores),
    gap("ExternalObjectReference", Ignores),
    gap("FromCurrentEntity", Ignores),
    gap("GeoPosition", Stops),
    gap("ModifyAction", Ignores),
    gap("MonitorDeclaration", Ignores),
    gap("RelativeAngleCondition", Stops),
    gap("SetMonitorAction", Ignores),
    gap("Stochastic", Ignores),
    gap("TimeOfDayCondition", Ignores),
    gap("TrafficAreaAction", Ignores),
    gap("TrafficSignalControllerAction", Ignores),
    gap("TrafficSignalControllerCondition", Ignores),
    gap("TrafficSinkAction", Ignores),
    gap("TrafficSourceAction", Ignores),
    gap("TrafficStopAction", Ignores),
    gap("UserDefinedAction", Ignores),
    gap("UserDefinedLight", Ignores),
    gap("UserDefinedValueCondition", Ignores),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    profiles::report(scenario, "esmini", GAPS, found);
}
