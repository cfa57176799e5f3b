//! Start positions of entities, including positions relative to other entities.

use std::cell::RefCell;

use foldhash::{HashMap, HashMapExt as _};
use qcbus_opendrive::{LaneRef, Road, RoadMap, Side, TrafficRule};

use super::positions::{AT_END, find_lane, lane_of, road_of, section_of, station};
use super::relative::{self, OnRoad};
use super::starts::{Start, starts};
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::road_network::{LaneAt, RoadNetwork};

/// Position in the world, and on the road if the road is known.
#[derive(Debug, Clone, Copy)]
pub struct Whereabouts<'w, 'r> {
    /// In metres.
    pub x: f64,
    /// In metres.
    pub y: f64,
    /// Height, or `None` if it is unknown.
    pub z: Option<f64>,
    /// Direction in which it faces.
    pub heading: f64,
    /// Whether all simulators agree on the heading. On the left of a road, some let an entity face
    /// along the road and some against it.
    pub is_sure: bool,
    /// Position on a road, if it was placed on one. Otherwise [`Origins::on`] searches for it.
    on: Option<OnRoad<'w, 'r>>,
}

enum Memo<'w, 'r> {
    New,
    /// The place is being computed. Reaching it again means a cycle.
    Open,
    Done(Option<Whereabouts<'w, 'r>>),
}

/// The places of all entities that are teleported in `Init`.
pub struct Origins<'m, 'd, 'w, 'r> {
    /// The teleports of `Init`.
    pub starts: Vec<Start<'m, 'd>>,
    /// Index of the start, or `None` if an entity is teleported more than once.
    by_name: HashMap<String, Option<usize>>,
    memo: RefCell<Vec<Memo<'w, 'r>>>,
    map: Option<&'w RoadMap<'r>>,
    network: Option<&'m RoadNetwork>,
}

/// Positions that are relative to an entity.
const RELATIVE: &[&str] = &[
    "RelativeLanePosition",
    "RelativeRoadPosition",
    "RelativeWorldPosition",
    "RelativeObjectPosition",
];

impl<'m, 'd, 'w, 'r> Origins<'m, 'd, 'w, 'r> {
    /// Creates the origins. `map` is the scenario's map, if it is known.
    pub fn of(scenario: &'m Scenario<'d>, map: Option<&'w RoadMap<'r>>) -> Origins<'m, 'd, 'w, 'r> {
        let starts = starts(scenario);
        let mut by_name = HashMap::new();
        for (at, start) in starts.iter().enumerate() {
            by_name
                .entry(start.name.clone())
                .and_modify(|place| *place = None)
                .or_insert(Some(at));
        }
        Origins {
            memo: RefCell::new(starts.iter().map(|_| Memo::New).collect()),
            starts,
            by_name,
            map,
            network: scenario.network().map(),
        }
    }

    /// Returns the entity that a position is relative to, and its place.
    pub fn base(&self, position: Element<'m, 'd>) -> Option<(String, Whereabouts<'w, 'r>)> {
        let name = relative_to(position)?;
        let at = (*self.by_name.get(&name)?)?;
        Some((name, self.place(at)?))
    }

    /// Returns the place of the entity of a start.
    pub fn place(&self, at: usize) -> Option<Whereabouts<'w, 'r>> {
        let mut way = Vec::new();
        let mut next = Some(at);
        while let Some(here) = next {
            match self.memo.borrow_mut().get_mut(here) {
                Some(memo @ Memo::New) => *memo = Memo::Open,
                _ => break,
            }
            way.push(here);
            let name = self
                .starts
                .get(here)
                .and_then(|start| relative_to(start.position));
            next = name.and_then(|name| self.by_name.get(&name).copied().flatten());
        }
        while let Some(here) = way.pop() {
            let place = self.starts.get(here).and_then(|start| {
                let base = relative_to(start.position).map(|name| self.known(&name));
                self.compute(start.position, base)
            });
            if let Some(memo) = self.memo.borrow_mut().get_mut(here) {
                *memo = Memo::Done(place);
            }
        }
        match self.memo.borrow().get(at) {
            Some(Memo::Done(place)) => *place,
            _ => None,
        }
    }

