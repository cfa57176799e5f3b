use crate::prelude::*;
use qcbus_opendrive::CrossPath;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        for path in junction.cross_paths() {
            for end in ContactPoint::BOTH {
                check(map, path, end, found);
            }
        }
    }
}

/// Checks the two lanes that are linked at one end of a cross path.
fn check(map: &RoadMap<'_>, path: CrossPath<'_>, end: ContactPoint, found: &mut Sink<'_>) {
    let Some(link) = path.lane_link(end) else {
        return;
    };
    let road = path.road_at(end).and_then(|id| map.road(id));
    let crossed = match (road, link.from(), link.s()) {
        (Some(road), Some(from), Some(s)) => lane_at(road, from, s),
        _ => None,
    };
    let crossing = path.crossing_road().and_then(|id| map.road(id));
    let crossing = crossing.zip(link.to()).and_then(|(road, to)| {
        let place = RoadEnd::of(road, end);
        map.lane(map.lane_at_road_end(place, to, LayerKind::Permanent)?.lane)
    });
    for (attribute, lane) in [("from", crossed), ("to", crossing)] {
        let Some((lane, kind)) = lane.and_then(|lane| Some((lane, lane.kind()?))) else {
            continue;
        };
        let level = match kind {
            "walking" | "biking" => continue,
            // `sidewalk` is the older word for walking.
            "sidewalk" => Level::Warning,
            _ => Level::Error,
        };
        let text = format!(
            "the cross path is linked to lane {} of road `{}`, which is of type `{kind}`; cross paths must \
             only connect lanes of type `walking` or `biking`",
            lane.id_text().unwrap_or_default(),
            lane.at.road.id()
        );
        found
            .issue(Place::attribute_or_node(link.node(), attribute), text)
            .level(level)
            .at(lane.node(), "the lane");
    }
}

fn lane_at<'m, 'a>(road: &'m Road<'a>, id: i64, s: f64) -> Option<LaneRef<'m, 'a>> {
    let side = Side::of_lane_id(id)?;
    road.permanent()?.section_at(road, side, s)?.lane(id)
}
