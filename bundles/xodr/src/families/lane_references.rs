//! Lane numbers as references: links of lanes to lanes, lane links and boundaries of junctions.

use crate::prelude::*;
use qcbus_opendrive::JunctionLaneLink;
use qcbus_opendrive::LaneLink;
use qcbus_opendrive::SegmentStation;

/// Reports numbers in lane links that refer to no lane. It reports nothing if the target is unknown
/// because a road does not exist or is not linked. Other rules report that.
pub(crate) fn of_lanes(part: MapPart<'_, '_>, found: &mut Sink<'_>) {
    let map = part.map();
    for road in part.roads() {
        // Most links lead to a known lane and need no further check.
        let is_known = among(map.joints_of(road));
        for lane in road.sections().flat_map(SectionRef::lanes) {
            for end in ContactPoint::BOTH {
                for link in lane.links(end).filter(|link| !is_known(link.node())) {
                    let sections = candidates(map, lane, end, link);
                    demand_lane(link.node(), "id", &sections, found);
                }
            }
        }
    }
}

/// Reports the same for the lane links of junctions. `from` must be a lane of the incoming road,
/// `to` a lane of the connecting or linked road.
pub(crate) fn of_junctions(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let is_known = among(map.junction_joints());
    for (junction, connection) in map.connections() {
        let links = connection.lane_links();
        for link in links.filter(|link| !is_known(link.node())) {
            let to = target(map, connection, link);
            demand_lane(link.node(), "to", to.as_slice(), found);
            let from = incoming(map, junction, connection, link);
            demand_lane(link.node(), "from", &from, found);
        }
    }
}

/// Reports the same for the boundaries of junctions. A segment along a lane must have the lane
/// somewhere between its ends, a segment across a road must have it at the end of the road.
pub(crate) fn of_boundaries(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let boundaries = map.junctions().iter().filter_map(Junction::boundary);
    for segment in boundaries.flat_map(|boundary| boundary.segments()) {
        let Some(road) = segment.road_id().and_then(|id| map.road(id)) else {
            continue;
        };
        let lanes = [
            ("boundaryLane", segment.boundary_lane(), "lane"),
            ("jointLaneStart", segment.joint_lane_start(), "joint"),
            ("jointLaneEnd", segment.joint_lane_end(), "joint"),
        ];
        for (name, id, kind) in lanes {
            // The center lane is the line from which the others are counted.
            let id = id.filter(|id| *id != 0 && segment.kind() == Some(kind));
            if let Some(id) = id {
                demand_lane(segment.node(), name, &crossed(road, segment, id), found);
            }
        }
    }
}

/// Returns the lane sections of a segment of a boundary.
fn crossed<'m, 'a>(
    road: &'m Road<'a>,
    segment: BoundarySegment<'a>,
    id: i64,
) -> Vec<SectionRef<'m, 'a>> {
    let at_end = |end| end_section(road, Some(id), LayerKind::Permanent, end);
    if segment.kind() == Some("joint") {
        let section = segment.contact_point().and_then(at_end);
        return section.into_iter().collect();
    }
    let station = |station: SegmentStation| match station {
        SegmentStation::S(s) => Some(s),
        SegmentStation::End(end) => road.end_s(end),
    };
    let ends = segment.s_start().and_then(station);
    let ends = ends.zip(segment.s_end().and_then(station));
    ends.map_or_else(Vec::new, |(from, to)| {
        let range = [from.min(to), from.max(to)];
        sections_between(road, LayerKind::Permanent, Side::of_lane_id(id), range)
    })
}

