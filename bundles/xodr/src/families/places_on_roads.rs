//! Places on roads that elements name by `s`, often of another road than the one around them.

use super::object_parts::{below, named, number};
use super::shown;
use crate::prelude::*;

/// An element with a place on a road, by name and parent.
struct NamedPlaces {
    name: &'static str,
    parent: &'static str,
    /// Attribute with the id of the road. Without it, the road is the one around the element.
    road: Option<&'static str>,
    /// Attributes with places.
    places: &'static [&'static str],
}

const fn on(
    parent: &'static str,
    name: &'static str,
    road: Option<&'static str>,
    places: &'static [&'static str],
) -> NamedPlaces {
    NamedPlaces {
        name,
        parent,
        road,
        places,
    }
}

const RANGE: &[&str] = &["sStart", "sEnd"];

const PLACES: [NamedPlaces; 7] = [
    on("switch", "mainTrack", Some("id"), &["s"]),
    on("switch", "sideTrack", Some("id"), &["s"]),
    on("signal", "positionRoad", Some("roadId"), &["s"]),
    on("surface", "CRG", None, RANGE),
    on("platform", "segment", Some("roadId"), RANGE),
    on("boundary", "segment", Some("roadId"), RANGE),
    on("junction", "roadSection", Some("roadId"), RANGE),
];

/// Points of outlines and skeletons in coordinates of the road.
const POINTS: [(&str, &str); 2] = [("outline", "cornerRoad"), ("polyline", "vertexRoad")];

/// Reports places beyond the end of their road: more than `near` metres for single places, and more
/// than `far` metres for points of objects, which may extend beyond the end of a road.
pub(crate) fn check(map: &RoadMap<'_>, [near, far]: [f64; 2], found: &mut Sink<'_>) {
    for places in &PLACES {
        for node in below(map, places.name, places.parent) {
            let road = match places.road {
                Some(attribute) => node.attr(attribute).and_then(|id| map.road(id)),
                None => map.road_of(node),
            };
            if let Some(road) = road {
                place(road, node, places.places, near, found);
            }
        }
    }
    for (parent, name) in POINTS {
        points(map, parent, name, far, found);
    }
    explicit_lines(map, near, found);
}

/// Reports the first of the places of an element that is beyond the end of the road.
fn place(
    road: &Road<'_>,
    node: Node<'_>,
    attributes: &[&'static str],
    near: f64,
    found: &mut Sink<'_>,
) {
    let Some(length) = road.length() else { return };
    let beyond =
        |name: &'static str| Some((name, number(node, name).filter(|s| *s > length + near)?));
    let Some((name, s)) = attributes.iter().copied().find_map(beyond) else {
        return;
    };
    let text = format!(
        "`{name}` of {} is {}, but road `{}` is {} m long; the place must lie on the road",
        named(node),
        shown::number(s),
        road.id(),
        shown::number(length)
    );
    found
        .issue(Place::attribute_or_node(node, name), text)
        .level(Level::Warning)
        .road(road.id(), s, number(node, "t").unwrap_or(0.0));
}

/// Reports the point of each outline or polyline that lies farthest beyond the ends of the road.
fn points(
    map: &RoadMap<'_>,
    parent: &'static str,
    name: &'static str,
    far: f64,
    found: &mut Sink<'_>,
) {
    for list in map
        .root()
        .into_iter()
        .flat_map(|root| root.descendants_named(parent))
    {
        let road = map.road_of(list).filter(|_| !is_user_data(list));
        let Some((road, length)) = road.and_then(|road| Some((road, road.length()?))) else {
            continue;
        };
        let outside = |point: Node<'_>| number(point, "s").map(|s| (s, (s - length).max(-s)));
        let points = list.children_named(name);
        let points = points.filter_map(|point| Some((point, outside(point)?)));
        let worst = points.max_by(|one, other| one.1.1.total_cmp(&other.1.1));
        let Some((point, (s, _))) = worst.filter(|(_, (_, beyond))| *beyond > far) else {
            continue;
        };
        let text = format!(
            "a point of this `{parent}` is at s = {}, but road `{}` extends from s = 0 to s = {}; the points should \
             lie beside the road",
            shown::number(s),
            road.id(),
            shown::number(length)
        );
        found
            .issue(Place::attribute_or_node(point, "s"), text)
            .level(Level::Warning)
            .road(road.id(), s, number(point, "t").unwrap_or(0.0));
    }
}

/// Reports lines of a road mark that reach beyond the lane section.
fn explicit_lines(map: &RoadMap<'_>, near: f64, found: &mut Sink<'_>) {
    let document = map.root().map(|root| root.document());
    let is_used = document.is_some_and(|it| it.elements("explicit").next().is_some());
    for lane in map.lanes().filter(|_| is_used) {
        let Some(length) = lane.length().filter(|length| *length > 0.0) else {
            continue;
        };
        for mark in lane.elements("roadMark") {
            let from = number(mark, "sOffset").unwrap_or(0.0);
            let lines = mark
                .children_named("explicit")
                .flat_map(|explicit| explicit.children_named("line"));
            for line in lines {
                let Some(offset) = number(line, "sOffset") else {
                    continue;
                };
                let end = from + offset + number(line, "length").unwrap_or(0.0);
                if end <= length + near {
                    continue;
                }
                let text = format!(
                    "the line extends from sOffset = {} to sOffset = {} of the lane section, but the lane section is \
                     {} m long; it must end in the section",
                    shown::number(from + offset),
                    shown::number(end),
                    shown::number(length)
                );
                found
                    .issue(Place::attribute_or_node(line, "sOffset"), text)
                    .level(Level::Warning)
                    .road(lane.at.road.id(), lane.at.s().unwrap_or(0.0) + end, 0.0);
            }
        }
    }
}
