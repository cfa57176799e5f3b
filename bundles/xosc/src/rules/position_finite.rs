use crate::families::{self, finite::Numbers};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
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
