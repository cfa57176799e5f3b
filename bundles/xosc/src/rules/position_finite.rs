use qcbus_openscenario::Scenario;
use qcbus_sdk::{Rule, Sink};

use crate::families::references::quoted;
use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_finite",
    uids: &["qcbus.dev:xosc:1.0.0:position.finite"],
    after: super::READABLE,
    page: include_str!("position_finite.md"),
    run,
    ..Rule::DEFAULTS
};

/// What positions are made of, with the attributes that are numbers.
const NUMBERS: &[(&str, &[&str])] = &[
    ("WorldPosition", &["x", "y", "z", "h", "p", "r"]),
    ("RelativeWorldPosition", &["dx", "dy", "dz"]),
    ("RelativeObjectPosition", &["dx", "dy", "dz"]),
    ("RoadPosition", &["s", "t"]),
    ("RelativeRoadPosition", &["ds", "dt"]),
    ("LanePosition", &["s", "offset"]),
    ("RelativeLanePosition", &["ds", "dsLane", "offset"]),
    (
        "GeoPosition",
        &[
            "latitude",
            "longitude",
            "latitudeDeg",
            "longitudeDeg",
            "height",
            "altitude",
        ],
    ),
    ("TrajectoryPosition", &["s", "t"]),
    ("FromRoadCoordinates", &["pathS", "t"]),
    ("FromLaneCoordinates", &["pathS", "laneOffset"]),
    ("Orientation", &["h", "p", "r"]),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (name, attributes) in NUMBERS {
        for element in scenario.elements_everywhere(name) {
            for attribute in *attributes {
                let Some(value) = element.double(attribute).filter(|value| !value.is_finite())
                else {
                    continue;
                };
                let shown = if value.is_nan() {
                    "NaN"
                } else if value > 0.0 {
                    "INF"
                } else {
                    "-INF"
                };
                let text = format!(
                    "`{attribute}` of `{name}` is {}; nothing can be there, coordinates and angles are finite \
                     numbers",
                    quoted(element, attribute, shown)
                );
                found.about(element, attribute, text);
            }
        }
    }
}
