use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::is_route;
use crate::prelude::*;
use foldhash::HashSet;

const FAR: Param = Param::number(
    "far",
    10.0,
    "m",
    "a linked lane that lies farther away than this is a wrong link, regardless of its direction",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[FAR],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut told = HashSet::default();
    let mut told_roads = HashSet::default();
    for joint in map.roads().iter().flat_map(|road| map.joints_of(road)) {
        let lanes = map.lane(joint.from.lane).zip(map.lane(joint.to.lane));
        let are_routes = |(from, to): &(LaneRef<'_, '_>, LaneRef<'_, '_>)| {
            is_route(*from) && (from.kind() == to.kind() || is_route(*to))
        };
        let Some((from, to)) = lanes.filter(are_routes) else {
            continue;
        };
        let Some(collide) = against(joint, from, to) else {
            continue;
        };
        if is_elsewhere(joint, from, to, found.number(&FAR)) {
            continue;
        }
        // If the traffic rules of two roads differ, this is one fault per pair of roads, not per
        // lane.
        let rules = rules(from, to);
        let (one, other) = (from.at.road.index(), to.at.road.index());
        let is_new = match rules {
            Some(_) => told_roads.insert((one.min(other), one.max(other))),
            None => told.insert((joint.from.min(joint.to), joint.from.max(joint.to))),
        };
        if is_new {
            report(joint, from, to, (collide, rules), found);
        }
    }
}

/// Describes the conflict between two lanes, or returns `None` if traffic can continue.
fn against(
    joint: &LaneJoint<'_>,
    from: LaneRef<'_, '_>,
    to: LaneRef<'_, '_>,
) -> Option<&'static str> {
    let (Traffic::Towards(one), Traffic::Towards(other)) = (Traffic::of(from), Traffic::of(to))
    else {
        return None;
    };
    match (one == joint.from.end, other == joint.to.end) {
        (true, true) => Some("traffic on each of them runs towards the other"),
        (false, false) => Some("traffic on each of them runs away from the other"),
        _ => None,
    }
}

/// Checks whether two lanes are so far apart that the link is wrong, not the direction.
fn is_elsewhere(
    joint: &LaneJoint<'_>,
    from: LaneRef<'_, '_>,
    to: LaneRef<'_, '_>,
    far: f64,
) -> bool {
    let edges = from
        .borders_at(joint.from.end)
        .zip(to.borders_at(joint.to.end));
    edges.is_some_and(|([one, _], [other, _])| one.point.plan().distance(other.point.plan()) > far)
}

/// Returns the traffic rules of two roads if they differ.
fn rules(from: LaneRef<'_, '_>, to: LaneRef<'_, '_>) -> Option<[&'static str; 2]> {
    let (one, other) = (from.at.road.traffic_rule()?, to.at.road.traffic_rule()?);
    let name = |rule| match rule {
        TrafficRule::RightHand => "right-hand traffic",
        TrafficRule::LeftHand => "left-hand traffic",
    };
    (one != other).then(|| [name(one), name(other)])
}

fn report(
    joint: &LaneJoint<'_>,
    from: LaneRef<'_, '_>,
    to: LaneRef<'_, '_>,
    (collide, rules): (&str, Option<[&str; 2]>),
    found: &mut Sink<'_>,
) {
    let [one, other] = [from.at.road.id(), to.at.road.id()];
    let because = match rules {
        Some([here, there]) => {
            format!(", because road `{one}` has {here} and road `{other}` has {there} (`rule`)")
        }
        None => String::new(),
    };
    let text = format!(
        "the {} of {} is {}, but {collide}{because}; linked lanes must have the same direction of travel",
        joint.from.end.link_name(),
        lane_name(from),
        lane_name(to)
    );
    let mut finding = found
        .issue(joint.node, text)
        .at_lane_end(from, joint.from.end)
        .at(to.node(), "the linked lane");
    if let Some([here, there]) = rules {
        for (road, rule) in [(from.at.road.node(), here), (to.at.road.node(), there)] {
            let place = Place::attribute_or_node(road, "rule");
            finding = finding.at(place, format!("the road with {rule}"));
        }
    }
}
