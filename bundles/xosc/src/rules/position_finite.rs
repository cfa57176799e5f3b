use crate::families::{self, finite::Numbers};
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_finite",
    uids: &["qcbus.dev:xosc:1.0.0:position.finite"],
    after: super::READABLE,
    page: include_str!("position_finite.md"),
    run,
    ..Rule::DEFAULTS
};

/// Elements of positions, with their numeric attributes.
const NUMBERS: &Numbers = &[
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
    let why = "it must be a finite number, because nothing can be at such a position";
    families::finite::report(scenario, NUMBERS, why, found);
}