    /// Returns the place of a position, such as `WorldPosition`. Positions relative to an entity
    /// are known in `Init` only, because the entity moves afterwards.
    pub fn locate(&self, position: Element<'m, 'd>, is_start: bool) -> Option<Whereabouts<'w, 'r>> {
        let base = match relative_to(position) {
            Some(_) if !is_start => return None,
            Some(_) => Some(self.base(position).map(|(_, base)| base)),
            None => None,
        };
        self.compute(position, base)
    }

    /// Returns the place of an entity, if it is already computed.
    fn known(&self, name: &str) -> Option<Whereabouts<'w, 'r>> {
        let at = (*self.by_name.get(name)?)?;
        match self.memo.borrow().get(at) {
            Some(Memo::Done(place)) => *place,
            _ => None,
        }
    }

    fn compute(
        &self,
        position: Element<'m, 'd>,
        base: Option<Option<Whereabouts<'w, 'r>>>,
    ) -> Option<Whereabouts<'w, 'r>> {
        match (position.name(), base) {
            ("WorldPosition", _) => Some(Whereabouts {
                x: position.number("x")?,
                y: position.number("y")?,
                z: position.number("z"),
                heading: or(position, "h", 0.0)?,
                is_sure: true,
                on: None,
            }),
            ("LanePosition", _) => {
                let road = road_of(position, self.map?)?;
                let (lane, s) = lane_of(position, road)?;
                let t = middle(lane, s)? + or(position, "offset", 0.0)?;
                oriented(position, on_map(road, s, t, lane.id())?)
            }
            ("RoadPosition", _) => {
                let road = road_of(position, self.map?)?;
                let (s, t) = (station(position, road)?, position.number("t")?);
                oriented(position, on_map(road, s, t, lane_at(road, s, t))?)
            }
            ("RelativeRoadPosition", Some(base)) => {
                let on = self.on(&base?)?;
                let s = within(on.road, on.s + position.number("ds")?)?;
                let t = on.t + position.number("dt")?;
                oriented(position, on_map(on.road, s, t, lane_at(on.road, s, t))?)
            }
            ("RelativeLanePosition", Some(base)) => beside(position, self.on(&base?)?),
            ("RelativeWorldPosition", Some(base)) => moved(position, base?, 0.0),
            ("RelativeObjectPosition", Some(base)) => {
                let base = base.filter(|base| base.is_sure)?;
                moved(position, base, base.heading)
            }
            _ => None,
        }
    }

    /// Returns the position of a place on a road, if there is only one road.
    pub fn on(&self, place: &Whereabouts<'w, 'r>) -> Option<OnRoad<'w, 'r>> {
        if place.on.is_some() {
            return place.on;
        }
        let map = self.map?;
        let nearby = self.network?.nearby();
        let (road, s, t) = nearby.only_road_at(map, place.x, place.y)?;
        let hdg = road.pose(s)?.hdg;
        Some(OnRoad {
            road,
            s,
            t,
            lane: lane_at(road, s, t),
            along: place.is_sure && (place.heading - hdg).cos() > 0.5,
        })
    }
}

/// Returns a place at given distances in directions that are rotated by an angle.
fn moved<'w, 'r>(
    position: Element<'_, '_>,
    base: Whereabouts<'w, 'r>,
    turned: f64,
) -> Option<Whereabouts<'w, 'r>> {
    let (dx, dy) = (position.number("dx")?, position.number("dy")?);
    let (sin, cos) = turned.sin_cos();
    let place = Whereabouts {
        x: base.x + dx * cos - dy * sin,
        y: base.y + dx * sin + dy * cos,
        // Without `dz` the height is that of the ground at the new place.
        z: position.number("dz").and_then(|dz| Some(base.z? + dz)),
        on: None,
        ..base
    };
    oriented(position, place)
}

/// Returns the entity that a position is relative to.
fn relative_to(position: Element<'_, '_>) -> Option<String> {
    let name = RELATIVE
        .contains(&position.name())
        .then(|| position.text("entityRef"))??;
    Some(name.into_owned())
}

