use crate::families::faults::OfFault as _;
use crate::families::junction_lanes::{Used, arms};
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::{NARROW, routes_at};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[NARROW],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // Another rule reports such a junction, and nothing is certain about its roads.
    if map.has_reserved_junction() {
        return;
    }
    let used = Used::of(map);
    for (road, end, junction) in arms(map) {
        if !used.is_whole(junction, road) {
            check(&used, (road, end), junction, found);
        }
    }
}

fn check(
    used: &Used<'_>,
    (road, end): (&Road<'_>, ContactPoint),
    junction: &Junction<'_>,
    found: &mut Sink<'_>,
) {
    let enters = |lane: &LaneRef<'_, '_>| Traffic::of(*lane) == Traffic::Towards(end);
    let lanes = routes_at(road, end, found.number(&NARROW));
    for lane in lanes.filter(|lane| enters(lane) && !used.contains(*lane, end)) {
        let text = format!(
            "{} leads into junction `{}`, but no connection continues it, so traffic cannot go on from there; a \
             lane that leads into a junction should be the `from` of a lane link",
            lane_name(lane),
            junction.id()
        );
        found
            .issue(lane.node(), text)
            .at_lane_end(lane, end)
            .at(junction.node(), "the junction")
            .of_junction(junction.node());
    }
}
