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
    gap("AbsoluteTargetLane", Stops),
    gap("Brake", Stops).saying("active", "true"),
    gap("Clothoid", Stops),
    gap("Clutch", Stops).saying("active", "true"),
    gap("EntitySelection", Ignores),
    gap("Gear", Stops).saying("active", "true"),
    gap("LongitudinalDistanceAction", Stops).with("timeGap"),
    gap("Nurbs", Stops),
    gap("ObjectController", Ignores),
    gap("ParkingBrake", Stops).saying("active", "true"),
    gap("RoutePosition", Stops),
    gap("SceneGraphFile", Ignores),
    gap("SteeringWheel", Stops).saying("active", "true"),
    gap("Throttle", Stops).saying("active", "true"),
    gap("TrafficAction", Stops),
    gap("UserDefinedValueCondition", Stops),
    gap("VisibilityAction", Stops),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let (major, minor) = scenario.version();
    if (major, minor) == (1, 0) {
        profiles::report(scenario, NAME, GAPS, found);
        return;
    }
    // Catalogs are read in any version.
    let header = scenario.root().child("FileHeader");
    if let Some(header) = header.filter(|_| scenario.form() == Form::Scenario) {
        let text = format!(
            "{NAME} supports only scenarios of version 1.0, but this one declares {major}.{minor}"
        );
        let attribute = if major == 1 { "revMinor" } else { "revMajor" };
        found.issue(Place::attribute_or_node(header.node(), attribute), text);
    }
}

const NAME: &str = "CARLA's scenario runner";
