use std::cell::LazyCell;

use crate::families::positions::{self, ON_ROAD, find_lane, lane_id, listed, metres, sorted};
use crate::families::references::quoted;
use crate::families::relative;
use crate::families::values::short;
use crate::prelude::*;
use foldhash::HashSet;
use qcbus_opendrive::SectionRef;
use qcbus_openscenario::RoadNetwork;
use qcbus_openscenario::places::{self, Origins};

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Maximum number of roads in a message.
const MOST_ROADS: usize = 8;

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let network = match scenario.network() {
        Network::Map(network) => network,
        Network::NotHad => return not_looked_for(scenario, found),
        Network::Unnamed | Network::Simulator | Network::Foreign => return,
    };
    network.with(|map| look(scenario, network, map, found));
}

fn look(scenario: &Scenario<'_>, network: &RoadNetwork, map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let roads = LazyCell::new(|| roads(map));
    for name in ON_ROAD {
        for position in scenario.elements_everywhere(name) {
            let Some(id) = position.text("roadId") else {
                continue;
            };
            if map.road(&id).is_none() {
                no_road(position, &id, map, &roads, found);
            } else if position.is("LanePosition")
                && let Some(road) = positions::road_of(position, map)
            {
                lane(position, road, found);
            }
        }
    }
    on_any_road(scenario, network, map, found);
    too_many(scenario, network, map, found);
    let origins = Origins::of(scenario, Some(map));
    let mut said = HashSet::default();
    for start in &origins.starts {
        let is_new = said.insert(start.position.node().offset());
        if is_new && start.position.is("RelativeLanePosition") {
            beside(start.position, &origins, found);
        }
    }
}

/// Checks lanes without a road: some road of the map must have such a lane.
fn on_any_road(
    scenario: &Scenario<'_>,
    network: &RoadNetwork,
    map: &RoadMap<'_>,
    found: &mut Sink<'_>,
) {
    const UNPLACED: &[(&str, &str)] = &[
        ("AbsoluteTargetLane", "value"),
        ("FromLaneCoordinates", "laneId"),
    ];
    for (name, attribute) in UNPLACED {
        for element in scenario.elements_everywhere(name) {
            let Some(text) = element.text(attribute) else {
                continue;
            };
            let Some(all) = network.lane_ids() else {
                return;
            };
            if lane_id(&text).is_some_and(|id| id == 0 || all.contains(&id)) {
                continue;
            }
            let ids: Vec<String> = all.iter().map(ToString::to_string).collect();
            let there = if ids.is_empty() {
                "no road has lanes".to_owned()
            } else {
                format!(
                    "the roads have only {}",
                    listed(ids.iter().map(String::as_str))
                )
            };
            let text = format!(
                "`{name}` refers to the lane {}, but no road of the road network has such a lane; {there}",
                quoted(element, attribute, &text)
            );
            let finding = found.about(element, attribute, text);
            if let Some(root) = map.root() {
                finding.at(root, "the road network");
            }
        }
    }
}

/// Reports changes by more lanes than any road has.
fn too_many(
    scenario: &Scenario<'_>,
    network: &RoadNetwork,
    map: &RoadMap<'_>,
    found: &mut Sink<'_>,
) {
    for target in scenario.elements_everywhere("RelativeTargetLane") {
        let Some(by) = target.integer("value") else {
            continue;
        };
        let most = network.most_lanes();
        // Tools disagree on whether the center lane counts.
        if by.unsigned_abs() <= most {
            continue;
        }
        let text = format!(
            "the `value` of `RelativeTargetLane` is {}, but no road of the road network has more than {most} lanes",
            quoted(target, "value", &by.to_string())
        );
        let finding = found.about(target, "value", text);
        if let Some(root) = map.root() {
            finding.at(root, "the road network");
        }
    }
}

/// Reports a position relative to an entity's first place if no lane exists there, however lanes
/// are counted.
fn beside<'m, 'd>(
    position: Element<'m, 'd>,
    origins: &Origins<'m, 'd, '_, '_>,
    found: &mut Sink<'_>,
) {
    let Some((name, place)) = origins.base(position) else {
        return;
    };
    let Some(on) = origins.on(&place) else {
        return;
    };
    let (Some(lanes), Some(ways)) = (relative::lanes(position, on), relative::ways(position, on))
    else {
        return;
    };
    let mut nowhere = None;
    for ds in ways {
        let Some(s) = places::within(on.road, on.s + ds) else {
            return;
        };
        for id in &lanes {
            let LaneAt::None(section) = find_lane(on.road, s, *id) else {
                return;
            };
            nowhere = nowhere.or(Some((*id, s, section)));
        }
    }
    let (Some((id, s, section)), Some(from)) = (nowhere, on.lane) else {
        return;
    };
    let text = format!(
        "`RelativeLanePosition` leads from the lane `{from}` of road `{}`, where `{name}` starts, to the lane \
         `{id}` at s = {}, but the lane section there {}",
        on.road.id(),
        metres(s),
        lanes_of(section)
    );
    found
        .about(position, "dLane", text)
        .at(on.road.node(), "the road");
}

