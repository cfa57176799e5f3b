//! Branches off the main road of a virtual junction (OpenDRIVE 1.9, 12.7).

use crate::prelude::*;
use qcbus_opendrive::geometry::Pose;

/// An end of a connecting road that is linked to the main road of its virtual junction.
pub(crate) struct Branch<'m, 'a> {
    pub main: &'m Road<'a>,
    pub road: &'m Road<'a>,
    /// The end of the connecting road at the main road.
    pub end: ContactPoint,
    pub link: RoadLink<'a>,
    /// s on the main road, in metres.
    pub s: f64,
}

/// Returns the roads of virtual junctions with their junction, without crossing roads.
pub(crate) fn connecting_roads<'m, 'a>(
    map: &'m RoadMap<'a>,
) -> impl Iterator<Item = (&'m Junction<'a>, &'m Road<'a>)> {
    map.roads().iter().filter_map(|road| {
        let junction = map.junction(road.junction()?)?;
        let is_virtual = junction.kind() == Some(JunctionType::Virtual);
        let crosses =
            |path: qcbus_opendrive::CrossPath<'_>| path.crossing_road() == Some(road.id());
        (is_virtual && !junction.cross_paths().any(crosses)).then_some((junction, road))
    })
}

/// Returns the ends at which a road of a virtual junction is linked to the main road.
pub(crate) fn branches<'m, 'a>(
    map: &'m RoadMap<'a>,
    junction: &'m Junction<'a>,
    road: &'m Road<'a>,
) -> Vec<Branch<'m, 'a>> {
    let Some(main) = junction.main_road().and_then(|id| map.road(id)) else {
        return Vec::new();
    };
    let ends = ContactPoint::BOTH.into_iter();
    let linked = ends.filter_map(|end| {
        let link = road
            .link(end)
            .filter(|link| link.road_id() == Some(main.id()))?;
        let at_end = || main.end_s(link.contact_point()?);
        let s = link.element_s().or_else(at_end)?;
        Some(Branch {
            main,
            road,
            end,
            link,
            s,
        })
    });
    linked.collect()
}

/// Returns all branches of all virtual junctions.
pub(crate) fn all_branches<'m, 'a>(map: &'m RoadMap<'a>) -> impl Iterator<Item = Branch<'m, 'a>> {
    connecting_roads(map).flat_map(|(junction, road)| branches(map, junction, road))
}

/// Returns the distance ahead and to the left of a point seen from a pose, in metres.
pub(crate) fn seen_from(pose: Pose, point: Point) -> (f64, f64) {
    let (sin, cos) = pose.hdg.sin_cos();
    let (dx, dy) = (point.x - pose.x, point.y - pose.y);
    (dx * cos + dy * sin, dy * cos - dx * sin)
}
