use crate::families::on_road::OnRoad;
use crate::families::routes::DIRECTED;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        let directed =
            |lane: &LaneRef<'_, '_>| lane.kind().is_some_and(|kind| DIRECTED.contains(&kind));
        let mut lanes = section.lanes().filter(directed);
        let all_reversed = lanes.all(|lane| lane.direction() == Some("reversed"));
        let on_both = Side::BOTH.map(|side| section.side(side).find(directed));
        let ([Some(left), Some(right)], true) = (on_both, all_reversed) else {
            continue;
        };
        let text = format!(
            "all traffic lanes on both sides of this lane section of road `{}` have `direction=\"reversed\"`; to \
             change between right-hand and left-hand traffic, `rule` of the road must be used",
            section.road.id()
        );
        found
            .issue(Place::attribute_or_node(left.node(), "direction"), text)
            .in_lane(left, 0.0)
            .at(
                Place::attribute_or_node(right.node(), "direction"),
                "a lane on the other side",
            );
    }
}
