use crate::families::positions::{find_lane, lane_of, metres, moved, owner, road_of};
use crate::prelude::*;
use foldhash::HashSet;
use qcbus_opendrive::LaneRef;
use qcbus_openscenario::places::Origins;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Lane types on which no motor vehicle drives or stands.
const NOT_FOR_VEHICLES: &[&str] = &[
    "none", "border", "median", "curb", "sidewalk", "walking", "biking", "rail", "tram",
];

/// Lane types on which a pedestrian obstructs vehicles from the start.
const FOR_VEHICLES: &[&str] = &[
    "driving",
    "entry",
    "exit",
    "onRamp",
    "offRamp",
    "connectingRamp",
    "slipLane",
    "bidirectional",
    "HOV",
    "bus",
    "taxi",
    "mwyEntry",
    "mwyExit",
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    scenario.on_map(|map| look(scenario, map, found));
}

fn look(scenario: &Scenario<'_>, map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut unfit_there = HashSet::default();
    for position in scenario.elements_everywhere("LanePosition") {
        let Some(owner) = owner(position) else {
            continue;
        };
        let goes = match owner.name() {
            "TeleportAction" => "is placed",
            "AcquirePositionAction" => "is sent to a position",
            _ => continue,
        };
        let lane = road_of(position, map).and_then(|road| lane_of(position, road));
        let Some((lane, s)) = lane.filter(|(lane, _)| lane.id() != Some(0)) else {
            continue;
        };
        let Some(kind) = lane.kind() else { continue };
        let is_init = owner.ancestor("Init").is_some();
        let entities = moved(position).unwrap_or_default();
        let judged = entities.into_iter().filter_map(|entity| {
            let level = unfit(scenario, entity, lane, kind, is_init)?;
            Some((entity, level))
        });
        for (at, (entity, level)) in judged.enumerate() {
            if at == 0 {
                say(position, entity, goes, (lane, kind, s), level, found);
            }
            if is_init {
                unfit_there.insert(entity.name().to_owned());
            }
        }
    }
    relative_to_others(scenario, map, unfit_there, found);
}

/// Reports entities that start on an unfit lane because of a relative position. An entity in the
/// same lane as a reported one is left out.
fn relative_to_others(
    scenario: &Scenario<'_>,
    map: &RoadMap<'_>,
    mut said_of: HashSet<String>,
    found: &mut Sink<'_>,
) {
    let origins = Origins::of(scenario, Some(map));
    let mut said = HashSet::default();
    for (at, start) in origins.starts.iter().enumerate() {
        let position = start.position;
        let is_relative = position.name().starts_with("Relative");
        let entity = scenario.entities().object(&start.name);
        let Some(entity) = entity.filter(|_| is_relative) else {
            continue;
        };
        let place = origins.place(at).and_then(|place| origins.on(&place));
        let lane = place.and_then(|on| Some((on.road, on.lane.filter(|id| *id != 0)?, on.s)));
        let Some((road, id, s)) = lane else { continue };
        let LaneAt::Lane(lane) = find_lane(road, s, id) else {
            continue;
        };
        let level = lane
            .kind()
            .and_then(|kind| Some((kind, unfit(scenario, entity, lane, kind, true)?)));
        let same_lane = position.number("dLane") == Some(0.0);
        let other = position.text("entityRef").filter(|_| same_lane);
        let follows = other.is_some_and(|other| said_of.contains(&*other));
        if level.is_some() {
            said_of.insert(start.name.clone());
        }
        if follows {
            continue;
        }
        if let Some((kind, level)) = level
            && said.insert(position.node().offset())
        {
            let goes = "starts, relative to another entity,";
            say(position, entity, goes, (lane, kind, s), level, found);
        }
    }
}

fn say(
    position: Element<'_, '_>,
    entity: &Entity<'_>,
    goes: &str,
    (lane, kind, s): (LaneRef<'_, '_>, &str, f64),
    level: Level,
    found: &mut Sink<'_>,
) {
    let what = if entity.kind() == EntityKind::Pedestrian {
        "pedestrian"
    } else {
        "vehicle"
    };
    let text = format!(
        "the {what} `{}` {goes} on the lane `{}` of road `{}` at s = {}, which is of type `{kind}`",
        entity.name(),
        lane.id_text().unwrap_or(""),
        lane.at.road.id(),
        metres(s)
    );
    found
        .about(
            position,
            if position.has("dLane") {
                "dLane"
            } else {
                "laneId"
            },
            text,
        )
        .level(level)
        .at(lane.node(), "the lane");
}

/// Returns the level of an entity on a lane of this type. Returns `None` if it belongs there.
fn unfit<'d>(
    scenario: &Scenario<'d>,
    entity: &Entity<'d>,
    lane: LaneRef<'_, '_>,
    kind: &str,
    is_init: bool,
) -> Option<Level> {
    match entity.kind() {
        EntityKind::Vehicle if NOT_FOR_VEHICLES.contains(&kind) => {
            let category = entity.object(scenario)?.word("vehicleCategory")?;
            let fits = match &*category {
                "bicycle" => kind != "rail",
                "tram" | "train" => kind == "rail" || kind == "tram",
                // Bicycles may share such lanes with other vehicles.
                _ => kind == "biking" && lane.advisory().is_some_and(|word| word != "none"),
            };
            (!fits).then_some(Level::Warning)
        }
        // A pedestrian that goes to a driving lane later crosses the road.
        EntityKind::Pedestrian if is_init && FOR_VEHICLES.contains(&kind) => {
            Some(Level::Information)
        }
        _ => None,
    }
}
