use foldhash::HashSet;
use qcbus_opendrive::{
    ContactPoint, Junction, JunctionType, LaneEnd, LaneRef, Road, RoadMap, Traffic,
};
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::{NARROW, routes_at};
use crate::model::Roads;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_junctions_incoming_lane_used",
    uids: &["qcbus.dev:xodr:1.4.0:junctions.incoming_lane_used"],
    level: Level::Warning,
    versions: "1.4.0..",
    after: super::READABLE,
    params: &[NARROW],
    page: include_str!("junctions_incoming_lane_used.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let used = Used::of(map);
    for road in map.roads().iter().filter(|road| road.junction().is_none()) {
        for end in ContactPoint::BOTH {
            let link = road.link(end).and_then(|link| link.junction_id());
            let Some(junction) = link.and_then(|id| map.junction(id)) else {
                continue;
            };
            let kind = junction.kind();
            let cuts = matches!(kind, Some(JunctionType::Common | JunctionType::Direct));
            if cuts && !used.whole.contains(&(junction.index(), road.id())) {
                check(&used, (road, end), junction, found);
            }
        }
    }
}

/// What junctions do with the lanes around them.
struct Used<'a> {
    /// The lane ends from or to which a lane of a junction leads.
    lanes: HashSet<LaneEnd>,
    /// Junctions and the incoming roads of which a connection takes up all lanes, because it has no lane links.
    whole: HashSet<(usize, &'a str)>,
}

impl<'a> Used<'a> {
    fn of(map: &RoadMap<'a>) -> Used<'a> {
        let mut used = Used {
            lanes: HashSet::default(),
            whole: HashSet::default(),
        };
        // Of the roads of junctions nobody asks.
        let roads = map.roads().iter();
        let outside: Vec<bool> = roads.map(|road| road.junction().is_none()).collect();
        let is_outside = |end: &LaneEnd| {
            let road = outside.get(end.lane.road as usize);
            road.copied().unwrap_or(false)
        };
        let joints = map.junction_joints().iter();
        let ends = joints.flat_map(|joint| [joint.from, joint.to]);
        used.lanes.extend(ends.filter(is_outside));
        for road in map.roads().iter().filter(|road| road.junction().is_some()) {
            let ends = map.joints_of(road).iter().map(|one| one.to);
            used.lanes.extend(ends.filter(is_outside));
        }
        for (junction, connection) in map.connections() {
            let Some(id) = connection.incoming_road() else {
                continue;
            };
            if connection.lane_links().next().is_none() {
                used.whole.insert((junction.index(), id));
            }
        }
        used
    }
}

fn check(
    used: &Used<'_>,
    (road, end): (&Road<'_>, ContactPoint),
    junction: &Junction<'_>,
    found: &mut Sink<'_>,
) {
    let enters = |lane: &LaneRef<'_, '_>| Traffic::of(*lane) == Traffic::Towards(end);
    let is_used = |lane: &LaneRef<'_, '_>| {
        let lane = lane.key();
        used.lanes.contains(&LaneEnd { lane, end })
    };
    let narrow = found.number(&NARROW);
    for lane in routes_at(road, end, narrow).filter(|lane| enters(lane) && !is_used(lane)) {
        let text = format!(
            "{} leads into junction `{}`, but no connection takes it up, so that nobody gets on from there; a lane \
             that leads into a junction should be the `from` of a lane link",
            lane_name(lane),
            junction.id()
        );
        found
            .issue(lane.node(), text)
            .at_lane_end(lane, end)
            .at(junction.node(), "the junction");
    }
}
