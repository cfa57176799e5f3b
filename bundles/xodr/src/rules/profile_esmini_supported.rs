use crate::families::simulators::{self, Gap, any, lane_border};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

/// Elements that determine the position of roads and lanes, and so the paths of vehicles.
const GAPS: &[Gap] = &[
    Gap {
        element: "border",
        is_meant: lane_border,
        text: "esmini reads the width of a lane only from `width`; this lane has only `border`",
    },
    Gap {
        element: "crossfall",
        is_meant: any,
        text: "esmini does not read `crossfall`; the cross section of the road stays level",
    },
    Gap {
        element: "shape",
        is_meant: is_of_road,
        text: "esmini does not read `shape` of a road; its surface only follows `superelevation`",
    },
    Gap {
        element: "CRG",
        is_meant: any,
        text: "esmini does not read `CRG`; the surface stays smooth",
    },
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    simulators::report(map, GAPS, found);
}

fn is_of_road(shape: Node<'_>) -> bool {
    shape
        .parent()
        .is_some_and(|above| above.is("lateralProfile"))
}