/// Returns a function that checks whether a link is one of those that lead to a lane.
fn among(joints: &[LaneJoint<'_>]) -> impl Fn(Node<'_>) -> bool {
    let mut known: Vec<u32> = joints.iter().map(|one| one.node.index()).collect();
    known.sort_unstable();
    move |link| known.binary_search(&link.index()).is_ok()
}

/// Returns the lane sections, one of which must have the lane that a lane link names.
fn candidates<'m, 'a>(
    map: &'m RoadMap<'a>,
    lane: LaneRef<'m, 'a>,
    end: ContactPoint,
    link: LaneLink<'a>,
) -> Vec<SectionRef<'m, 'a>> {
    if let Some((section, _)) = map.linked_section(lane, end, link.id(), link.layer()) {
        return vec![section];
    }
    // Roads of virtual junctions are linked to a position inside the main road.
    let is_last = lane.is_at_road_end(end);
    let road_link = lane.at.road.link(end).filter(|_| is_last);
    let within = road_link.and_then(|link| Some((map.road(link.road_id()?)?, link.element_s()?)));
    let side = link.id().and_then(Side::of_lane_id);
    within.map_or_else(Vec::new, |(road, s)| {
        sections_between(road, link.layer(), side, [s, s])
    })
}

/// Returns the lane section of the connecting or linked road in which a lane link ends.
fn target<'m, 'a>(
    map: &'m RoadMap<'a>,
    connection: Connection<'a>,
    link: JunctionLaneLink<'a>,
) -> Option<SectionRef<'m, 'a>> {
    let road = map.road(connection.target_road()?)?;
    let end = connection.contact_point()?;
    end_section(road, link.to(), link.to_layer(), end)
}

/// Returns the lane sections of the incoming road in which a lane link may begin: the one at the
/// junction, or on the main road of a virtual junction all along it.
fn incoming<'m, 'a>(
    map: &'m RoadMap<'a>,
    junction: &Junction<'a>,
    connection: Connection<'a>,
    link: JunctionLaneLink<'a>,
) -> Vec<SectionRef<'m, 'a>> {
    let Some(road) = connection.incoming_road().and_then(|id| map.road(id)) else {
        return Vec::new();
    };
    let is_virtual = junction.kind() == Some(JunctionType::Virtual);
    if is_virtual && junction.main_road() == Some(road.id()) {
        let side = link.from().and_then(Side::of_lane_id);
        let range = junction.s_start().zip(junction.s_end());
        return range.map_or_else(Vec::new, |(start, end)| {
            sections_between(road, link.from_layer(), side, [start, end])
        });
    }
    let target = connection.target_road().and_then(|id| map.road(id));
    let end = match (target, connection.contact_point()) {
        (Some(target), Some(contact)) => map.incoming_end(junction, road, target, contact),
        _ => match map.ends_at(junction, road) {
            [true, false] => Some(ContactPoint::Start),
            [false, true] => Some(ContactPoint::End),
            _ => None,
        },
    };
    let section = end.and_then(|end| end_section(road, link.from(), link.from_layer(), end));
    section.into_iter().collect()
}

fn end_section<'m, 'a>(
    road: &'m Road<'a>,
    id: Option<i64>,
    layer: LayerKind,
    end: ContactPoint,
) -> Option<SectionRef<'m, 'a>> {
    let side = id.and_then(Side::of_lane_id).unwrap_or(Side::Right);
    road.layer(layer)?.end_section(road, side, end)
}

/// Returns the lane sections of a side between two values of s, including those that begin or end
/// there.
fn sections_between<'m, 'a>(
    road: &'m Road<'a>,
    layer: LayerKind,
    side: Option<Side>,
    [from, to]: [f64; 2],
) -> Vec<SectionRef<'m, 'a>> {
    let Some(layer) = road.layer(layer) else {
        return Vec::new();
    };
    let side = side.unwrap_or(Side::Right);
    let first = layer.section_at(road, side, Station::before(from.max(0.0)));
    let first = first.or_else(|| layer.section_at(road, side, from));
    let begin = first.and_then(|section| section.s()).unwrap_or(from);
    let meets = |section: &SectionRef<'_, '_>| {
        section.covers(side) && section.s().is_some_and(|s| s >= begin && s <= to)
    };
    layer.sections(road).filter(meets).collect()
}

/// Reports a lane number that none of the sections has, unless there are no sections.
fn demand_lane(
    link: Node<'_>,
    attribute: &str,
    sections: &[SectionRef<'_, '_>],
    found: &mut Sink<'_>,
) {
    let (Some(id), Some(section)) = (link.attr(attribute), sections.first()) else {
        return;
    };
    // Lane ids are whole numbers, so `-1` and ` -01` are the same lane.
    let number = id.trim().parse::<i64>().ok();
    let is_it = |lane: LaneRef<'_, '_>| {
        lane.id_text() == Some(id) || (number.is_some() && lane.id() == number)
    };
    let mut lanes = sections
        .iter()
        .flat_map(|section| section.lanes())
        .peekable();
    // Another rule reports sections without lanes and the links to them.
    if lanes.peek().is_none() || lanes.any(is_it) {
        return;
    }
    let text = format!(
        "`{attribute}=\"{id}\"` of `{}` refers to a lane that is not defined in the {} lane section",
        link.name(),
        if link.is("segment") {
            "road's"
        } else {
            "linked"
        }
    );
    found
        .issue(Place::attribute_or_node(link, attribute), text)
        .at(section.node(), "the lane section without this lane");
}
