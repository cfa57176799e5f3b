use crate::families::on_road::OnRoad;
use crate::families::routes::{NARROW, routes_at};
use crate::prelude::*;
use foldhash::HashMap;
use qcbus_opendrive::Frame;

const NEAR: Param = Param::number(
    "near",
    0.05,
    "m",
    "largest distance between two road ends that touch, also in height",
);
const TURN: Param = Param::number(
    "turn",
    0.05,
    "rad",
    "largest difference between the directions of two road ends that touch",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[NEAR, TURN, NARROW],
    run,
    ..Rule::after(READABLE)
};

/// Maximum number of compared open ends per cell. More ends mean that roads are stacked.
const MOST_IN_CELL: usize = 16;

/// An end of a road without links from or to it.
struct Open<'m, 'a> {
    road: &'m Road<'a>,
    end: ContactPoint,
    frame: Frame,
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let near = found.number(&NEAR);
    let size = near.max(1e-6) * 2.0;
    let open: Vec<Open<'_, '_>> = open_ends(map, found.number(&NARROW)).collect();
    let mut grid: HashMap<[i64; 2], Vec<usize>> = HashMap::default();
    for (at, here) in open.iter().enumerate() {
        let cell = [here.frame.pose.x, here.frame.pose.y].map(|it| (it / size).floor() as i64);
        for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
            let beside = [cell[0].saturating_add(dx), cell[1].saturating_add(dy)];
            let others = grid.get(&beside).into_iter().flatten();
            for other in others.filter_map(|other| open.get(*other)) {
                if touch(other, here, near, found.number(&TURN)) {
                    report(other, here, found);
                }
            }
        }
        let places = grid.entry(cell).or_default();
        if places.len() < MOST_IN_CELL {
            places.push(at);
        }
    }
}

/// Returns the ends outside junctions where traffic arrives and no link exists.
fn open_ends<'m, 'a>(map: &'m RoadMap<'a>, narrow: f64) -> impl Iterator<Item = Open<'m, 'a>> {
    let outside = map.roads().iter().filter(|road| road.junction().is_none());
    let ends = outside.flat_map(|road| ContactPoint::BOTH.map(|end| (road, end)));
    ends.filter_map(move |(road, end)| {
        let own = RoadEnd::of(road, end);
        let linked = road.link(end).is_some() || map.contacts_of(own).next().is_some();
        if linked || routes_at(road, end, narrow).next().is_none() {
            return None;
        }
        Some(Open {
            road,
            end,
            frame: road.end_frame(end)?,
        })
    })
}

/// Checks whether one road continues as the other: at the same place and without turning back.
fn touch(one: &Open<'_, '_>, other: &Open<'_, '_>, near: f64, turn: f64) -> bool {
    let (here, there) = (one.frame, other.frame);
    let round = if one.end == other.end {
        std::f64::consts::PI
    } else {
        0.0
    };
    let bend = heading_difference(here.pose.hdg, there.pose.hdg + round);
    one.road.index() != other.road.index()
        && here.pose.point().distance(there.pose.point()) <= near
        && (here.z - there.z).abs() <= near
        && bend.is_some_and(|bend| bend.abs() <= turn)
}

fn report(one: &Open<'_, '_>, other: &Open<'_, '_>, found: &mut Sink<'_>) {
    let text = format!(
        "the {} of road `{}` continues as the {} of road `{}`, but neither road links to the other, so routes \
         end there; roads that continue should be linked in both directions",
        one.end,
        one.road.id(),
        other.end,
        other.road.id()
    );
    found
        .issue(one.road.node(), text)
        .at_end(one.road, one.end)
        .at(other.road.node(), "the other road");
}
