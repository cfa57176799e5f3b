use crate::families::network::{Parts, Piece};
use crate::families::on_road::OnRoad;
use crate::prelude::*;

const SHARE: Param = Param::number(
    "share",
    0.25,
    "",
    "a part of the network with at most this fraction of the length of the largest part is an island",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[SHARE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let pieces = Parts::of(map).pieces(map);
    let by_length = |one: &&Piece, other: &&Piece| one.length.total_cmp(&other.length);
    let Some(largest) = pieces.iter().max_by(by_length) else {
        return;
    };
    let share = found.number(&SHARE);
    let small =
        |piece: &&Piece| piece.first != largest.first && piece.length <= share * largest.length;
    // If most roads are isolated, the map is a collection of roads and not a network.
    let alone = pieces.iter().filter(small).count();
    if largest.roads < 2 || alone >= largest.roads {
        return;
    }
    for piece in pieces.iter().filter(small) {
        let Some(road) = map.road_at(piece.first) else {
            continue;
        };
        let with = match piece.roads {
            1 => String::new(),
            count => format!(" and {} roads linked to it", count - 1),
        };
        let text = format!(
            "no link leads from road `{}`{with} ({:.0} m in total) to the rest of the map ({} roads, {:.0} m); \
             no route leads there",
            road.id(),
            piece.length,
            largest.roads,
            largest.length
        );
        found.issue(road.node(), text).on(road, 0.0, 0.0);
    }
}