/// Lists the first of the roads, with their names.
fn roads(map: &RoadMap<'_>) -> String {
    let ids = sorted(map.roads().iter().map(Road::id));
    let named = ids.iter().take(MOST_ROADS).map(|id| {
        let name = map.road(id).and_then(|road| road.node().attr("name"));
        match name.filter(|name| !name.is_empty() && *name != *id) {
            Some(name) => format!("`{id}` ({})", short(name)),
            None => format!("`{id}`"),
        }
    });
    let named: Vec<String> = named.collect();
    match ids.len().saturating_sub(MOST_ROADS) {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

/// Reports once that roads could not be looked up without the map. The author then knows what
/// depends on the map's path.
fn not_looked_for(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let positions = ON_ROAD
        .iter()
        .flat_map(|name| scenario.elements_everywhere(name));
    let mut positions = positions.filter(|position| position.has("roadId"));
    let Some(first) = positions.next() else {
        return;
    };
    let more = match positions.count() {
        0 => " was".to_owned(),
        1 => " and one more road were".to_owned(),
        count => format!(" and the roads of {count} more positions were"),
    };
    let road = first.text("roadId").unwrap_or_default();
    let text = format!(
        "the road {}{more} not checked, because the map could not be read",
        quoted(first, "roadId", &road)
    );
    // The missing map is reported for itself.
    found.about(first, "roadId", text).level(Level::Information);
}

fn no_road(
    position: Element<'_, '_>,
    id: &str,
    map: &RoadMap<'_>,
    roads: &str,
    found: &mut Sink<'_>,
) {
    let there = if roads.is_empty() {
        "has no roads".to_owned()
    } else if map.roads().len() == 1 {
        format!("has only the road {roads}")
    } else {
        format!("has the roads {roads}")
    };
    let text = format!(
        "`{}` is on the road {}, but the road network {there}",
        position.name(),
        quoted(position, "roadId", id)
    );
    let finding = found.about(position, "roadId", text);
    if let Some(root) = map.root() {
        finding.at(root, "the road network");
    }
}

fn lane(position: Element<'_, '_>, road: &Road<'_>, found: &mut Sink<'_>) {
    let Some(text) = position.text("laneId") else {
        return;
    };
    let Some(id) = lane_id(&text) else {
        // Tools that write such names also write them into the map.
        let is_written = road
            .sections()
            .flat_map(|section| section.lanes())
            .all(|lane| lane.id().is_some());
        let (level, why) = if is_written {
            (Level::Error, "so this lane does not exist")
        } else {
            (Level::Information, "so this lane was not looked up")
        };
        let text = format!(
            "`LanePosition` refers to the lane {}, which is not an integer; lanes of roads have integer ids, \
             {why}",
            quoted(position, "laneId", &text)
        );
        found.about(position, "laneId", text).level(level);
        return;
    };
    let Some(s) = positions::station(position, road) else {
        return;
    };
    if let LaneAt::None(section) = find_lane(road, s, id) {
        let text = format!(
            "`LanePosition` refers to the lane {} of road `{}` at s = {}, but the lane section there {}",
            quoted(position, "laneId", &text),
            road.id(),
            metres(s),
            lanes_of(section)
        );
        found
            .about(position, "laneId", text)
            .at(road.node(), "the road");
    }
}

/// Lists the existing lanes.
fn lanes_of(section: SectionRef<'_, '_>) -> String {
    let mut ids: Vec<i64> = section.lanes().filter_map(|lane| lane.id()).collect();
    ids.retain(|id| *id != 0);
    ids.sort_unstable_by_key(|id| (-id.signum(), id.unsigned_abs()));
    let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
    if ids.is_empty() {
        "has no lanes".to_owned()
    } else {
        format!("has {}", listed(ids.iter().map(String::as_str)))
    }
}
