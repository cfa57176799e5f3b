use crate::families::cross_paths::{Crossing, Landing, crossings};
use crate::families::junction_area::{boundary, ring};
use crate::families::polygons::{contains, distance_to_boundary};
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.1,
    "m",
    "maximum distance by which a cross path may extend out of its junction",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.8.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for crossing in crossings(map) {
        let outside = match crossing.junction.kind() {
            Some(JunctionType::Virtual) => outside_of_range(map, &crossing),
            Some(JunctionType::Common) => outside_of_boundary(map, &crossing),
            _ => None,
        };
        let limit = found.number(&TOLERANCE);
        if let Some((outside, corner)) = outside.filter(|(outside, _)| *outside > limit) {
            let text = format!(
                "the cross path on road `{}` extends {outside:.2} m out of junction `{}`; it must lie within the \
                 junction",
                crossing.road.id(),
                crossing.junction.id()
            );
            found
                .issue(crossing.path.node(), text)
                .point(corner.x, corner.y, 0.0);
        }
    }
}

fn corners(crossing: &Crossing<'_, '_>) -> impl Iterator<Item = Point> {
    let ends = ContactPoint::BOTH.map(|end| crossing.corners(end));
    ends.into_iter().flatten().flatten()
}

/// Returns how far the crossing road extends beyond `sStart` to `sEnd` of the main road.
fn outside_of_range<'a>(map: &RoadMap<'a>, crossing: &Crossing<'_, 'a>) -> Option<(f64, Point)> {
    let junction = crossing.junction;
    let (from, to) = (junction.s_start()?, junction.s_end()?);
    let of_main = |one: &Landing<'_, '_>| junction.main_road() == Some(one.other.id());
    let landings = crossing.landings(map).filter(of_main);
    let beyond = landings.filter_map(|landing| {
        let corners = crossing.corners(landing.end)?.into_iter();
        let places = corners.filter_map(|corner| Some((landing.project(corner)?.0, corner)));
        let beyond = places.map(|(s, corner)| ((from - s).max(s - to), corner));
        beyond.max_by(|one, other| one.0.total_cmp(&other.0))
    });
    beyond.max_by(|one, other| one.0.total_cmp(&other.0))
}

/// Returns how far the crossing road extends beyond the boundary of the junction, if any.
fn outside_of_boundary<'a>(map: &RoadMap<'a>, crossing: &Crossing<'_, 'a>) -> Option<(f64, Point)> {
    let ring = ring(&boundary(map, crossing.junction)?);
    let outside = corners(crossing).filter(|corner| !contains(&ring, *corner));
    let outside = outside.map(|corner| (distance_to_boundary(corner, &ring), corner));
    outside.max_by(|one, other| one.0.total_cmp(&other.0))
}
