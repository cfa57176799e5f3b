use std::collections::BTreeMap;

use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    // Another rule reports such a junction, and nothing is certain about its roads.
    if map.has_reserved_junction() {
        return;
    }
    // The lanes that are linked to each lane end, across roads that belong to no junction.
    let mut named: BTreeMap<LaneEnd, Vec<(LaneRef<'_, '_>, &LaneJoint<'_>)>> = BTreeMap::new();
    for joint in map.roads().iter().flat_map(|road| map.joints_of(road)) {
        let lanes = map.lane(joint.from.lane).zip(map.lane(joint.to.lane));
        let Some((from, to)) = lanes else { continue };
        let across = from.at.road.index() != to.at.road.index();
        let free = from.at.road.junction().is_none() && to.at.road.junction().is_none();
        if across && free {
            named.entry(joint.to).or_default().push((from, joint));
        }
    }
    for (end, links) in named {
        let [(first, joint), rest @ ..] = links.as_slice() else {
            continue;
        };
        let other = rest.iter().find(|(lane, _)| !together(*first, *lane));
        let (Some((other, second)), Some(lane)) = (other, map.lane(end.lane)) else {
            continue;
        };
        let text = format!(
            "{} and {} are both linked to the {} of {}; if it is not clear which lane continues there, a \
             junction must be used",
            lane_name(*first),
            lane_name(*other),
            end.end,
            lane_name(lane)
        );
        found
            .issue(joint.node, text)
            .at_lane_end(*first, joint.from.end)
            .at(second.node, "the other link")
            .at_lane_end(*other, second.from.end);
    }
}

/// Checks whether two lanes may merge. They must lie in one lane section on one side, or on the two
/// layers of one road. Only one of the layers is valid at a time.
fn together(one: LaneRef<'_, '_>, other: LaneRef<'_, '_>) -> bool {
    let (one_road, other_road) = (one.at.road.index(), other.at.road.index());
    let layers = one.at.layer.kind() != other.at.layer.kind();
    let beside = one.at.index() == other.at.index() && one.side() == other.side();
    one_road == other_road && (layers || beside)
}
