use qcbus_opendrive::{Geometry, Road, RoadMap};
use qcbus_sdk::{Param, Rule, Sink};

use crate::families::on_road::OnRoad;
use crate::families::refline::{joints, shape_name};
use crate::model::{Part, Roads};

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance between two geometries that is accepted",
);

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_geometry_refline_no_gaps",
    uids: &[
        "asam.net:xodr:1.4.0:road.geometry.refline_no_gaps",
        "qcbus.dev:xodr:1.8.0:lane_smoothness.refline_no_horizontal_gaps",
    ],
    versions: "1.4.0..",
    after: super::READABLE,
    params: &[GAP],
    page: include_str!("road_geometry_refline_no_gaps.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for (one, next) in joints(road) {
            check(road, one, next, found);
        }
    }
}

fn check(road: &Road<'_>, one: &Geometry<'_>, next: &Geometry<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    let (Some(end), Some(start)) = (one.end_point(), next.start_point()) else {
        return;
    };
    let gap = end.distance(start);
    if gap <= limit {
        return;
    }
    let text = format!(
        "the geometry before it ({}) ends at ({:.3}, {:.3}), {gap:.3} m away from ({:.3}, {:.3}), where this \
         one ({}) starts; at most {limit} m is allowed",
        shape_name(one),
        end.x,
        end.y,
        start.x,
        start.y,
        shape_name(next)
    );
    found
        .issue(next.node(), text)
        .on(road, next.s().unwrap_or(0.0), 0.0)
        .at(one.node(), "the geometry before it")
        .point(end.x, end.y, 0.0);
}
