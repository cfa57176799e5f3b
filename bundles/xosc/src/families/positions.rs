//! Positions that name a road of the map, and where in the plane a position lies.

use std::borrow::Cow;

use qcbus_opendrive::{LaneRef, Road, RoadMap, SectionRef, Side, Station};
use qcbus_openscenario::{Actors, Element, Entity, LaneAt};

/// Positions that name a road.
pub(crate) const ON_ROAD: &[&str] = &["LanePosition", "RoadPosition"];

/// How far beyond an end of a road a position may lie and still be meant to be on it: digits that
/// were rounded away.
pub(crate) const AT_END: f64 = 1e-3;

/// The road that a position names, where the map has exactly one of this id.
pub(crate) fn road_of<'m, 'r>(
    position: Element<'_, '_>,
    map: &'m RoadMap<'r>,
) -> Option<&'m Road<'r>> {
    let id = position.text("roadId")?;
    let mut roads = map.roads_with_id(&id);
    let road = roads.next()?;
    roads.next().is_none().then_some(road)
}

/// The station that a position names, brought onto the road where it is off by rounding only;
/// `None` where it is unknown or beyond the road's ends.
pub(crate) fn station(position: Element<'_, '_>, road: &Road<'_>) -> Option<f64> {
    let s = position.number("s")?;
    let length = road.length()?;
    let slack = AT_END + length * 1e-6;
    (s >= -slack && s <= length + slack).then(|| s.clamp(0.0, length))
}

/// The id of a lane; `None` for what is no integer.
pub(crate) fn lane_id(text: &str) -> Option<i64> {
    text.trim_matches([' ', '\t', '\r', '\n']).parse().ok()
}

/// The lane at a station. Where two lane sections meet, those of both count, and so do those of
/// temporary layers: a simulator may look at either.
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

/// The lane that a `LanePosition` names.
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

/// The lane section of a road at a station, for a side of it.
pub(crate) fn section_of<'m, 'r>(
    road: &'m Road<'r>,
    side: Side,
    s: f64,
) -> Option<SectionRef<'m, 'r>> {
    road.permanent()?.section_at(road, side, s)
}

/// A place in the plane of the map, or relative to something whose place is not known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spot<'d> {
    frame: Frame<'d>,
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// `None` where the road's surface decides.
    z: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
enum Frame<'d> {
    World,
    /// In the directions of the world, seen from an entity.
    Beside(Cow<'d, str>),
    /// In the directions of an entity.
    Within(Cow<'d, str>),
}

impl<'d> Spot<'d> {
    /// Where a `Position` is.
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

    /// How far two places are apart, where that can be said; in the plane, where a height is not
    /// known.
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

/// The entities that an action moves; `None` when one of them is not known.
pub(crate) fn moved<'m, 'd>(element: Element<'m, 'd>) -> Option<Vec<&'m Entity<'d>>> {
    let names = Actors::of(element)?.names()?;
    let entities = element.scenario().entities();
    let mut moved = Vec::new();
    for name in names {
        moved.extend(entities.expand(&name)?);
    }
    Some(moved)
}

/// The action or element that a position belongs to: what is around its `Position`.
pub(crate) fn owner<'m, 'd>(kind: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    kind.parent()?.parent()
}

/// Ids and names in the order in which people look for them: numbers by their value, before words.
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

/// Some ids for a text: the first few, and how many more there are.
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

/// A value for a text; where a parameter or an expression led to it, what is written, too.
pub(crate) fn shown(element: Element<'_, '_>, attribute: &str, value: &str) -> String {
    match element.written(attribute) {
        Some(written) if written.contains('$') => format!("{value} (`{written}`)"),
        _ => value.to_owned(),
    }
}

/// A length or a coordinate for a text: millimetres are enough.
pub(crate) fn metres(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    format!("{} m", if rounded == 0.0 { 0.0 } else { rounded })
}
