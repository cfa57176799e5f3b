use crate::families::positions::{ON_ROAD, lane_of, metres, road_of, section_of, shown, station};
use crate::families::relative::OnRoad;
use crate::families::relative::{self, Reach};
use crate::prelude::*;
use foldhash::HashSet;
use qcbus_opendrive::LaneRef;
use qcbus_openscenario::places::Origins;

pub const RULE: Rule<Scene> = Rule {
    uids: &[
        "asam.net:xosc:1.0.0:positioning.road_lane_offset_in_bounds",
        "qcbus.dev:xosc:1.0.0:range.laneposition_s",
        "qcbus.dev:xosc:1.0.0:range.roadposition_s",
    ],
    params: &[SLACK],
    run,
    ..Rule::after(READABLE)
};

const SLACK: Param = Param::number(
    "slack",
    1e-3,
    "m",
    "largest distance of a position beyond a road's end or a lane's border that is accepted; along the road, a \
     millionth of its length is added",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let looked = scenario.on_map(|map| look(scenario, Some(map), found));
    looked.unwrap_or_else(|| look(scenario, None, found));
}

fn look(scenario: &Scenario<'_>, map: Option<&RoadMap<'_>>, found: &mut Sink<'_>) {
    let slack = found.number(&SLACK);
    for name in ON_ROAD {
        for position in scenario.elements_everywhere(name) {
            let Some(s) = position.number("s") else {
                continue;
            };
            let road = map.and_then(|map| road_of(position, map));
            if s < -slack {
                before(position, s, road, found);
                continue;
            }
            let Some(road) = road else { continue };
            match road.length() {
                Some(length) if s > length + slack + length * 1e-6 => {
                    beyond(position, s, length, road, found);
                }
                Some(_) if position.is("LanePosition") => beside_lane(position, road, slack, found),
                Some(_) => beside_lanes(position, road, slack, found),
                None => {}
            }
        }
    }
    if let Some(map) = map {
        relative_to_others(scenario, map, slack, found);
    }
}

/// Checks the positions of `Init` that are relative to the start of another entity.
fn relative_to_others(
    scenario: &Scenario<'_>,
    map: &RoadMap<'_>,
    slack: f64,
    found: &mut Sink<'_>,
) {
    let origins = Origins::of(scenario, Some(map));
    let mut reach = Reach::of(map);
    let mut said = HashSet::default();
    for (at, start) in origins.starts.iter().enumerate() {
        let position = start.position;
        let is_along = ["RelativeLanePosition", "RelativeRoadPosition"].contains(&position.name());
        if !is_along || !said.insert(position.node().offset()) {
            continue;
        }
        let Some((name, base)) = origins.base(position) else {
            continue;
        };
        let Some((on, ways)) = origins
            .on(&base)
            .and_then(|on| Some((on, relative::ways(position, on)?)))
        else {
            continue;
        };
        if let Some(place) = origins.place(at).and_then(|place| origins.on(&place)) {
            beside_after_all(position, place, slack, found);
            continue;
        }
        // The maximum distance for each interpretation of the position.
        let missing = ways.iter().map(|ds| {
            let reach = reach.as_mut()?;
            let most = reach.from(on.road, on.s, *ds > 0.0)?;
            (ds.abs() > most + slack + most * 1e-6).then_some(most)
        });
        let Some(most) = missing.collect::<Option<Vec<f64>>>() else {
            continue;
        };
        let Some((ds, most)) = ways.first().zip(most.first()) else {
            continue;
        };
        let direction = if *ds > 0.0 { "along" } else { "against" };
        let text = format!(
            "`{}` leads {} {direction} the road `{}` from s = {}, where `{name}` starts, but the roads there end \
             after {}",
            position.name(),
            shown(position, "ds", &metres(ds.abs())),
            on.road.id(),
            metres(on.s),
            metres(*most)
        );
        found
            .about(position, "ds", text)
            .at(on.road.node(), "the road");
    }
}

