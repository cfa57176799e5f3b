use foldhash::HashMap;
use qcbus_opendrive::geometry::Point;
use qcbus_opendrive::{ContactPoint, Road, RoadEnd, RoadMap};
use qcbus_sdk::{Param, Rule, Sink};

use crate::families::on_road::OnRoad;
use crate::families::routes::common_junction;
use crate::model::Roads;

const FAR: Param = Param::number(
    "far",
    2.0,
    "m",
    "how far a connecting road must end from the road that it names for this to be a wrong link, not a gap",
);
const NEAR: Param = Param::number(
    "near",
    0.1,
    "m",
    "how near, along its direction, another road of the junction must begin to be the one that is meant",
);

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_junctions_connecting_road_place",
    uids: &["qcbus.dev:xodr:1.4.0:junctions.connecting_road_place"],
    versions: "1.4.0..",
    after: super::READABLE,
    params: &[FAR, NEAR],
    page: include_str!("junctions_connecting_road_place.md"),
    run,
    ..Rule::DEFAULTS
};

/// Roads around one junction that are looked at. No real junction has as many.
const MOST_ARMS: usize = 64;

/// How many times as far as the road that is meant the one that is named must be.
const BESIDE: f64 = 3.0;

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut arms: HashMap<&str, Vec<RoadEnd>> = HashMap::default();
    for road in map.roads() {
        for end in ContactPoint::BOTH {
            let Some(id) = road.link(end).and_then(|link| link.junction_id()) else {
                continue;
            };
            let arms = arms.entry(id).or_default();
            if arms.len() < MOST_ARMS {
                arms.push(RoadEnd {
                    road: road.index(),
                    end,
                });
            }
        }
    }
    for road in map.roads() {
        let arms = common_junction(map, road).and_then(|junction| arms.get(junction.id()));
        for end in ContactPoint::BOTH {
            if let Some(arms) = arms {
                check(map, (road, end), arms, found);
            }
        }
    }
}

fn check<'a>(
    map: &RoadMap<'a>,
    (road, end): (&Road<'a>, ContactPoint),
    arms: &[RoadEnd],
    found: &mut Sink<'_>,
) {
    let place = |at: RoadEnd| Some(map.road_at(at.road)?.end_pose(at.end)?.point());
    let linked = map.linked_end(road, end);
    let here = road.end_pose(end).map(|pose| pose.point());
    let (Some(linked), Some(here)) = (linked, here) else {
        return;
    };
    let distance = |at: RoadEnd| place(at).map(|there: Point| here.distance(there));
    let far = found.number(&FAR);
    let Some(away) = ahead(map, linked.to, here).filter(|away| *away > far) else {
        return;
    };
    let away = distance(linked.to).unwrap_or(away);
    // The road that is meant begins here, if not exactly on the reference line, and much nearer than the other one.
    let near = found.number(&NEAR);
    let is_here = |arm: &&RoadEnd| {
        let beside = distance(**arm).filter(|beside| far + BESIDE * beside < away);
        beside.is_some() && ahead(map, **arm, here).is_some_and(|it| it <= near)
    };
    let Some((arm, other)) = arms
        .iter()
        .find(is_here)
        .and_then(|arm| Some((arm, map.road_at(arm.road)?)))
    else {
        return;
    };
    let named = map.road_at(linked.to.road).map_or("", |road| road.id());
    let text = format!(
        "the {} of the connecting road `{}` is the {} of road `{named}`, which lies {away:.1} m away, while the {} of \
         road `{}` lies there; a connecting road must name the road that it meets",
        end.link_name(),
        road.id(),
        linked.to.end,
        arm.end,
        other.id()
    );
    found
        .issue(linked.node, text)
        .at_end(road, end)
        .at(other.node(), "the road that lies there");
}

/// How far a place lies before or behind a road end, as the road runs there. How far it lies beside it says little:
/// reference lines of connecting roads need not meet those of the roads around.
fn ahead(map: &RoadMap<'_>, end: RoadEnd, place: Point) -> Option<f64> {
    let pose = map.road_at(end.road)?.end_pose(end.end)?;
    let (sin, cos) = pose.hdg.sin_cos();
    let along = (place.x - pose.x) * cos + (place.y - pose.y) * sin;
    Some(along.abs())
}
