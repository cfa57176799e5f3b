use crate::families::triggers::called;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// Elements that may be empty by the schema: children of which they need at least one to have an
/// effect, and the effect of an empty element.
const CONTAINERS: &[(&str, &[&str], &str)] = &[
    (
        "ManeuverGroup",
        // The last one belongs to modular scenarios. Another rule reports it.
        &["Maneuver", "CatalogReference", "ScenarioReference"],
        "has neither a `Maneuver` nor a `CatalogReference`; nothing happens in it, and it ends at once",
    ),
    (
        "OverrideControllerValueAction",
        &[
            "Throttle",
            "Brake",
            "Clutch",
            "ParkingBrake",
            "SteeringWheel",
            "Gear",
        ],
        "overrides nothing; it may have a `Throttle`, a `Brake`, a `Clutch`, a `ParkingBrake`, a `SteeringWheel` \
         and a `Gear`",
    ),
    (
        "Environment",
        &["TimeOfDay", "Weather", "RoadCondition"],
        "has no `TimeOfDay`, `Weather` or `RoadCondition`; it changes nothing",
    ),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // Scenarios that only place entities have an empty group because older schemas require one.
    let groups = scenario.elements("ManeuverGroup");
    let only_places = !groups
        .into_iter()
        .flat_map(Element::children)
        .any(|child| child.is("Maneuver") || child.is("CatalogReference"));
    for (name, contents, effect) in CONTAINERS {
        let silent = match *name {
            "ManeuverGroup" => only_places,
            // Before 1.1 the schema requires all parts of these elements.
            _ => scenario.version() < (1, 1),
        };
        if silent {
            continue;
        }
        for element in scenario.elements(name) {
            if !element
                .children()
                .any(|child| contents.contains(&child.name()))
            {
                found.about(element, "", format!("{} {effect}", called(element)));
            }
        }
    }
}
