use crate::families::object_parts::{named, number};
use crate::prelude::*;
use qcbus_opendrive::Track;

const APART: Param = Param::number(
    "apart",
    1.0,
    "m",
    "largest accepted distance between the tracks of a switch",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.4.0..",
    params: &[APART],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let most = found.number(&APART);
    for switch in map.roads().iter().flat_map(Road::switches) {
        let tracks = switch.main_track().zip(switch.side_track());
        let Some((main, side)) = tracks else { continue };
        let Some((one, other)) = place(map, main).zip(place(map, side)) else {
            continue;
        };
        let apart = one.distance(other);
        if apart <= most {
            continue;
        }
        let text = format!(
            "the side track of {} is road `{}` at s = {}, but this place lies {apart:.1} m away from the main \
             track, road `{}` at s = {}; the tracks of a switch must meet, otherwise trains cannot change from one to \
             the other",
            named(switch.node()),
            side.id().unwrap_or_default(),
            shown(side),
            main.id().unwrap_or_default(),
            shown(main)
        );
        found
            .issue(Place::attribute_or_node(side.node(), "s"), text)
            .point(other.x, other.y, 0.0)
            .at(main.node(), "the main track")
            .point(one.x, one.y, 0.0);
    }
}

/// Returns the point of a track if it is on its road.
fn place(map: &RoadMap<'_>, track: Track<'_>) -> Option<Point> {
    let road = map.road(track.id()?)?;
    let s = number(track.node(), "s").filter(|s| *s >= 0.0)?;
    let length = road.length().filter(|length| s <= length + 0.05)?;
    road.pose(s.min(length))?.beside(0.0)
}

fn shown(track: Track<'_>) -> &str {
    track.node().attr("s").unwrap_or_default()
}
