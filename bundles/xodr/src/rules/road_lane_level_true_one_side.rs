use crate::families::faults::OfFault as _;
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            outward(section, side, found);
        }
    }
    for joint in map.part(part).lane_joints() {
        along(map, joint, found);
    }
}

/// Checks that all lanes outside of the first one with `@level="true"` have this attribute too.
fn outward(section: SectionRef<'_, '_>, side: Side, found: &mut Sink<'_>) {
    let mut level: Option<LaneRef<'_, '_>> = None;
    for lane in section.side(side).filter(|lane| lane.id().is_some()) {
        match (lane.level(), level) {
            (Some(true), None) => level = Some(lane),
            (Some(false), Some(inner)) => {
                let text = format!(
                    "{} follows the lateral profile, but lane `{}` further inside has `level=\"true\"`; from \
                     that lane to the edge of the road, every lane must have it",
                    lane_name(lane),
                    inner.id_text().unwrap_or_default()
                );
                let middle = lane.length().unwrap_or(0.0) / 2.0;
                found
                    .issue(Place::attribute_or_node(lane.node(), "level"), text)
                    .in_lane(lane, middle)
                    .at(inner.node(), "the lane further inside")
                    .fault(format!("levels of road {}", lane.at.road.index()));
            }
            _ => {}
        }
    }
}

/// Reports a change of `@level` between linked lanes, which is not recommended (11.7.4).
fn along(map: &RoadMap<'_>, joint: &LaneJoint<'_>, found: &mut Sink<'_>) {
    let (Some(from), Some(to)) = (map.lane(joint.from.lane), map.lane(joint.to.lane)) else {
        return;
    };
    let (Some(here), Some(there)) = (from.level(), to.level()) else {
        return;
    };
    if here != there {
        let text = format!(
            "`level` changes from {here} in {} to {there} in the linked {}; it should stay the same",
            lane_name(from),
            lane_name(to)
        );
        found
            .issue(from.node(), text)
            .level(Level::Warning)
            .at_lane_end(from, joint.from.end)
            .at(to.node(), "the linked lane")
            .at(joint.node, "the link")
            .at_joint([(from, joint.from.end), (to, joint.to.end)]);
    }
}
