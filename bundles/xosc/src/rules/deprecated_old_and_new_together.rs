use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1..",
    run,
    ..Rule::after(READABLE)
};

/// Element, its type, the deprecated attribute and its replacements. The function converts the old
/// value to the new one if this is possible.
type Pair = (
    &'static str,
    &'static str,
    &'static str,
    &'static [&'static str],
    Option<fn(f64) -> f64>,
);

const BRAKES: &[&str] = &["BrakePercent", "BrakeForce"];

const PAIRS: &[Pair] = &[
    ("Brake", "OverrideBrakeAction", "value", BRAKES, None),
    (
        "Clothoid",
        "Clothoid",
        "curvatureDot",
        &["curvaturePrime"],
        None,
    ),
    (
        "DistanceCondition",
        "DistanceCondition",
        "alongRoute",
        &["coordinateSystem"],
        None,
    ),
    (
        "Gear",
        "OverrideGearAction",
        "number",
        &["ManualGear", "AutomaticGear"],
        None,
    ),
    (
        "GeoPosition",
        "GeoPosition",
        "height",
        &["altitude"],
        Some(same),
    ),
    (
        "GeoPosition",
        "GeoPosition",
        "latitude",
        &["latitudeDeg"],
        Some(f64::to_degrees),
    ),
    (
        "GeoPosition",
        "GeoPosition",
        "longitude",
        &["longitudeDeg"],
        Some(f64::to_degrees),
    ),
    (
        "ParkingBrake",
        "OverrideParkingBrakeAction",
        "value",
        BRAKES,
        None,
    ),
    (
        "Precipitation",
        "Precipitation",
        "intensity",
        &["precipitationIntensity"],
        None,
    ),
    ("Sun", "Sun", "intensity", &["illuminance"], Some(same)),
    (
        "TimeHeadwayCondition",
        "TimeHeadwayCondition",
        "alongRoute",
        &["coordinateSystem"],
        None,
    ),
    (
        "TimeToCollisionCondition",
        "TimeToCollisionCondition",
        "alongRoute",
        &["coordinateSystem"],
        None,
    ),
    (
        "TrafficSourceAction",
        "TrafficSourceAction",
        "velocity",
        &["speed"],
        Some(same),
    ),
    (
        "TrafficSwarmAction",
        "TrafficSwarmAction",
        "velocity",
        &["InitialSpeedRange"],
        None,
    ),
    (
        "Weather",
        "Weather",
        "cloudState",
        &["fractionalCloudCover", "DomeImage"],
        None,
    ),
];

fn same(value: f64) -> f64 {
    value
}

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for pair in PAIRS {
        for element in scenario.elements(pair.0) {
            if element.has(pair.2) && element.class() == Some(pair.1) {
                compare(pair, element, found);
            }
        }
    }
}

fn compare(
    &(_, _, old, successors, convert): &Pair,
    element: Element<'_, '_>,
    found: &mut Sink<'_>,
) {
    for new in successors {
        let child = element.child(new);
        let place = match child {
            Some(child) => Place::Node(child.node()),
            None if element.has(new) => Place::attribute_or_node(element.node(), new),
            None => continue,
        };
        let both = convert.zip(element.number(old)).zip(element.number(new));
        let (level, remark) = match both {
            Some(((convert, old), new)) if !agree(convert(old), new) => {
                (Level::Error, "and their values differ")
            }
            Some(_) => (Level::Warning, "although their values are equal"),
            None => (Level::Warning, "and simulators use one or the other"),
        };
        let text = format!(
            "`{}` has the deprecated `{old}` and also its replacement `{new}`, {remark}; write only one",
            element.name()
        );
        found
            .issue(Place::attribute_or_node(element.node(), old), text)
            .level(level)
            .at(place, "the replacement");
    }
}

/// Checks whether two values agree within the usual rounding.
fn agree(one: f64, other: f64) -> bool {
    (one - other).abs() <= 1e-4 * one.abs().max(other.abs()).max(1.0)
}
