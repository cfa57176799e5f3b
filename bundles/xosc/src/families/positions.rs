//! Positions that name a road of the map, and their place in the plane.

use std::borrow::Cow;

use crate::prelude::*;
use qcbus_opendrive::LaneRef;
use qcbus_opendrive::SectionRef;
use qcbus_opendrive::Station;

/// Positions that name a road.
pub(crate) const ON_ROAD: &[&str] = &["LanePosition", "RoadPosition"];

/// Tolerance in metres beyond an end of a road. A position within it is still on the road, because
/// digits may have been rounded away.
pub(crate) const AT_END: f64 = 1e-3;

/// Returns the road that a position names, if the map has exactly one of this id.
pub(crate) fn road_of<'m, 'r>(
    position: Element<'_, '_>,
    map: &'m RoadMap<'r>,
) -> Option<&'m Road<'r>> {
    let id = position.text("roadId")?;
    let mut roads = map.roads_with_id(&id);
    let road = roads.next()?;
    roads.next().is_none().then_some(road)
}

/// Returns the station that a position names. A rounding error at the ends is corrected. Returns
/// `None` if the station is unknown or beyond the road's ends.
pub(crate) fn station(position: Element<'_, '_>, road: &Road<'_>) -> Option<f64> {
    let s = position.number("s")?;
    let length = road.length()?;
    let slack = AT_END + length * 1e-6;
    (s >= -slack && s <= length + slack).then(|| s.clamp(0.0, length))
}

/// Parses the id of a lane. Returns `None` if it is no integer.
pub(crate) fn lane_id(text: &str) -> Option<i64> {
    text.trim_matches([' ', '\t', '\r', '\n']).parse().ok()
}

/// Returns the lane at a station. Where two lane sections meet, the lanes of both count. Lanes of
/// temporary layers count too. A simulator may use any of them.
pub(crate) fn find_lane<'m, 'r>(road: &'m Road<'r>, s: f64, id: i64) -> LaneAt<'m, 'r> {
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
pub(crate) fn lane_of<'m, 'r>(
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
pub(crate) fn section_of<'m, 'r>(
    road: &'m Road<'r>,
    side: Side,
    s: f64,
) -> Option<SectionRef<'m, 'r>> {
    road.permanent()?.section_at(road, side, s)
}

/// A place in the plane of the map, or relative to an entity at an unknown place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spot<'d> {
    frame: Frame<'d>,
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Height, or `None` if the road surface determines it.
    z: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
enum Frame<'d> {
    World,
    /// Relative to an entity, along the axes of the world.
    Beside(Cow<'d, str>),
    /// Relative to an entity, along the axes of the entity.
    Within(Cow<'d, str>),
}

impl<'d> Spot<'d> {
    /// Returns the place of a `Position`.
    pub(crate) fn of(position: Element<'_, 'd>) -> Option<Spot<'d>> {
        let kind = position.children().next()?;
        match kind.name() {
            "WorldPosition" => Spot::numbers(kind, Frame::World, ["x", "y", "z"], None),
            "RelativeWorldPosition" => {
                let frame = Frame::Beside(kind.text("entityRef")?);
                Spot::numbers(kind, frame, ["dx", "dy", "dz"], Some(0.0))
            }
            "RelativeObjectPosition" => {
                let frame = Frame::Within(kind.text("entityRef")?);
                Spot::numbers(kind, frame, ["dx", "dy", "dz"], Some(0.0))
            }
            "RoadPosition" | "LanePosition" => {
                let scenario = kind.scenario();
                scenario.on_map(|map| Spot::on_map(kind, map)).flatten()
            }
            _ => None,
        }
    }

    fn numbers(
        element: Element<'_, 'd>,
        frame: Frame<'d>,
        [x, y, z]: [&str; 3],
        no_height: Option<f64>,
    ) -> Option<Spot<'d>> {
        let z = if element.has(z) {
            Some(element.number(z)?)
        } else {
            no_height
        };
        Some(Spot {
            frame,
            x: element.number(x)?,
            y: element.number(y)?,
            z,
        })
    }

    fn on_map(element: Element<'_, 'd>, map: &RoadMap<'_>) -> Option<Spot<'d>> {
        let road = road_of(element, map)?;
        let s = station(element, road)?;
        let t = if element.is("RoadPosition") {
            element.number("t")?
        } else {
            let (lane, _) = lane_of(element, road)?;
            let ds = s - lane.at.s()?;
            let offset = if element.has("offset") {
                element.number("offset")?
            } else {
                0.0
            };
            f64::midpoint(lane.inner_t(ds)?, lane.outer_t(ds)?) + offset
        };
        let point = road.pose(s)?.beside(t)?;
        Some(Spot {
            frame: Frame::World,
            x: point.x,
            y: point.y,
            z: None,
        })
    }

    /// Returns the distance between two places, if it is known. If a height is unknown, it is the
    /// distance in the plane.
    pub(crate) fn distance(&self, other: &Spot<'d>) -> Option<f64> {
        if self.frame != other.frame {
            return None;
        }
        let up = match (self.z, other.z) {
            (Some(one), Some(two)) => one - two,
            _ => 0.0,
        };
        let plan = (self.x - other.x).hypot(self.y - other.y);
        Some(plan.hypot(up)).filter(|distance| distance.is_finite())
    }
}

/// Returns the entities that an action moves. Returns `None` if one of them is unknown.
pub(crate) fn moved<'m, 'd>(element: Element<'m, 'd>) -> Option<Vec<&'m Entity<'d>>> {
    let names = Actors::of(element)?.names()?;
    let entities = element.scenario().entities();
    let mut moved = Vec::new();
    for name in names {
        moved.extend(entities.expand(&name)?);
    }
    Some(moved)
}

/// Returns the action or element that a position belongs to: the parent of its `Position`.
pub(crate) fn owner<'m, 'd>(kind: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    kind.parent()?.parent()
}

/// Sorts ids and names: numbers by value, then words.
pub(crate) fn sorted<'i>(ids: impl Iterator<Item = &'i str>) -> Vec<&'i str> {
    let key = |id: &&str| {
        id.parse::<i64>()
            .map_or((true, 0), |number| (false, number))
    };
    let mut ids: Vec<&str> = ids.collect();
    ids.sort_unstable_by(|one, other| key(one).cmp(&key(other)).then_with(|| one.cmp(other)));
    ids.dedup();
    ids
}

/// Lists the first few ids for a message, and the number of the others.
pub(crate) fn listed<'i>(ids: impl Iterator<Item = &'i str>) -> String {
    const MOST: usize = 8;
    let mut text = String::new();
    let mut more = 0_usize;
    for (at, id) in ids.enumerate() {
        if at >= MOST {
            more += 1;
            continue;
        }
        if at > 0 {
            text.push_str(", ");
        }
        text.push('`');
        text.push_str(id);
        text.push('`');
    }
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}

/// Formats a value for a message. If it comes from a parameter or an expression, the written text
/// is added.
pub(crate) fn shown(element: Element<'_, '_>, attribute: &str, value: &str) -> String {
    match element.written(attribute) {
        Some(written) if written.contains('$') => format!("{value} (`{written}`)"),
        _ => value.to_owned(),
    }
}

/// Formats a length or a coordinate in metres for a message, rounded to millimetres.
pub(crate) fn metres(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    format!("{} m", if rounded == 0.0 { 0.0 } else { rounded })
}
