use crate::families::simulators::{self, Gap, lane_border};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

const GAPS: &[Gap] = &[
    Gap {
        element: "border",
        is_meant: lane_border,
        text: "CARLA reads the width of a lane only from `width` and uses a default if it is missing; this lane \
               has only `border`",
    },
    Gap {
        element: "geometry",
        is_meant: begins_otherwise,
        text: "CARLA reads the first element in `geometry` as its shape and omits the geometry if that element \
               is not a shape",
    },
    Gap {
        element: "connection",
        is_meant: is_direct,
        text: "CARLA reads `connectingRoad` of a connection but not `linkedRoad`, so direct junctions lead to \
               road 0",
    },
];

/// Last version in the documentation of CARLA.
const NEWEST: (u16, u16) = (1, 4);

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    if let (Some(header), Some(version)) = (map.header(), map.version())
        && (version.major, version.minor) > NEWEST
    {
        let text = format!(
            "CARLA is written for OpenDRIVE 1.4, but this file has version {version}; features that were added \
             later are not read"
        );
        let attribute = if version.major == 1 {
            "revMinor"
        } else {
            "revMajor"
        };
        found.issue(Place::attribute_or_node(header, attribute), text);
    }
    simulators::report(map, GAPS, found);
}

fn begins_otherwise(geometry: Node<'_>) -> bool {
    let first = geometry.children().next();
    first.is_some_and(|first| ShapeKind::of(first).is_none())
}

fn is_direct(connection: Node<'_>) -> bool {
    connection.attr("linkedRoad").is_some() && connection.attr("connectingRoad").is_none()
}
