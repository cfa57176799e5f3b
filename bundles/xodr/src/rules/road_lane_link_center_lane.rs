use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    run,
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes().filter(|lane| lane.side().is_some()) {
        for end in ContactPoint::BOTH {
            for link in lane.links(end).filter(|link| link.id() == Some(0)) {
                let text = format!(
                    "the {} of {} is lane `0`; the center lane has no width and carries no traffic, so no other \
                     lane can continue as the center lane",
                    end.link_name(),
                    lane_name(lane)
                );
                found
                    .issue(Place::attribute_or_node(link.node(), "id"), text)
                    .at_lane_end(lane, end);
            }
        }
    }
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (_, connection) in map.connections() {
        for link in connection.lane_links() {
            let ends = [("from", link.from()), ("to", link.to())];
            let Some((name, _)) = ends.into_iter().find(|(_, id)| *id == Some(0)) else {
                continue;
            };
            let text = format!(
                "the lane link leads from lane `{}` to lane `{}`, but lane `0` is the center lane, which has no \
                 width and carries no traffic; neither of the lanes may be the center lane",
                link.node().attr("from").unwrap_or_default(),
                link.node().attr("to").unwrap_or_default()
            );
            found.issue(Place::attribute_or_node(link.node(), name), text);
        }
    }
}