/// Returns an optional number. Returns `None` if it exists but is unknown.
pub fn or(element: Element<'_, '_>, name: &str, otherwise: f64) -> Option<f64> {
    if element.has(name) {
        element.number(name)
    } else {
        Some(otherwise)
    }
}

/// Returns the middle of a lane.
fn middle(lane: LaneRef<'_, '_>, s: f64) -> Option<f64> {
    let ds = s - lane.at.s()?;
    Some(f64::midpoint(lane.inner_t(ds)?, lane.outer_t(ds)?))
}

/// Returns a station if it is on the road.
pub fn within(road: &Road<'_>, s: f64) -> Option<f64> {
    let length = road.length()?;
    (s >= -AT_END && s <= length + AT_END).then(|| s.clamp(0.0, length))
}

/// Returns a place beside a road that faces in the direction of traffic.
fn on_map<'w, 'r>(
    road: &'w Road<'r>,
    s: f64,
    t: f64,
    lane: Option<i64>,
) -> Option<Whereabouts<'w, 'r>> {
    let pose = road.pose(s)?;
    let point = pose.beside(t)?;
    let along = t < 0.0 && road.traffic_rule() != Some(TrafficRule::LeftHand);
    let turned = if t > 0.0 { std::f64::consts::PI } else { 0.0 };
    Some(Whereabouts {
        x: point.x,
        y: point.y,
        z: road.surface_point(s, t).map(|point| point.z),
        heading: pose.hdg + turned,
        is_sure: along,
        on: Some(OnRoad {
            road,
            s,
            t,
            lane,
            along,
        }),
    })
}

/// Returns the place with the position's `Orientation` applied.
fn oriented<'w, 'r>(
    position: Element<'_, '_>,
    place: Whereabouts<'w, 'r>,
) -> Option<Whereabouts<'w, 'r>> {
    let Some(orientation) = position.child("Orientation") else {
        return Some(place);
    };
    let h = or(orientation, "h", 0.0)?;
    let is_absolute = orientation.has("type") && &*orientation.word("type")? == "absolute";
    let (heading, is_sure) = if is_absolute {
        (h, true)
    } else {
        (place.heading + h, place.is_sure)
    };
    let turned = (heading - place.heading).cos() < 0.5;
    let on = place.on.map(|on| OnRoad {
        along: on.along && !turned,
        ..on
    });
    Some(Whereabouts {
        heading,
        is_sure,
        on,
        ..place
    })
}

/// Returns the lane that contains a place.
fn lane_at(road: &Road<'_>, s: f64, t: f64) -> Option<i64> {
    let side = if t > 0.0 { Side::Left } else { Side::Right };
    let section = section_of(road, side, s)?;
    let ds = s - section.s()?;
    let mut lanes = section.side(side).filter(|lane| {
        let borders = lane.inner_t(ds).zip(lane.outer_t(ds));
        borders.is_some_and(|(inner, outer)| {
            t > inner.min(outer) + AT_END && t < inner.max(outer) - AT_END
        })
    });
    let lane = lanes.next()?;
    lanes.next().is_none().then(|| lane.id())?
}

/// Returns the place of a `RelativeLanePosition`, if it is unambiguous.
fn beside<'w, 'r>(position: Element<'_, '_>, on: OnRoad<'w, 'r>) -> Option<Whereabouts<'w, 'r>> {
    let lanes = relative::lanes(position, on)?;
    let ds = relative::ways(position, on)?;
    let &[ds] = ds.as_slice() else { return None };
    let s = within(on.road, on.s + ds)?;
    let mut there = lanes
        .into_iter()
        .filter_map(|id| match find_lane(on.road, s, id) {
            LaneAt::Lane(lane) => Some(lane),
            LaneAt::None(_) | LaneAt::Unknown => None,
        });
    let lane = there.next()?;
    if there.next().is_some() {
        return None;
    }
    let t = middle(lane, s)? + or(position, "offset", 0.0)?;
    oriented(position, on_map(on.road, s, t, lane.id())?)
}
