use crate::families::faults::OfFault as _;
use crate::families::junction_lanes::{Used, arms};
use crate::families::link_sides::Known;
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
    // `road.linkage.both_sides_consistency` reports roads that the junction does not mention.
    let known = Known::by(map);
    for (road, end, junction) in arms(map) {
        let at = RoadEnd::of(road, end);
        let all = used.is_whole(junction, road) || used.is_open(at);
        if !all && known.contains(junction, road, end) {
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
    let leaves = |lane: &LaneRef<'_, '_>| Traffic::of(*lane) == Traffic::Towards(end.other());
    let lanes = routes_at(road, end, found.number(&NARROW));
    for lane in lanes.filter(|lane| leaves(lane) && !used.contains(*lane, end)) {
        let text = format!(
            "{} leads out of junction `{}`, but no lane of the junction leads onto it, so no traffic reaches it; \
             a lane that leads out of a junction should continue a connecting lane",
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
