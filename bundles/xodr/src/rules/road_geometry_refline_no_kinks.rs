use crate::families::gap_levels::{KINK_BROKEN_FROM, KINK_ERROR_FROM};
use crate::families::on_road::OnRoad;
use crate::families::refline::{joints, shape_name, standstill};
use crate::families::routes::is_route;
use crate::prelude::*;

const KINK: Param = Param::number(
    "kink",
    0.01,
    "rad",
    "largest difference between two headings that is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:road.geometry.refline_no_kinks",
        "qcbus.dev:xodr:1.8.0:lane_smoothness.refline_no_horizontal_kinks",
    ],
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[KINK, KINK_ERROR_FROM, KINK_BROKEN_FROM],
    each: Some(each),
    ..Rule::after(READABLE)
};

/// First version with rules about smooth lanes.
const ANNEX_D: Version = Version::new(1, 8);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for (one, next) in joints(road) {
            check(road, one, next, found);
        }
        for geometry in road.plan_view().geometries() {
            if let Some(at) = standstill(geometry) {
                let text = format!(
                    "the {} has no direction at parameter {at}, because both of its coordinates are stationary \
                     there; a reference line should have no kinks",
                    shape_name(geometry)
                );
                found
                    .issue(geometry.shape_node().unwrap_or(geometry.node()), text)
                    .road(road.id(), geometry.s().unwrap_or(0.0), 0.0);
            }
        }
    }
}

fn check(road: &Road<'_>, one: &Geometry<'_>, next: &Geometry<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&KINK);
    let (Some(end), Some(start)) = (one.end(), next.start()) else {
        return;
    };
    let Some(kink) = heading_difference(end.hdg, start.hdg).filter(|kink| *kink > limit) else {
        return;
    };
    let text = format!(
        "the geometry before it ({}) ends with a heading of {:.4} rad, but this one ({}) starts with {:.4} rad; \
         they should differ by at most {limit} rad, but differ by {kink:.4} rad ({:.2}°)",
        shape_name(one),
        end.hdg,
        shape_name(next),
        start.hdg,
        kink.to_degrees()
    );
    // Section 9.2 says "should", annex D.1.3 says "shall".
    let demanded = found.version() >= Some(ANNEX_D);
    // People on foot turn at a corner.
    let for_vehicles = || road.sections().any(|section| section.lanes().any(is_route));
    let is_broken = kink >= found.number(&KINK_BROKEN_FROM) && for_vehicles();
    let is_error = is_broken || (demanded && kink >= found.number(&KINK_ERROR_FROM));
    let level = if is_error {
        Level::Error
    } else {
        Level::Warning
    };
    found
        .issue(next.node(), text)
        .level(level)
        .on(road, next.s().unwrap_or(0.0), 0.0)
        .at(one.node(), "the geometry before it");
}
