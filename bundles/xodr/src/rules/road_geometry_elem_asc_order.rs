use crate::families::on_road::OnRoad;
use crate::families::shown;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "values of s that differ by less than this count as equal",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.4.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        check(road, found);
    }
}

fn check(road: &Road<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let mut farthest = None;
    for geometry in road.plan_view().geometries() {
        let Some(s) = geometry.s() else { continue };
        let Some((before, most)) = farthest else {
            farthest = Some((geometry, s));
            continue;
        };
        let (level, text) = if s < most - tolerance {
            let text = format!(
                "this geometry starts at s = {} m and comes after one that starts at s = {} m; geometries must be \
                 listed in ascending order of s",
                shown::number(s),
                shown::number(most)
            );
            (Level::Error, text)
        } else if s <= most + tolerance {
            let text = format!(
                "this geometry starts at s = {} m like one before it, which therefore never applies; each should start \
                 further along the road",
                shown::number(s)
            );
            (Level::Warning, text)
        } else {
            farthest = Some((geometry, s));
            continue;
        };
        found
            .issue(Place::attribute_or_node(geometry.node(), "s"), text)
            .level(level)
            .on(road, s, 0.0)
            .at(before.node(), "the geometry before it");
    }
}
