//! Positions that name a road of the map, and their place in the plane.

use std::borrow::Cow;

use crate::prelude::*;

pub(crate) use qcbus_openscenario::places::{
    find_lane, lane_id, lane_of, road_of, section_of, station,
};

/// Positions that name a road.
pub(crate) const ON_ROAD: &[&str] = &["LanePosition", "RoadPosition"];

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
