use crate::families::profiles::Fate::{Ignores, Stops};
use crate::families::profiles::{self, Gap, gap};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_profile_esmini_supported",
    uids: &["qcbus.dev:xosc:1.0.0:profile.esmini_supported"],
    level: Level::Information,
    after: super::READABLE,
    default_on: false,
    page: include_str!("profile_esmini_supported.md"),
    run,
    ..Rule::DEFAULTS
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