/// Checks whether a relative position lies within its lane or its road's lanes.
fn beside_after_all(
    position: Element<'_, '_>,
    place: OnRoad<'_, '_>,
    slack: f64,
    found: &mut Sink<'_>,
) {
    let road = place.road;
    if position.is("RelativeRoadPosition") {
        let Some((right, left)) = reach_of_lanes(road, place.s) else {
            return;
        };
        if place.t <= left + slack && place.t >= right - slack {
            return;
        }
        let text = format!(
            "`RelativeRoadPosition` leads to t = {}, but the lanes of road `{}` extend from t = {} to t = {} at \
             s = {}",
            metres(place.t),
            road.id(),
            metres(right),
            metres(left),
            metres(place.s)
        );
        let finding = found.about(position, "dt", text).level(Level::Warning);
        finding.at(road.node(), "the road");
        return;
    }
    let Some(offset) = position.number("offset") else {
        return;
    };
    let section = place
        .lane
        .and_then(|id| section_of(road, Side::of_lane_id(id)?, place.s)?.lane(id));
    let Some(lane) = section else { return };
    wide_of(position, offset, lane, place.s, slack, found);
}

fn reach_of_lanes(road: &Road<'_>, s: f64) -> Option<(f64, f64)> {
    let edge = |side| {
        let section = section_of(road, side, s)?;
        section.edge_t(side, s - section.s()?)
    };
    edge(Side::Right).zip(edge(Side::Left))
}

fn before(position: Element<'_, '_>, s: f64, road: Option<&Road<'_>>, found: &mut Sink<'_>) {
    let text = format!(
        "`{}` is at s = {}, but a road starts at s = 0",
        position.name(),
        shown(position, "s", &metres(s))
    );
    let finding = found.about(position, "s", text);
    if let Some(road) = road {
        finding.at(road.node(), "the road");
    }
}

fn beyond(position: Element<'_, '_>, s: f64, length: f64, road: &Road<'_>, found: &mut Sink<'_>) {
    let text = format!(
        "`{}` is at s = {}, but the road `{}` ends at {}",
        position.name(),
        shown(position, "s", &metres(s)),
        road.id(),
        metres(length)
    );
    found.about(position, "s", text).at(road.node(), "the road");
}

fn beside_lane(position: Element<'_, '_>, road: &Road<'_>, slack: f64, found: &mut Sink<'_>) {
    let Some(offset) = position.number("offset") else {
        return;
    };
    if let Some((lane, s)) = lane_of(position, road) {
        wide_of(position, offset, lane, s, slack, found);
    }
}

/// Reports an offset that leads out of a lane.
fn wide_of(
    position: Element<'_, '_>,
    offset: f64,
    lane: LaneRef<'_, '_>,
    s: f64,
    slack: f64,
    found: &mut Sink<'_>,
) {
    // The center lane has no width. The fault is that it is named at all.
    if lane.id() == Some(0) {
        return;
    }
    let width = lane.at.s().and_then(|start| lane.width(s - start));
    let Some(width) = width.filter(|width| offset.abs() > width / 2.0 + slack) else {
        return;
    };
    let text = format!(
        "the `offset` of `{}` is {}, but the lane `{}` of road `{}` is {} wide at s = {}; the position is {} \
         outside of it",
        position.name(),
        shown(position, "offset", &metres(offset)),
        lane.id_text().unwrap_or(""),
        lane.at.road.id(),
        metres(width),
        metres(s),
        metres(offset.abs() - width / 2.0)
    );
    found
        .about(position, "offset", text)
        .level(Level::Warning)
        .at(lane.node(), "the lane");
}

fn beside_lanes(position: Element<'_, '_>, road: &Road<'_>, slack: f64, found: &mut Sink<'_>) {
    let Some((t, s)) = position.number("t").zip(station(position, road)) else {
        return;
    };
    let Some((right, left)) = reach_of_lanes(road, s) else {
        return;
    };
    if t <= left + slack && t >= right - slack {
        return;
    }
    let text = format!(
        "`RoadPosition` is at t = {}, but the lanes of road `{}` extend from t = {} to t = {} at s = {}",
        shown(position, "t", &metres(t)),
        road.id(),
        metres(right),
        metres(left),
        metres(s)
    );
    found
        .about(position, "t", text)
        .level(Level::Warning)
        .at(road.node(), "the road");
}
