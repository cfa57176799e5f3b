//! Positions that name a road of the map.

use qcbus_opendrive::{LaneRef, Road, RoadMap, SectionRef, Side, Station};

use crate::queries::element::Element;
use crate::types::road_network::LaneAt;

/// Tolerance in metres beyond an end of a road. A position within it is still on the road, because
/// digits may have been rounded away.
pub const AT_END: f64 = 1e-3;

/// Returns the road that a position names, if the map has exactly one of this id.
pub fn road_of<'m, 'r>(position: Element<'_, '_>, map: &'m RoadMap<'r>) -> Option<&'m Road<'r>> {
    let id = position.text("roadId")?;
    let mut roads = map.roads_with_id(&id);
    let road = roads.next()?;
    roads.next().is_none().then_some(road)
}

/// Returns the station that a position names. A rounding error at the ends is corrected. Returns
/// `None` if the station is unknown or beyond the road's ends.
pub fn station(position: Element<'_, '_>, road: &Road<'_>) -> Option<f64> {
    let s = position.number("s")?;
    let length = road.length()?;
    let slack = AT_END + length * 1e-6;
    (s >= -slack && s <= length + slack).then(|| s.clamp(0.0, length))
}

/// Parses the id of a lane. Returns `None` if it is no integer.
pub fn lane_id(text: &str) -> Option<i64> {
    text.trim_matches([' ', '\t', '\r', '\n']).parse().ok()
}

/// Returns the lane at a station. Where two lane sections meet, the lanes of both count. Lanes of
/// temporary layers count too. A simulator may use any of them.
pub fn find_lane<'m, 'r>(road: &'m Road<'r>, s: f64, id: i64) -> LaneAt<'m, 'r> {
    let found = LaneAt::of(road, s, id);
    let LaneAt::None(section) = found else {
        return found;
    };
    let side = Side::of_lane_id(id).unwrap_or(Side::Right);
    for layer in road.layers() {
        for station in [Station::at(s), Station::before(s)] {
            let at = layer.section_at(road, side, station);
            if let Some(lane) = at.and_then(|section| section.lane(id)) {
                return LaneAt::Lane(lane);
            }
        }
    }
    if section.lanes().any(|lane| lane.id().is_none()) {
        return LaneAt::Unknown;
    }
    LaneAt::None(section)
}

/// Returns the lane that a `LanePosition` names.
pub fn lane_of<'m, 'r>(
    position: Element<'_, '_>,
    road: &'m Road<'r>,
) -> Option<(LaneRef<'m, 'r>, f64)> {
    let s = station(position, road)?;
    let id = lane_id(&position.text("laneId")?)?;
    match find_lane(road, s, id) {
        LaneAt::Lane(lane) => Some((lane, s)),
        LaneAt::None(_) | LaneAt::Unknown => None,
    }
}

/// Returns the lane section of a road at a station, for one side.
pub fn section_of<'m, 'r>(road: &'m Road<'r>, side: Side, s: f64) -> Option<SectionRef<'m, 'r>> {
    road.permanent()?.section_at(road, side, s)
}
