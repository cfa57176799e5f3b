use std::f64::consts::PI;

use crate::families::on_road::OnRoad;
use crate::families::touching::KINK;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    params: &[KINK],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        if junction.kind() == Some(JunctionType::Direct)
            && let Some(contact) = map.connection_contact(junction, connection)
        {
            check(map, &contact, found);
        }
    }
}

fn check(map: &RoadMap<'_>, contact: &RoadContact<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&KINK);
    let (Some(road), Some(ramp)) = (map.road_at(contact.from.road), map.road_at(contact.to.road))
    else {
        return;
    };
    let turn = if contact.from.end == contact.to.end {
        PI
    } else {
        0.0
    };
    let poses = road
        .end_pose(contact.from.end)
        .zip(ramp.end_pose(contact.to.end));
    let Some(kink) = poses.and_then(|(one, other)| heading_difference(one.hdg, other.hdg + turn))
    else {
        return;
    };
    if kink > limit {
        let text = format!(
            "the {} of road `{}` and the {} of road `{}`, which a direct junction links, have headings that \
             differ by {kink:.4} rad ({:.2}°); at most {limit} rad is allowed",
            contact.from.end,
            road.id(),
            contact.to.end,
            ramp.id(),
            kink.to_degrees()
        );
        found
            .issue(contact.node, text)
            .at_end(road, contact.from.end)
            .at(ramp.node(), "the linked road")
            .at_end(ramp, contact.to.end);
    }
}
